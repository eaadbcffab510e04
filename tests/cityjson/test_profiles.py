"""Every profile is valid and comes back: parents exact, nodes and radii within half a step."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.cityjson import (
    CityjsonOptions,
    SeqWriter,
    check,
    extension,
    from_cityjson,
    to_cityjson,
    write_cityjson,
)
from pipeline.cityjson.extension import FILE
from pipeline.cityjson.schema import schema_findings
from pipeline.lsystem import decode, read_lsjson
from pipeline.model import Skeleton, TreeModel

PROFILES = {
    "default": {},
    "object": {"skeleton_object": True},
    "object_only": {"skeleton_object": True, "skeleton": False},
    "extension": {"profile": "extension"},
    "extension_lines": {"profile": "extension", "skeleton": False},
    "compact": {"profile": "compact"},
}


def options(profile: str, **more: Any) -> CityjsonOptions:
    return CityjsonOptions(**{**PROFILES[profile], **more})


@pytest.fixture(scope="module")
def schema(shared_data: Path) -> Any:
    return json.loads((shared_data / "cityjson" / "cityjson.min.schema.json").read_bytes())


def class_width(tree: TreeModel, classes: int) -> float:
    return float(np.ptp(tree.radius)) / (classes - 1)


def assert_same(again: TreeModel, tree: TreeModel, *, node: float, radius: float) -> None:
    assert np.array_equal(again.skeleton.parent, tree.skeleton.parent)
    assert np.abs(again.skeleton.world - tree.skeleton.world).max() <= node / 2 + 1e-9
    assert np.abs(again.radius - tree.radius).max() <= radius / 2 + 1e-9
    assert again.skeleton.crs == tree.skeleton.crs


@pytest.mark.parametrize("profile", PROFILES)
def test_every_profile_is_valid(profile: str, tree: TreeModel, schema: Any) -> None:
    document = to_cityjson(tree, name="oak", options=options(profile))
    assert check(document, schema=schema) == []
    assert ("extensions" in document) == (options(profile).profile != "default")


@pytest.mark.parametrize("profile", PROFILES)
def test_every_profile_comes_back(profile: str, tree: TreeModel) -> None:
    again = from_cityjson(to_cityjson(tree, name="oak", options=options(profile)))
    lines_only = profile in ("object_only", "extension_lines")
    node = 1e-4 if lines_only else 1e-3
    radius = class_width(tree, 10) if profile == "compact" else 1e-4
    assert_same(again, tree, node=node, radius=radius)
    if not lines_only:
        assert np.array_equal(again.radius_source, tree.radius_source)
    assert again.trunk is not None
    assert again.trunk.dbh_m == 0.18
    assert again.trunk.ground_z + again.skeleton.origin[2] == pytest.approx(1.5)
    assert again.metadata == {"species": "Quercus robur"}


def test_the_skeleton_object_has_a_radius_at_every_vertex(tree: TreeModel) -> None:
    document = to_cityjson(tree, name="oak", options=options("object"))
    oak, lines = document["CityObjects"]["oak"], document["CityObjects"]["oak-skeleton"]
    assert oak["children"] == ["oak-skeleton"]
    assert lines["type"] == "GenericCityObject"
    assert lines["parents"] == ["oak"]
    assert lines["attributes"] == {
        "tree": "oak",
        "radiusScale": 1e-4,
        "radii": [[1000, 900, 600], [300, 300, 20], [50, 50]],
    }
    (shape,) = lines["geometry"]
    zero = document["transform"]["translate"]
    at = [np.array(document["vertices"])[line] * 1e-4 + zero for line in shape["boundaries"]]
    for line, path in zip(at, tree.skeleton.paths, strict=True):
        assert np.abs(line - tree.skeleton.world[path]).max() <= 5e-5 + 1e-9
    plain = to_cityjson(tree, name="oak")
    assert len(oak["geometry"]) == len(plain["CityObjects"]["oak"]["geometry"])


def test_the_hull_is_the_same_with_and_without_lines(tree: TreeModel) -> None:
    plain, both = (to_cityjson(tree, name="oak", options=options(p)) for p in ("default", "object"))
    faces = [d["CityObjects"]["oak"]["geometry"][0]["boundaries"] for d in (plain, both)]
    place = [np.array(d["vertices"])[np.array(f)] for d, f in zip((plain, both), faces, strict=True)]
    assert np.array_equal(*place)


def test_the_extension_profile_says_which_branch_a_solid_is(tree: TreeModel) -> None:
    document = to_cityjson(tree, name="oak", options=options("extension"))
    oak = document["CityObjects"]["oak"]
    assert "skeleton" not in oak["attributes"]
    assert oak["attributes"]["+treeskel-graph"]["parent"] == [-1, 0, 1, 1, 3, 3]
    assert document["CityObjects"]["oak-skeleton"]["type"] == "+TreeSkeleton"
    told = [s["semantics"]["surfaces"][0] for s in oak["geometry"] if s["lod"] == "3"]
    assert [(wood["branch"], wood["order"]) for wood in told] == [(0, 0), (1, 1), (2, 2)]
    assert "semantics" not in oak["geometry"][0]  # the hull is no branch


def test_the_compact_profile_holds_ten_classes(tree: TreeModel) -> None:
    document = to_cityjson(tree, name="oak", options=options("compact"))
    (shape,) = document["CityObjects"]["oak"]["geometry"]
    assert shape["type"] == "MultiLineString"
    assert shape["lod"] == "2"
    radii = [s["radius"] for s in shape["semantics"]["surfaces"]]
    assert min(radii) == tree.radius.min()
    assert max(radii) == pytest.approx(tree.radius.max())
    assert document["transform"] == {"scale": [1e-3] * 3, "translate": tree.skeleton.origin.tolist()}
    assert len(document["vertices"]) == len(tree)


def test_a_tree_of_one_node_has_every_profile(schema: Any) -> None:
    lonely = TreeModel(Skeleton(np.zeros((1, 3)), np.array([-1])), np.ones(1), np.zeros(1), np.zeros(1))
    for profile in PROFILES:
        document = to_cityjson(lonely, name="stump", options=options(profile))
        assert check(document, schema=schema) == []
        assert from_cityjson(document).radius.tolist() == [1.0]


def test_the_shipped_extension_is_one(shared_data: Path) -> None:
    ours = extension()
    meta = json.loads((shared_data / "cityjson" / "extension.schema.json").read_bytes())
    assert list(schema_findings(ours, meta)) == []
    assert ours["url"] == CityjsonOptions().extension_url
    assert {"extraRootProperties", "extraAttributes", "extraCityObjects", "extraSemanticSurfaces"} <= set(
        ours
    )


def test_the_extension_stands_beside_the_files_that_name_it(tree: TreeModel, tmp_path: Path) -> None:
    elsewhere = "https://trees.example.com/treeskeleton.ext.json"
    for profile in ("default", "extension", "compact"):
        for url, there in ((FILE, profile != "default"), (elsewhere, False)):
            how = options(profile, extension_url=url)
            one, many = (tmp_path / f"{profile}-{len(url)}-{each}" for each in ("one", "many"))
            write_cityjson(to_cityjson(tree, name="oak", options=how), one / "oak.city.json")
            with SeqWriter(many / "oak.city.jsonl", options=how) as forest:
                forest.add(tree, "oak")
            for folder in (one, many):
                assert (folder / FILE).exists() == there
                if there:
                    assert json.loads((folder / FILE).read_text()) == extension()


def no_scale(d: Any) -> None:
    del d["CityObjects"]["oak"]["attributes"]["+treeskel-graph"]["radiusScale"]


def graph_of_fractions(d: Any) -> None:
    d["CityObjects"]["oak"]["attributes"]["+treeskel-graph"]["radius"][2] = 0.5


def unknown_member(d: Any) -> None:
    d["CityObjects"]["oak"]["attributes"]["+treeskel-graph"]["leaves"] = 7


def no_tree(d: Any) -> None:
    del d["CityObjects"]["oak-skeleton"]["attributes"]["tree"]


def branch_by_name(d: Any) -> None:
    d["CityObjects"]["oak"]["geometry"][-1]["semantics"]["surfaces"][0]["branch"] = "stem"


@pytest.mark.parametrize(
    ("harm", "where"),
    [
        (no_scale, "oak, attributes, +treeskel-graph"),
        (graph_of_fractions, "oak, attributes, +treeskel-graph, radius, 2"),
        (unknown_member, "oak, attributes, +treeskel-graph"),
        (no_tree, "oak-skeleton, attributes"),
        (branch_by_name, "oak, geometry 5, semantic surface 0, branch"),
    ],
)
def test_what_departs_from_the_extension_is_named(harm: Any, where: str, tree: TreeModel) -> None:
    document = to_cityjson(tree, name="oak", options=options("extension"))
    harm(document)
    (found,) = check(document)
    assert found.where == where
    assert "Against the extension TreeSkeleton" in found.what


@pytest.fixture(scope="module")
def real(shared_data: Path) -> TreeModel:
    """A tree of 4,500 nodes that the program of 2021 made of an airborne scan."""
    return decode(read_lsjson(shared_data / "ls2021" / "LAS00_9_lsystem.json"))


def test_the_compact_profile_is_compact(real: TreeModel) -> None:
    text = json.dumps(to_cityjson(real, name="lille", options=options("compact")), separators=(",", ":"))
    assert len(text) < 40 * len(real)


@pytest.mark.parametrize("profile", PROFILES)
def test_a_real_tree_is_valid_and_comes_back(profile: str, real: TreeModel, schema: Any) -> None:
    document = to_cityjson(real, name="lille", options=options(profile))
    assert check(document, schema=schema) == []
    lines_only = profile in ("object_only", "extension_lines")
    radius = class_width(real, 10) if profile == "compact" else 1e-4
    assert_same(from_cityjson(document), real, node=1e-4 if lines_only else 1e-3, radius=radius)


def test_solids_of_a_real_tree_survive_snapping_and_hold_its_volume(real: TreeModel) -> None:
    document = to_cityjson(real, name="lille")
    (lille,) = document["CityObjects"].values()
    at = np.array(document["vertices"]) * 1e-4
    drawn = 0.0
    for shape in lille["geometry"]:
        faces = np.array(shape["boundaries"][0])[:, 0]
        corner = np.rint(at[faces] * 1000).astype(np.int64)
        _, number = np.unique(corner.reshape(-1, 3), axis=0, return_inverse=True)
        surface = np.sort(number.reshape(-1, 3), axis=1)
        assert len(np.unique(surface, axis=0)) == len(surface)
        wide = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        assert np.abs(wide).max(axis=1).min() > 0
        if shape["lod"] == "3":
            a, b, c = (at[faces[:, k]] for k in range(3))
            drawn += float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6
    a, b = np.maximum(real.start_radius, 0.004), np.maximum(real.radius, 0.004)
    frusta = float((np.pi / 3 * (a * a + a * b + b * b) * real.skeleton.length).sum())
    assert drawn == pytest.approx(frusta, rel=0.01)


coordinate = st.floats(-3, 3, width=32) | st.sampled_from([0.0, 1e-5, 1.0])


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.integers(0, 99), coordinate, coordinate, coordinate), max_size=25),
    st.integers(1, 9),
    st.integers(2, 12),
)
def test_any_tree_comes_back_from_the_compact_profile(
    nodes: list[tuple[int, float, float, float]], wide: int, classes: int
) -> None:
    """Nodes that stand in one place too: their lines alone would not tell them apart."""
    xyz = np.array([(0.0, 0.0, 0.0)] + [n[1:] for n in nodes])
    parent = np.array([-1] + [max(i - n[0] % wide, 0) for i, n in enumerate(nodes)])
    radius = np.array([0.2] + [0.001 * n[0] for n in nodes])
    source = np.array([0] + [n[0] % 3 for n in nodes])
    skeleton = Skeleton(xyz, parent, np.array([1e5, 4e5, -3.0]), "EPSG:7415")
    tree = TreeModel(skeleton, radius, source, np.full(len(xyz), np.nan))
    document = to_cityjson(tree, name="t", options=options("compact", radius_classes=classes))
    assert check(document) == []
    again = from_cityjson(document)
    assert_same(again, tree, node=1e-3, radius=class_width(tree, classes))
    assert np.array_equal(again.radius_source, source)
