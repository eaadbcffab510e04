"""GeoPackages: what GDAL reads in them, round trips, edited and broken ones."""

from __future__ import annotations

import sqlite3
import struct
import warnings
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import InputFormatError, InputMissingError, OutputError
from pipeline.formats import gpkg
from pipeline.model import Skeleton, TreeModel
from tests.formats.exchanged import assert_named, assert_same, damaged, junk, random_tree


def changed(path: Path, *commands: str) -> None:
    with closing(sqlite3.connect(path)) as file, file:
        for command in commands:
            file.execute(command)


def layer(path: Path, name: str) -> tuple[dict[str, Any], list[bytes], dict[str, list[Any]]]:
    """Read a layer as GDAL does: what it is, its geometries in WKB (pyogrio leaves M out), its columns."""
    raw = pytest.importorskip("pyogrio.raw", reason="pyogrio reads it as other programs do")
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        meta, _, geometries, columns = raw.read(path, layer=name)
    measured = any("'Measured 3D LineString'" in str(warning.message) for warning in told)
    assert measured == (name == "branches"), [str(warning.message) for warning in told]
    return meta, list(geometries), dict(zip(meta["fields"], (c.tolist() for c in columns), strict=True))


def test_gdal_reads_the_branches(tree: TreeModel, tmp_path: Path) -> None:
    gpkg.write(tree, tmp_path / "t.gpkg")
    meta, geometries, columns = layer(tmp_path / "t.gpkg", "branches")
    assert meta["crs"] == "EPSG:28992"
    assert columns["branch_id"] == [0, 1, 2]
    assert columns["parent_branch_id"] == [-1, 0, 0]
    assert columns["branch_order"] == [0, 1, 1]
    assert columns["nodes"] == ["1-2", "3-4", "5"]
    assert columns["length_m"] == pytest.approx([2.00499, 1.21345, 0.28284], abs=1e-5)
    assert sum(columns["volume_l"]) == pytest.approx(1000 * tree.volume.sum())
    limb = np.frombuffer(geometries[1], "<f8", offset=9).reshape(-1, 3)
    assert limb.tolist() == tree.skeleton.world[[1, 3, 4]].tolist()


def test_the_measure_is_the_radius(tree: TreeModel, tmp_path: Path) -> None:
    gpkg.write(tree, tmp_path / "t.gpkg")
    with closing(sqlite3.connect(tmp_path / "t.gpkg")) as file:
        (blob,) = file.execute("SELECT geom FROM branches WHERE branch_id = 1").fetchone()
        columns = file.execute("SELECT * FROM gpkg_geometry_columns ORDER BY table_name").fetchall()
        assert file.execute("PRAGMA foreign_key_check").fetchall() == []
    assert columns == [
        ("branches", "geom", "LINESTRING", 28992, 1, 1),
        ("trees", "geom", "POINT", 28992, 1, 0),
    ]
    assert blob[:4] == b"GP\0\x05"
    assert struct.unpack("<i", blob[4:8]) == (28992,)
    assert struct.unpack("<BII", blob[56:65]) == (1, 3002, 3)  # LINESTRING ZM in ISO WKB
    limb = np.frombuffer(blob, "<f8", offset=65).reshape(-1, 4)
    assert limb[:, 3].tolist() == tree.radius[[3, 3, 4]].tolist()  # its own radius from the start


def test_gdal_reads_the_tree(tree: TreeModel, tmp_path: Path) -> None:
    gpkg.write(tree, tmp_path / "t.gpkg")
    meta, geometries, columns = layer(tmp_path / "t.gpkg", "trees")
    assert meta["geometry_type"] == "Point Z"
    assert struct.unpack("<3d", geometries[0][5:]) == tuple(tree.skeleton.world[0].tolist())
    assert columns["dbh_m"] == [0.18]
    assert columns["height_m"] == pytest.approx([2.05])
    assert columns["branches"] == [3]


@pytest.mark.parametrize("crs", [None, "EPSG:7415", "EPSG:999999", "my field", "EPSG:4326"])
def test_any_reference_system_comes_back(tree: TreeModel, tmp_path: Path, crs: str | None) -> None:
    skeleton = Skeleton(tree.skeleton.xyz, tree.skeleton.parent, tree.skeleton.origin, crs)
    one = TreeModel(skeleton, tree.radius, tree.radius_source, tree.radius_rmse)
    gpkg.write(one, tmp_path / "t.gpkg")
    again = gpkg.read(tmp_path / "t.gpkg")
    assert again.skeleton.crs == crs
    assert again.trunk is None
    _, geometries, _ = layer(tmp_path / "t.gpkg", "branches")
    assert len(geometries) == 3


def test_a_tree_comes_back(tree: TreeModel, tmp_path: Path) -> None:
    gpkg.write(tree, tmp_path / "t.gpkg")
    again = gpkg.read(tmp_path / "t.gpkg")
    assert_same(again, tree, place=1e-9, radius=0)
    assert np.array_equal(again.skeleton.origin, tree.skeleton.origin)
    assert again.trunk == tree.trunk


def test_where_radii_come_from_comes_back(tree: TreeModel, tmp_path: Path) -> None:
    """Branch by branch; one that has been edited since, or says nothing, counts as propagated."""
    told = replace(tree, radius_source=np.array([0, 0, 1, 2, 0, 2], dtype=np.uint8))
    gpkg.write(told, tmp_path / "t.gpkg")
    _, _, columns = layer(tmp_path / "t.gpkg", "branches")
    assert columns["radius_source"] == ["m2p1", "a1m1", "a1"]
    assert gpkg.read(tmp_path / "t.gpkg").radius_source.tolist() == [0, 0, 1, 2, 0, 2]
    changed(tmp_path / "t.gpkg", "UPDATE branches SET radius_source = 'a9' WHERE branch_id = 1")
    assert gpkg.read(tmp_path / "t.gpkg").radius_source.tolist() == [0, 0, 1, 1, 1, 2]
    changed(tmp_path / "t.gpkg", "ALTER TABLE branches DROP COLUMN radius_source")
    assert gpkg.read(tmp_path / "t.gpkg").radius_source.tolist() == [1] * 6


def test_the_same_tree_gives_the_same_bytes(tree: TreeModel, tmp_path: Path) -> None:
    for name in ("a.gpkg", "b.gpkg"):
        gpkg.write(tree, tmp_path / name)
    assert (tmp_path / "a.gpkg").read_bytes() == (tmp_path / "b.gpkg").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.gpkg", "b.gpkg"]


def test_a_branch_that_was_removed_is_missing(tree: TreeModel, tmp_path: Path) -> None:
    gpkg.write(tree, tmp_path / "t.gpkg")
    changed(tmp_path / "t.gpkg", "DELETE FROM branches WHERE branch_id = 1")
    again = gpkg.read(tmp_path / "t.gpkg")
    assert again.skeleton.parent.tolist() == [-1, 0, 1, 0]


@pytest.mark.parametrize(
    ("command", "says"),
    [
        ("DROP TABLE branches", "no GeoPackage with a table of branches"),
        ("DELETE FROM branches", "holds no branch"),
        ("INSERT INTO trees (crs) VALUES ('x')", "holds 2 trees"),
        ("UPDATE branches SET geom = NULL WHERE branch_id = 1", "row 2 .*cannot be read"),
        ("UPDATE branches SET geom = substr(geom, 1, 90) WHERE branch_id = 1", "row 2 .*cut short"),
        (
            "UPDATE branches SET geom = x'47500001' || zeroblob(40)",
            "row 1 .*no geometry|row 1 .*no LINESTRING",
        ),
        ("UPDATE branches SET branch_id = 0 WHERE branch_id = 1", "row 2 of branches has the number 0"),
        (
            "UPDATE branches SET parent_branch_id = 9 WHERE branch_id = 1",
            "row 2 .* the parent 9, which is not",
        ),
        ("UPDATE branches SET parent_branch_id = -1", "row 2 of branches has no parent"),
        ("UPDATE branches SET parent_branch_id = 2, parent_vertex = 0", "own ancestor"),
        ("UPDATE branches SET parent_vertex = 7 WHERE branch_id = 1", "row 2 .* vertex 7 of its parent"),
        ("UPDATE branches SET parent_vertex = 'x' WHERE branch_id = 1", "row 2 .*no whole parent_vertex"),
        ("UPDATE trees SET dbh_m = 'thick', ground_z_m = 'x'", "trees holds other than numbers"),
    ],
)
def test_broken_packages_are_named_with_row_and_remedy(
    tree: TreeModel, tmp_path: Path, command: str, says: str
) -> None:
    path = tmp_path / "t.gpkg"
    gpkg.write(tree, path)
    changed(path, command)
    assert_named(gpkg.read, path, path.read_bytes(), says)


def test_other_files_are_named(tree: TreeModel, tmp_path: Path) -> None:
    assert_named(gpkg.read, tmp_path / "t.gpkg", b"", "no GeoPackage")
    assert_named(gpkg.read, tmp_path / "t.gpkg", b"hello" * 100, "no GeoPackage")
    with pytest.raises(InputMissingError, match="no such file"):
        gpkg.read(tmp_path / "no.gpkg")
    with pytest.raises(OutputError, match="is a directory"):
        gpkg.write(tree, tmp_path)
    single = TreeModel(Skeleton(np.zeros((1, 3)), np.array([-1])), np.ones(1), np.zeros(1), np.zeros(1))
    gpkg.write(single, tmp_path / "one.gpkg")
    with pytest.raises(InputFormatError, match="holds no branch"):
        gpkg.read(tmp_path / "one.gpkg")


@settings(max_examples=30)
@given(drawn=st.lists(st.integers(0, 50), min_size=1, max_size=30), wide=st.integers(1, 6))
def test_any_tree_comes_back(tmp_path_factory: pytest.TempPathFactory, drawn: list[int], wide: int) -> None:
    path, tree = tmp_path_factory.mktemp("gpkg") / "t.gpkg", random_tree(drawn, wide)
    gpkg.write(tree, path)
    assert_same(gpkg.read(path), tree, place=1e-9, radius=0)


@settings(max_examples=60)
@given(junk=junk, place=st.integers(0, 60_000))
def test_damage_gives_an_error_or_a_tree(
    tmp_path_factory: pytest.TempPathFactory, junk: bytes, place: int
) -> None:
    path = tmp_path_factory.mktemp("gpkg") / "t.gpkg"
    gpkg.write(random_tree([0, 1, 2, 0], 3), path)
    damaged(gpkg.read, path, junk, place)
