"""Any model to any format and back, with what is lost said."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

from pipeline.cityjson import CityjsonOptions, SeqWriter
from pipeline.exchange import FORMATS, read_model

READABLE = sorted(name for name, known in FORMATS.items() if known.read)


@pytest.fixture(scope="module")
def sapling_model(made):
    return made / "sapling" / "sapling.ls.json"


@pytest.mark.parametrize("name", READABLE)
def test_there_and_back(call, sapling_model, tmp_path, name):
    known = FORMATS[name]
    there, back = tmp_path / f"tree{known.suffix}", tmp_path / "back.ls.json"
    result = call("convert", sapling_model, there)
    assert result.exit_code == 0, result.stderr
    for what in set(known.loses) - {"crs", "trunk", "metadata", "origin"}:
        assert what in result.stderr
    assert call("convert", there, back).exit_code == 0
    ours, theirs = read_model(sapling_model), read_model(back)
    np.testing.assert_array_equal(theirs.skeleton.parent, ours.skeleton.parent)
    np.testing.assert_allclose(theirs.skeleton.world, ours.skeleton.world, atol=0.0015)
    np.testing.assert_allclose(theirs.radius, ours.radius, atol=0.0015)


@pytest.mark.parametrize("name", READABLE)
def test_info_knows_every_model(call, sapling_model, tmp_path, name):
    path = tmp_path / f"tree{FORMATS[name].suffix}"
    assert call("convert", sapling_model, path).exit_code == 0
    result = call("info", path)
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith("kind           tree")


def test_info_tells_where_radii_come_from(call, sapling_model, tmp_path):
    """A file that does not say so is not said to hold measured ones."""
    known = json.loads(call("info", sapling_model, "--json").stdout)
    assert known["dbh_source"] == "measured"
    assert known["radius_share"]["measured"] > 0.1
    call("convert", sapling_model, tmp_path / "tree.swc")
    known = json.loads(call("info", tmp_path / "tree.swc", "--json").stdout)
    assert known["radius_share"] is None
    assert "radius_share   not told by the file" in call("info", tmp_path / "tree.swc").stdout
    call("convert", sapling_model, tmp_path / "tree.gpkg")
    known = json.loads(call("info", tmp_path / "tree.gpkg", "--json").stdout)
    assert known["radius_share"]["measured"] > 0.1


@pytest.fixture
def forest(sapling_model, tmp_path):
    """A CityJSON text sequence of two trees."""
    tree = read_model(sapling_model)
    with SeqWriter(tmp_path / "forest.city.jsonl", options=CityjsonOptions(profile="extension")) as writer:
        for name in ("elm", "oak"):
            writer.add(tree, name)
    return tmp_path / "forest.city.jsonl"


def test_info_tells_what_a_text_sequence_holds(call, forest, sapling_model):
    known = json.loads(call("info", forest, "--json").stdout)
    assert (known["kind"], known["trees"], known["version"]) == ("trees", 2, "2.0")
    assert known["extensions"] == ["TreeSkeleton"]
    world = read_model(sapling_model).skeleton.world
    np.testing.assert_allclose(known["extent"], [*world.min(axis=0), *world.max(axis=0)], atol=0.1)
    assert known["bytes"] == forest.stat().st_size
    assert "trees          2" in call("info", forest).stdout
    one = json.loads(call("info", f"{forest}#oak", "--json").stdout)
    assert (one["kind"], one["nodes"]) == ("tree", len(world))


def test_one_tree_of_a_text_sequence_is_named(call, forest, tmp_path):
    target = tmp_path / "tree.ls.json"
    result = call("convert", forest, target)
    says = f"holds 2 trees (elm, oak); name one, as in {forest}#elm"
    assert (result.exit_code, says in result.stderr) == (1, True)
    result = call("convert", f"{forest}#aok", target)
    assert (result.exit_code, "(near it are 'oak'); give one of its ids" in result.stderr) == (1, True)
    assert call("convert", f"{forest}#oak", target).exit_code == 0
    assert len(read_model(target)) == len(read_model(f"{forest}#oak"))


def test_a_text_sequence_of_one_tree_is_that_tree_and_of_none_says_so(call, forest, tmp_path):
    lines = forest.read_text().splitlines(keepends=True)
    forest.write_text("".join(lines[:2]))
    assert call("convert", forest, tmp_path / "tree.swc").exit_code == 0
    forest.write_text(lines[0])
    result = call("convert", forest, tmp_path / "other.swc")
    assert (result.exit_code, "holds no tree; give a .city.jsonl file with trees" in result.stderr) == (
        1,
        True,
    )
    assert json.loads(call("info", forest, "--json").stdout)["trees"] == 0
    forest.write_text(lines[0] + lines[1].replace('"vertices":[[', '"vertices":[[7],['))
    result = call("info", forest)
    assert (result.exit_code, "line 2: vertices or transform are damaged" in result.stderr) == (1, True)


@pytest.mark.parametrize("suffix", [".mesh.ply", ".obj", ".glb"])
def test_surfaces_have_options(call, sapling_model, tmp_path, suffix):
    sizes = {}
    for name, more in {"plain": [], "leafy": ["--leaves", "quads"], "joined": ["--union"]}.items():
        path = tmp_path / f"{name}{suffix}"
        result = call("convert", sapling_model, path, *more)
        assert result.exit_code == 0, result.stderr
        assert "does not hold skeleton, radii" in result.stderr
        sizes[name] = path.stat().st_size
    assert sizes["leafy"] > sizes["plain"]
    assert trimesh.load(tmp_path / f"joined{suffix}", force="mesh", merge_norm=True).is_watertight


def test_what_a_format_has_not_is_wrong_usage(call, sapling_model, tmp_path):
    for more, suffix in (
        (["--union"], ".swc"),
        (["--skeleton-object"], ".obj"),
        (["--leaves", "quads"], ".mtg"),
    ):
        result = call("convert", sapling_model, tmp_path / f"tree{suffix}", *more)
        assert (result.exit_code, f"files that end in {suffix} have none" in result.stderr) == (2, True)


def test_a_surface_is_no_model(call, sapling_model, tmp_path):
    path = tmp_path / "tree.obj"
    assert call("convert", sapling_model, path).exit_code == 0
    result = call("convert", path, tmp_path / "tree.swc")
    assert (result.exit_code, "no model that can be read; give the tree's .npz" in result.stderr) == (1, True)
    assert call("convert", sapling_model, tmp_path / "tree.ls.json").exit_code == 0
    assert f"give {tmp_path / 'tree.ls.json'}, which holds the tree" in call("info", path).stderr


def test_what_is_no_model_is_told_by_what_it_is(call, tmp_path):
    (tmp_path / "park.lsjson.jsonl.zst").write_bytes(b"")
    (tmp_path / "scan.laz").write_bytes(b"")
    for path, says in (
        (tmp_path, "is a directory, and no model that can be read; give one of the files in it"),
        (
            tmp_path / "scan.laz",
            "is a point cloud, and no model that can be read; make one of it with `treepipe run`",
        ),
        (tmp_path / "park.lsjson.jsonl.zst", "name a tree as in"),
        (tmp_path / "absent.swc", "there is no such file"),
    ):
        result = call("convert", path, tmp_path / "tree.swc")
        assert (result.exit_code, says in result.stderr) == (1, True), result.stderr


def test_cylinders_of_others_are_told_as_they_stand(call, tmp_path):
    """A branch that begins on the bark gets a piece from the axis: the sums differ, and both are told."""
    row = "{r}\t1\t{x}\t0\t{z}\t{a}\t{p}\t0\t0\t{r}\t{b}\t{k}\t1\n"
    stem = row.format(r=0.1, x=0, z=0, a="0\t0\t1", p=0, b=1, k=0)
    side = row.format(r=0.05, x=0.1, z=0.5, a="1\t0\t0", p=1, b=2, k=1)
    path = tmp_path / "tree.treeqsm.txt"
    path.write_text(stem + side)
    result = call("info", path, "--json")
    assert "its cylinders alone hold 39.3 L in 2.0 m; joined" in result.stderr
    assert json.loads(result.stdout)["length_m"] == pytest.approx(2.1)
    assert call("convert", path, tmp_path / "again.treeqsm.txt").exit_code == 0
    assert call("info", tmp_path / "again.treeqsm.txt").stderr == ""


def test_half_a_mesh_is_damaged(call, sapling_model, tmp_path):
    path = tmp_path / "tree.mesh.ply"
    assert call("convert", sapling_model, path).exit_code == 0
    path.write_bytes(path.read_bytes()[:-100])
    result = call("info", path)
    assert (result.exit_code, "copy or write the file anew" in result.stderr) == (1, True)


def test_nothing_is_overwritten_unasked(call, sapling_model, tmp_path):
    assert call("convert", sapling_model, tmp_path / "tree.swc").exit_code == 0
    result = call("convert", sapling_model, tmp_path / "tree.swc")
    assert (result.exit_code, "--overwrite" in result.stderr) == (2, True)
    assert call("convert", sapling_model, tmp_path / "tree.swc", "--overwrite").exit_code == 0
