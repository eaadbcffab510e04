"""Any model to any format and back, with what is lost said."""

from __future__ import annotations

import json

import numpy as np
import pytest
import trimesh

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
    assert known["radius_share"] == {"measured": 0.0, "propagated": 1.0, "allometric": 0.0}
    assert "propagated 1.000" in call("info", tmp_path / "tree.swc").stdout


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
    assert (result.exit_code, "is no model that can be read" in result.stderr) == (1, True)


def test_nothing_is_overwritten_unasked(call, sapling_model, tmp_path):
    assert call("convert", sapling_model, tmp_path / "tree.swc").exit_code == 0
    result = call("convert", sapling_model, tmp_path / "tree.swc")
    assert (result.exit_code, "--overwrite" in result.stderr) == (2, True)
    assert call("convert", sapling_model, tmp_path / "tree.swc", "--overwrite").exit_code == 0
