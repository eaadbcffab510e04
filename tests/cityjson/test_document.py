"""Trees as CityJSON: what is written, that it is valid, and that it comes back."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.cityjson import (
    CityjsonOptions,
    check,
    from_cityjson,
    read_cityjson,
    to_cityjson,
    write_cityjson,
)
from pipeline.cityjson.document import crs_url
from pipeline.cityjson.geometry import hull, main_branches, spread
from pipeline.cityjson.graph import decode_graph
from pipeline.errors import InputFormatError, InputMissingError, OutputError, UsageError
from pipeline.model import Skeleton, TreeModel
from tests.pace import slowdown


def of_lod(document: dict[str, Any], lod: str) -> list[dict[str, Any]]:
    (thing,) = document["CityObjects"].values()
    return [shape for shape in thing["geometry"] if shape["lod"] == lod]


def test_the_document_is_the_default_profile(tree: TreeModel) -> None:
    document = to_cityjson(tree, name="oak")
    assert list(document) == ["type", "version", "metadata", "transform", "CityObjects", "vertices"]
    assert document["version"] == "2.0"
    assert document["metadata"]["referenceSystem"] == "https://www.opengis.net/def/crs/EPSG/0/7415"
    assert document["transform"] == {"scale": [1e-4] * 3, "translate": [85123, 446789, 1]}
    oak = document["CityObjects"]["oak"]
    assert oak["type"] == "SolitaryVegetationObject"
    assert [shape["lod"] for shape in oak["geometry"]] == ["1", "2", "2", "3", "3", "3"]
    assert {shape["type"] for shape in oak["geometry"]} == {"Solid"}
    assert check(document) == []


def test_attributes_say_what_is_known(tree: TreeModel) -> None:
    known = to_cityjson(tree, name="oak")["CityObjects"]["oak"]["attributes"]
    del known["skeleton"]
    assert known == {
        "species": "Quercus robur",
        "height": 2.1,
        "trunkDiameter": 0.18,
        "crownDiameter": 2.0,
        "dbh": 0.18,
        "dbhLow": 0.17,
        "dbhHigh": 0.19,
        "dbhArc": 250.0,
        "dbhSource": "measured",
        "groundHeight": 1.5,
    }


def test_attributes_of_a_bare_tree_come_from_its_nodes(tree: TreeModel) -> None:
    bare = TreeModel(tree.skeleton, tree.radius, tree.radius_source, tree.radius_rmse)
    known = to_cityjson(bare, name="oak")["CityObjects"]["oak"]["attributes"]
    assert known["height"] == 2.0
    assert known["trunkDiameter"] == round(2 * (0.09 + 0.3 * (0.06 - 0.09)), 4)
    assert known["crownDiameter"] == round(2 * np.sqrt(0.15 / np.pi), 3)  # triangle 1 m by 0.3 m
    assert "dbh" not in known
    assert "species" not in known


def test_the_skeleton_is_whole_numbers_between_rounded_nodes(tree: TreeModel) -> None:
    graph = to_cityjson(tree, name="oak")["CityObjects"]["oak"]["attributes"]["skeleton"]
    assert graph == {
        "scale": 0.001,
        "origin": [85123.456, 446789.123, 1.5],
        "radiusScale": 0.0001,
        "parent": [-1, 0, 1, 1, 3, 3],
        "dxyz": [0, 0, 0, 0, 0, 1000, 100, 0, 1000, 500, 0, 200, 500, 0, 100, 0, 300, 0],
        "radius": [1000, 900, 600, 300, 20, 50],
        "radiusSource": [0, 0, 0, 1, 2, 2],
    }


def test_the_tree_comes_back(tree: TreeModel) -> None:
    again = from_cityjson(to_cityjson(tree, name="oak"))
    assert np.array_equal(again.skeleton.parent, tree.skeleton.parent)
    assert np.abs(again.skeleton.xyz - tree.skeleton.xyz).max() <= 0.0005 + 1e-12
    assert np.abs(again.radius - tree.radius).max() <= 0.00005 + 1e-12
    assert np.array_equal(again.radius_source, tree.radius_source)
    assert np.array_equal(again.skeleton.origin, tree.skeleton.origin)
    assert again.skeleton.crs == "EPSG:7415"
    assert again.trunk == tree.trunk
    assert again.metadata == {"species": "Quercus robur"}


def test_levels_and_skeleton_are_a_choice(tree: TreeModel) -> None:
    document = to_cityjson(tree, name="oak", options=CityjsonOptions(lods=("2",), skeleton=False))
    oak = document["CityObjects"]["oak"]
    assert [shape["lod"] for shape in oak["geometry"]] == ["2", "2"]
    assert check(document) == []  # vertices of the twig are gone
    assert len(document["vertices"]) < len(to_cityjson(tree, name="oak")["vertices"])
    with pytest.raises(InputFormatError, match="skeleton"):
        from_cityjson(document)


def test_main_branches_are_thick_and_grow_from_main_ones(tree: TreeModel) -> None:
    assert main_branches(tree, 0.2).tolist() == [True, True, False]
    assert main_branches(tree, 0.01).tolist() == [True, True, True]
    assert main_branches(tree, 0.9).tolist() == [True, False, False]


def test_the_extent_is_that_of_the_vertices(tree: TreeModel) -> None:
    document = to_cityjson(tree, name="oak")
    world = np.array(document["vertices"]) * 1e-4 + document["transform"]["translate"]
    extent = document["metadata"]["geographicalExtent"]
    assert extent == pytest.approx([*world.min(axis=0), *world.max(axis=0)], abs=1e-9)
    assert extent[2] == 1.5


def test_vertices_stand_where_the_tubes_stand(tree: TreeModel) -> None:
    """The stem's foot is a ring of radius 0.1 m (corners of a 12-gon of equal area) around the origin."""
    document = to_cityjson(tree, name="oak")
    world = np.array(document["vertices"]) * 1e-4 + document["transform"]["translate"]
    stem = of_lod(document, "3")[0]["boundaries"][0]
    local = world[np.unique(stem)] - tree.skeleton.origin
    foot = local[np.abs(local[:, 2]) < 1e-4]
    sides = len(foot)
    want = 0.1 * np.sqrt(2 * np.pi / (sides * np.sin(2 * np.pi / sides)))
    assert sides == 16
    assert np.hypot(foot[:, 0], foot[:, 1]) == pytest.approx(want, abs=2e-4)


def test_solids_survive_snapping_to_a_millimetre(tree: TreeModel) -> None:
    document = to_cityjson(tree, name="oak")
    vertices = np.rint(np.array(document["vertices"]) / 10).astype(int)
    assert len(np.unique(vertices, axis=0)) == len(vertices)
    snapped = {
        **document,
        "vertices": vertices.tolist(),
        "transform": {"scale": [1e-3] * 3, "translate": [0] * 3},
    }
    assert check(snapped) == []


def test_a_tree_of_one_node_is_a_valid_document() -> None:
    lonely = TreeModel(Skeleton(np.zeros((1, 3)), np.array([-1])), np.ones(1), np.zeros(1), np.zeros(1))
    document = to_cityjson(lonely, name="stump")
    assert document["CityObjects"]["stump"]["geometry"] == []
    assert "referenceSystem" not in document["metadata"]
    assert check(document) == []
    assert len(from_cityjson(document)) == 1


def test_the_same_tree_gives_the_same_bytes(tree: TreeModel, tmp_path: Path) -> None:
    for name in ("a.city.json", "b.city.json"):
        write_cityjson(to_cityjson(tree, name="oak"), tmp_path / name)
    first = (tmp_path / "a.city.json").read_bytes()
    assert first == (tmp_path / "b.city.json").read_bytes()
    assert b": " not in first.replace(b"Quercus robur", b"")
    assert read_cityjson(tmp_path / "a.city.json") == to_cityjson(tree, name="oak")


def test_a_name_is_needed(tree: TreeModel) -> None:
    with pytest.raises(UsageError, match="give the name"):
        to_cityjson(tree, name="")


@pytest.mark.parametrize(
    ("crs", "url"),
    [
        ("EPSG:28992", "https://www.opengis.net/def/crs/EPSG/0/28992"),
        ("esri:102003", "https://www.opengis.net/def/crs/ESRI/0/102003"),
        (None, None),
        ("PROJCS[...]", None),
    ],
)
def test_reference_systems_are_addresses(crs: str | None, url: str | None) -> None:
    assert crs_url(crs) == url


def test_the_hull_of_a_cube_is_the_cube() -> None:
    grid = np.array([[x, y, z] for x in (0, 5000, 10000) for y in (0, 5000, 10000) for z in (0, 5000, 10000)])
    faces = hull(grid, 1e-4)
    assert faces is not None
    a, b, c = (grid[faces[:, k]].astype(float) for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(1e12)
    assert hull(grid[:9], 1e-4) is None  # flat


def test_spread_points_stand_apart_and_leave_none_out() -> None:
    points = np.random.default_rng(0).random((500, 3))
    kept = spread(points, 0.3)
    away = np.linalg.norm(points[:, None] - points[kept][None], axis=2)
    assert away.min(axis=1).max() < 0.3
    assert (away[kept] + 9 * np.eye(len(kept))).min() >= 0.3


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"parent": [-1, 0, 1, 1, 3, 9]}, "comes before its parent"),
        ({"parent": [-1, 0, 1, 1, 3, 2**40]}, "comes before its parent"),
        ({"radiusSource": [0, 0, 0, 0, 0, 300]}, "radius_source"),
        ({"radius": [0.5] * 6}, "not a list of whole numbers"),
        ({"dxyz": [0] * 17}, "three steps a node"),
        ({"origin": [0, 0]}, "origin has shape"),
        ({"scale": "1 mm"}, "makes no tree"),
        ({"parent": None}, "parent is not a list"),
    ],
)
def test_a_damaged_skeleton_is_named(tree: TreeModel, change: dict[str, Any], says: str) -> None:
    document = to_cityjson(tree, name="oak")
    document["CityObjects"]["oak"]["attributes"]["skeleton"].update(change)
    with pytest.raises(InputFormatError, match=f"'oak': .*{says}"):
        from_cityjson(document)


def test_a_skeleton_without_a_member_is_named() -> None:
    with pytest.raises(InputFormatError, match="lacks scale, origin"):
        decode_graph({"parent": [-1], "dxyz": [0, 0, 0], "radius": [1], "radiusScale": 1}, crs=None)


def test_files_that_are_no_cityjson_are_named(tmp_path: Path) -> None:
    with pytest.raises(InputMissingError, match=r"no\.json: there is no such file"):
        read_cityjson(tmp_path / "no.json")
    for text, says in (("{", "is not JSON"), ("[]", "not CityJSON"), ('{"a": NaN}', "not JSON")):
        (tmp_path / "x.json").write_text(text)
        with pytest.raises(InputFormatError, match=says):
            read_cityjson(tmp_path / "x.json")
    with pytest.raises(OutputError, match="is a directory"):
        write_cityjson({}, tmp_path)


def test_cjio_opens_it(tree: TreeModel, tmp_path: Path) -> None:
    pytest.importorskip("cjio", reason="cjio comes with the extra `dev`")
    path = tmp_path / "oak.city.json"
    write_cityjson(to_cityjson(tree, name="oak"), path)
    told = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", "from cjio.cjio import cli; cli()", str(path), "info"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    assert "SolitaryVegetationObject (1)" in told
    assert "EPSG = 7415" in told


def test_cjio_exports_every_triangle(tree: TreeModel, tmp_path: Path) -> None:
    pytest.importorskip("triangle", reason="cjio exports OBJ with the package triangle")
    path, out = tmp_path / "oak.city.json", tmp_path / "oak.obj"
    document = to_cityjson(tree, name="oak")
    write_cityjson(document, path)
    command = [sys.executable, "-W", "ignore", "-c", "from cjio.cjio import cli; cli()"]
    subprocess.run([*command, str(path), "export", "obj", str(out)], capture_output=True, check=True)
    drawn = sum(len(shape["boundaries"][0]) for shape in document["CityObjects"]["oak"]["geometry"])
    assert sum(line.startswith("f ") for line in out.read_text().splitlines()) == drawn


def test_the_official_schema_takes_it(tree: TreeModel, shared_data: Path) -> None:
    schema = json.loads((shared_data / "cityjson" / "cityjson.min.schema.json").read_bytes())
    assert check(to_cityjson(tree, name="oak"), schema=schema) == []
    lonely = TreeModel(Skeleton(np.zeros((1, 3)), np.array([-1])), np.ones(1), np.zeros(1), np.zeros(1))
    assert check(to_cityjson(lonely, name="stump"), schema=schema) == []


coordinate = st.floats(-3, 3, width=32)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(st.integers(0, 99), coordinate, coordinate, coordinate), min_size=0, max_size=30),
    st.integers(1, 5),
)
def test_any_tree_is_valid_and_comes_back(nodes: list[tuple[int, float, float, float]], wide: int) -> None:
    xyz = np.array([(0.0, 0.0, 0.0)] + [n[1:] for n in nodes])
    parent = np.array([-1] + [max(i - n[0] % wide, 0) for i, n in enumerate(nodes)])
    radius = np.array([0.2] + [0.001 * n[0] for n in nodes])
    skeleton = Skeleton(xyz, parent, np.array([1e5, 4e5, -3.0]))
    tree = TreeModel(skeleton, radius, np.zeros(len(xyz)), np.full(len(xyz), np.nan))
    document = to_cityjson(tree, name="t")
    assert check(document) == []
    again = from_cityjson(document)
    assert np.array_equal(again.skeleton.parent, parent)
    assert np.abs(again.skeleton.xyz - xyz).max() <= 0.0005 + 1e-12
    assert np.abs(again.radius - radius).max() <= 0.00005 + 1e-12
    attribute = document["CityObjects"]["t"]["attributes"]["skeleton"]
    assert to_cityjson(again, name="t")["CityObjects"]["t"]["attributes"]["skeleton"] == attribute


def test_a_long_tree_at_a_cost_in_proportion() -> None:
    def vine(count: int) -> TreeModel:
        turn = np.arange(count) / 50
        skeleton = Skeleton(np.column_stack([np.sin(turn), np.cos(turn), turn]), np.arange(-1, count - 1))
        return TreeModel(skeleton, np.full(count, 0.01), np.zeros(count), np.zeros(count))

    def written(tree: TreeModel) -> None:
        assert check(to_cityjson(tree, name="vine")) == []

    ratio = slowdown(written, vine(1250), vine(5000), repeats=2)
    assert ratio < 12  # four times the nodes; 16 where it is quadratic
