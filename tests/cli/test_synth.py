"""`treepipe synth`: trees and scans as a person makes them, and what a person does wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.cloud import read_cloud
from pipeline.exchange import read_model
from pipeline.formats.png import packed
from pipeline.synthetic import read_truth, truth_of

try:
    import open3d  # noqa: F401  whether it can be loaded
except (ImportError, OSError) as error:
    ABSENT = f"open3d cannot be loaded: {error}"
else:
    ABSENT = ""
needs_open3d = pytest.mark.skipif(bool(ABSENT), reason=ABSENT)


@pytest.fixture
def truth(call, tmp_path) -> Path:
    """A sapling's truth."""
    path = tmp_path / "sapling.npz"
    assert call("synth", "tree", "--preset", "sapling", "--seed", 4, "-o", path).exit_code == 0
    return path


def test_a_tree_is_written_as_truth_or_model(call, truth, tmp_path):
    result = call("synth", "tree", "--preset", "sapling", "--seed", 4, "-o", tmp_path / "a.ls.json")
    assert result.exit_code == 0
    assert "nodes" in result.stdout
    held, tree = read_truth(truth), read_model(tmp_path / "a.ls.json")
    assert len(held.r) == len(tree) - 1
    np.testing.assert_allclose(truth_of(tree).r, held.r, atol=1e-3)
    assert call("synth", "tree", "--set", "height_m=3", "-o", tmp_path / "b.npz").exit_code == 0
    assert read_truth(tmp_path / "b.npz").e[:, 2].max() < 4


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--kind", "tube", "-o", "x.npz"), "unknown kind of tree 'tube', do you mean tubes"),
        (("--preset", "saplin", "-o", "x.npz"), "unknown preset 'saplin', do you mean sapling"),
        (("--set", "heigt_m=3", "-o", "x.npz"), "unknown key heigt_m, do you mean height_m"),
        (("--set", "height_m=1", "-o", "x.npz"), "height_m = 1 is not allowed; give a number >= 2 and <= 40"),
        (("--set", "height_m", "-o", "x.npz"), "is not KEY=VALUE"),
        (("-o", "x.foo"), "the suffix names no format"),
        (("-o", "x.laz"), "the suffix names no format"),
        (("-o", "."), "exists already"),
    ],
)
def test_wrong_usage_of_tree(call, tmp_path, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    result = call("synth", "tree", *arguments)
    assert result.exit_code == 2
    assert said in result.stderr
    assert not list(tmp_path.iterdir())


def test_nothing_is_overwritten_unasked(call, truth):
    before = truth.read_bytes()
    result = call("synth", "tree", "-o", truth)
    assert result.exit_code == 2
    assert "exists already; add --overwrite" in result.stderr
    assert truth.read_bytes() == before
    assert call("synth", "tree", "-o", truth, "--overwrite").exit_code == 0
    assert truth.read_bytes() != before


@needs_open3d
@pytest.mark.parametrize("kind", ["tls", "als"])
def test_a_scan_has_its_truth_beside_it(call, truth, tmp_path, kind):
    cloud = tmp_path / "scan.laz"
    result = call("synth", "scan", truth, "--kind", kind, "--density", 300, "--seed", 2, "-o", cloud)
    assert result.exit_code == 0, result.stderr
    points = read_cloud(cloud)
    assert f"{len(points)} points" in result.stdout
    assert set(points.attributes["classification"]) == {1, 2}
    held = read_truth(tmp_path / "scan.truth.npz")
    np.testing.assert_allclose(held.e, read_truth(truth).e, atol=1e-9)
    with np.load(tmp_path / "scan.returns.npz") as told:
        assert len(told["segment"]) == len(points)
    again = call("synth", "scan", truth, "-o", cloud)
    assert again.exit_code == 2
    assert "exists already" in again.stderr
    cloud.unlink()
    again = call("synth", "scan", truth, "-o", cloud)
    assert again.exit_code == 2
    assert "scan.truth.npz: exists already" in again.stderr


@needs_open3d
def test_options_reach_the_scanner(call, truth, tmp_path):
    def made(name, *arguments):
        result = call("synth", "scan", truth, "-o", tmp_path / name, "--set", "ground_radius_m=0", *arguments)
        assert result.exit_code == 0, result.stderr
        return read_cloud(tmp_path / name)

    plain = made("plain.laz")
    assert 3 * len(made("sparse.laz", "--density", 1000)) < len(plain)
    assert 5 in made("leafy.laz", "--leaves").attributes["classification"]
    exact = made("exact.laz", "--noise-mm", 0, "--set", "sub_rays=1")
    assert np.abs(exact.attributes["range_error_m"]).max() < 1e-6
    one = made("one.laz", "--set", "positions=[[4, 0, 1.5]]")
    assert set(one.attributes["scanner"]) == {0}


@needs_open3d
@pytest.mark.parametrize(
    ("arguments", "code", "said"),
    [
        (("--kind", "mls"), 2, "is not one of 'tls', 'als'"),
        (("--set", "distance_m=0.001", "--set", "height_m=0.05"), 2, "sapling.npz: station 0 at 0.00 m east"),
        (("--set", "max_range_m=2"), 1, "sapling.npz: none of the"),
        (("--set", "altitude_m=500"), 2, "unknown key altitude_m"),
        (("--density", 0), 2, "--density"),
        (("--density", 1e9), 2, "step_deg"),
        (("--set", "positions=3"), 2, "positions = 3 is not allowed; give a list"),
    ],
)
def test_wrong_usage_of_scan(call, truth, tmp_path, arguments, code, said):
    result = call("synth", "scan", truth, "-o", tmp_path / "x.laz", *arguments)
    assert result.exit_code == code
    assert said in result.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["sapling.npz"]


def test_wrong_files_of_scan(call, truth, tmp_path):
    result = call("synth", "scan", truth, "-o", tmp_path / "x.xyz")
    assert (result.exit_code, "end the name in .laz or .las" in result.stderr) == (2, True)
    result = call("synth", "scan", tmp_path / "none.npz", "-o", tmp_path / "x.laz")
    assert (result.exit_code, "there is no such file" in result.stderr) == (1, True)
    (tmp_path / "bad.npz").write_bytes(b"hello")
    result = call("synth", "scan", tmp_path / "bad.npz", "-o", tmp_path / "x.laz")
    assert (result.exit_code, "bad.npz" in result.stderr) == (1, True)
    assert call("synth", "tree", "--preset", "sapling", "-o", tmp_path / "s.skeleton.ply").exit_code == 0
    result = call("synth", "scan", tmp_path / "s.skeleton.ply", "-o", tmp_path / "x.laz")
    assert not (tmp_path / "x.laz").exists() or result.exit_code == 0


def test_help_is_there(call):
    for arguments in (("synth", "-h"), ("synth", "tree", "-h"), ("synth", "scan", "--help")):
        result = call(*arguments)
        assert result.exit_code == 0
        assert "Usage:" in result.stdout


SMALL = ("--kind", "colonization", "--preset", "bush", "--set", "iterations=6")


def test_a_colonization_tree_bears_leaves_and_pictures(call, tmp_path):
    result = call("synth", "tree", *SMALL, "-o", tmp_path / "b.obj")
    assert result.exit_code == 0, result.stderr
    assert "growth ended: max_iter, all iterations are done" in result.stdout
    assert {path.name for path in tmp_path.iterdir()} == {"b.obj", "b.mtl", "b_bark.png", "b_leaf.png"}
    assert "usemtl leaf" in (tmp_path / "b.obj").read_text()
    assert call("synth", "tree", *SMALL, "--no-leaves", "-o", tmp_path / "c.obj").exit_code == 0
    assert "usemtl leaf" not in (tmp_path / "c.obj").read_text()
    (tmp_path / "b.obj").unlink()
    again = call("synth", "tree", *SMALL, "-o", tmp_path / "b.obj")
    assert (again.exit_code, "b_bark.png: exists already" in again.stderr) == (2, True)


def test_pictures_of_ones_own(call, tmp_path):
    mine = tmp_path / "mine.png"
    mine.write_bytes(packed(np.full((2, 2, 3), 7, dtype=np.uint8)))
    arguments = ("synth", "tree", *SMALL, "--bark", mine, "-o")
    assert call(*arguments, tmp_path / "b.obj").exit_code == 0
    assert (tmp_path / "b_bark.png").read_bytes() == mine.read_bytes()
    assert call(*arguments, tmp_path / "b.glb").exit_code == 0
    assert mine.read_bytes() in (tmp_path / "b.glb").read_bytes()


@pytest.mark.parametrize(
    ("content", "target", "code", "said"),
    [
        (None, "b.obj", 1, "there is no such file; give a PNG picture"),
        (b"GIF89a", "b.obj", 1, "is no PNG picture; save it as PNG"),
        (packed(np.zeros((2, 2, 3), dtype=np.uint8))[:-20], "b.obj", 1, "damaged PNG picture; save it anew"),
        (None, "b.npz", 2, "holds no pictures; end its name in .obj or .glb"),
    ],
)
def test_wrong_pictures(call, tmp_path, content, target, code, said):
    mine = tmp_path / "mine.png"
    if content is not None:
        mine.write_bytes(content)
    result = call("synth", "tree", *SMALL, "--leaf", mine, "-o", tmp_path / target)
    assert (result.exit_code, said in result.stderr) == (code, True), result.stderr
    assert not (tmp_path / target).exists()
    result = call("synth", "tree", "--leaf", mine, "-o", tmp_path / "t.obj")
    assert (result.exit_code, "add --kind colonization" in result.stderr) == (2, True)


def test_a_file_of_parameters_is_what_single_settings_are(call, tmp_path):
    file = tmp_path / "bush.toml"
    file.write_text("iterations = 6\ncrown_width_m = 2.0\n", encoding="utf-8")
    given = ("synth", "tree", "--kind", "colonization", "--seed", 3)
    single = ("--set", "iterations=6", "--set", "crown_width_m=2.0")
    for name, more in (("file", ("--params", file)), ("single", single)):
        assert call(*given, *more, "-o", tmp_path / f"{name}.npz").exit_code == 0
    assert (tmp_path / "file.npz").read_bytes() == (tmp_path / "single.npz").read_bytes()
    file.write_text("iteration = 6\n", encoding="utf-8")
    wrong = call(*given, "--params", file, "-o", tmp_path / "wrong.npz")
    assert wrong.exit_code == 2
    assert "iterations" in wrong.stderr
