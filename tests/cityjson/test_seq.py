"""Many trees in one file, one line each."""

from __future__ import annotations

import json
import tracemalloc
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pipeline.cityjson import CityjsonOptions, SeqWriter, check, check_seq, read_seq
from pipeline.errors import InputFormatError, InputMissingError, OutputError, UsageError
from pipeline.model import Skeleton, TreeModel


def at(tree: TreeModel, east: float, crs: str | None = "EPSG:7415") -> TreeModel:
    """Return the tree some metres to the east."""
    skeleton = tree.skeleton
    moved = Skeleton(skeleton.xyz, skeleton.parent, skeleton.origin + [east, 0, 0], crs)
    return TreeModel(moved, tree.radius, tree.radius_source, tree.radius_rmse, tree.trunk, tree.metadata)


def write(path: Path, tree: TreeModel, count: int = 3, **chosen: Any) -> list[dict[str, Any]]:
    with SeqWriter(path, options=CityjsonOptions(**chosen)) as forest:
        for k in range(count):
            forest.add(at(tree, 20.25 * k), f"tree-{k}")
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


def test_the_first_line_is_shared_and_the_others_are_features(tree: TreeModel, tmp_path: Path) -> None:
    head, *features = write(tmp_path / "a.city.jsonl", tree)
    assert head == {
        "type": "CityJSON",
        "version": "2.0",
        "metadata": {"referenceSystem": "https://www.opengis.net/def/crs/EPSG/0/7415"},
        "transform": {"scale": [1e-4] * 3, "translate": [85123, 446789, 1]},
        "CityObjects": {},
        "vertices": [],
    }
    for k, feature in enumerate(features):
        assert list(feature) == ["type", "id", "CityObjects", "vertices"]
        assert feature["type"] == "CityJSONFeature"
        assert feature["id"] == f"tree-{k}"
        (thing,) = feature["CityObjects"].values()
        assert thing["geographicalExtent"][0] == pytest.approx(
            features[0]["CityObjects"]["tree-0"]["geographicalExtent"][0] + 20.25 * k, abs=1e-4
        )


@pytest.mark.parametrize(
    "chosen", [{}, {"skeleton_object": True}, {"profile": "extension"}, {"profile": "compact"}]
)
def test_every_line_is_valid_and_comes_back(
    chosen: dict[str, Any], tree: TreeModel, tmp_path: Path, shared_data: Path
) -> None:
    path = tmp_path / "a.city.jsonl"
    head = write(path, tree, **chosen)[0]
    schemas = shared_data / "cityjson"
    feature = json.loads((schemas / "cityjsonfeature.min.schema.json").read_bytes())
    assert list(check_seq(path, schema=feature)) == []
    assert check(head, schema=json.loads((schemas / "cityjson.min.schema.json").read_bytes())) == []
    radius = np.ptp(tree.radius) / 18 if chosen.get("profile") == "compact" else 5e-5
    names = []
    for k, (name, again) in enumerate(read_seq(path)):
        names.append(name)
        assert np.array_equal(again.skeleton.parent, tree.skeleton.parent)
        assert np.abs(again.skeleton.world - at(tree, 20.25 * k).skeleton.world).max() <= 5e-4 + 1e-9
        assert np.abs(again.radius - tree.radius).max() <= radius + 1e-9
        assert again.skeleton.crs == "EPSG:7415"
    assert names == ["tree-0", "tree-1", "tree-2"]


def test_the_memory_does_not_grow_with_the_trees(tree: TreeModel, tmp_path: Path) -> None:
    def trees(count: int) -> Iterator[tuple[str, TreeModel]]:
        return ((f"tree-{k}", at(tree, float(k))) for k in range(count))

    peak = []
    for count in (5, 10, 60):
        path = tmp_path / f"{count}.city.jsonl"
        tracemalloc.start()
        with SeqWriter(path) as forest:
            for name, one in trees(count):
                forest.add(one, name)
        assert sum(1 for _ in read_seq(path)) == count
        peak.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peak[2] < 2 * peak[1]  # 60 trees take half a megabyte as text, far more as lists
    assert path.stat().st_size > 300_000


def test_a_file_without_trees_has_its_first_line(tmp_path: Path) -> None:
    path = tmp_path / "none.city.jsonl"
    with SeqWriter(path):
        pass
    assert list(read_seq(path)) == []
    assert check(json.loads(path.read_text())) == []


def test_an_error_leaves_no_file(tree: TreeModel, tmp_path: Path) -> None:
    path = tmp_path / "a.city.jsonl"
    write(path, tree, count=1)
    before = path.read_bytes()
    with pytest.raises(UsageError), SeqWriter(path) as forest:  # noqa: PT012 (the loop is the point)
        for name in ("half", ""):
            forest.add(tree, name)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(OutputError, match="is a directory"), SeqWriter(tmp_path):
        pass


def test_what_does_not_fit_is_refused(tree: TreeModel, tmp_path: Path) -> None:
    path = tmp_path / "a.city.jsonl"
    with SeqWriter(path) as forest:
        forest.add(tree, "oak")
        with pytest.raises(UsageError, match="'oak' already"):
            forest.add(tree, "oak")
        with pytest.raises(UsageError, match="is in EPSG:7415, but tree 'elm' in EPSG:2154"):
            forest.add(at(tree, 0, "EPSG:2154"), "elm")
        with pytest.raises(UsageError, match="needs a name"):
            forest.add(tree, "")
    assert [name for name, _ in read_seq(path)] == ["oak"]
    with pytest.raises(UsageError, match="is not open"):
        forest.add(tree, "elm")


def test_the_same_trees_give_the_same_bytes(tree: TreeModel, tmp_path: Path) -> None:
    a, b = tmp_path / "a.city.jsonl", tmp_path / "b.city.jsonl"
    write(a, tree)
    write(b, tree)
    assert a.read_bytes() == b.read_bytes()


@pytest.mark.parametrize(
    ("line", "text", "says"),
    [
        (0, "", "line 2: is not of type CityJSON"),
        (0, "[]", "line 1: is JSON but no object"),
        (1, '{"type":"CityJSON"}', "line 2: is no CityJSONFeature"),
        (1, '{"type":"CityJSONFeature","id":"a","CityObjects":{}}', "line 2: no city object carries"),
        (2, '{"type":"CityJSONFea', "line 3: is not JSON .*cut off"),
        (2, '{"a":NaN}', "line 3: is not JSON"),
    ],
)
def test_damaged_lines_are_named(line: int, text: str, says: str, tree: TreeModel, tmp_path: Path) -> None:
    path = tmp_path / "a.city.jsonl"
    write(path, tree, count=2)
    lines = path.read_text().splitlines()
    lines[line] = text
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(InputFormatError, match=says):
        list(read_seq(path))


def test_empty_and_missing_files_are_named(tmp_path: Path) -> None:
    path = tmp_path / "a.city.jsonl"
    with pytest.raises(InputMissingError, match="no such file"):
        list(read_seq(path))
    path.touch()
    with pytest.raises(InputFormatError, match="is empty"):
        list(read_seq(path))


def test_faults_are_named_by_line(tree: TreeModel, tmp_path: Path) -> None:
    path = tmp_path / "a.city.jsonl"
    head, first, second, third = write(path, tree)
    del first["CityObjects"]["tree-0"]["geometry"][-1]["boundaries"][0][3]
    second["id"] = "nobody"
    third["id"] = "nobody"
    path.write_text("\n".join(json.dumps(line) for line in (head, first, second, third)))
    found = list(check_seq(path))
    assert [(f.where, f.what) for f in found[1:]] == [
        ("line 3, id", "There is no city object 'nobody'."),
        ("line 4, id", "There is a feature 'nobody' already."),
    ]
    assert found[0].where.startswith("line 2, tree-0, geometry 5, shell 0, surface")
    assert "a surface is missing" in found[0].what
