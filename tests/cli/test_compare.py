"""`treepipe compare` as a user calls it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

from pipeline.cli.compare import command
from pipeline.cli.main import LazyGroup
from pipeline.exchange import write
from pipeline.model import Skeleton, TreeModel
from pipeline.synthetic import SampleOptions, TubeTreeOptions, grow_tubes, sample, truth_of, write_truth

SAPLING = TubeTreeOptions(height_m=3, trunk_radius_m=0.06, max_order=1, branch_spacing_m=0.25)


def compare(*arguments):
    """Call the command behind the door that turns errors into exit codes."""
    group = LazyGroup("treepipe")
    group.get_command = lambda _ctx, _name: command
    return CliRunner().invoke(group, ["compare", *map(str, arguments)])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One tree in several forms, its points and its truth; the same elsewhere, and none."""
    place = tmp_path_factory.mktemp("compared")
    tree = grow_tubes(SAPLING)
    for suffix in (".npz", ".ls.json", ".skeleton.ply", ".qsm.csv", ".city.json"):
        write(tree, place / f"sapling{suffix}")
    write_truth(truth_of(tree), place / "sapling.truth.npz")
    np.savetxt(place / "sapling.xyz", sample(tree, options=SampleOptions()).world[::20], fmt="%.4f")
    graph = tree.skeleton

    def elsewhere(name, origin, crs):
        skeleton = Skeleton(graph.xyz, graph.parent, np.array(origin, dtype=float), crs)
        held = (tree.radius, tree.radius_source, tree.radius_rmse)
        write(TreeModel(skeleton, *held), place / f"{name}.npz")

    elsewhere("far", (150_000, 400_000, 0), None)
    elsewhere("dutch", (0, 0, 0), "EPSG:28992")
    elsewhere("french", (0, 0, 0), "EPSG:2154")
    one = Skeleton(np.zeros((1, 3)), np.array([-1]))
    write(TreeModel(one, np.ones(1), np.zeros(1, dtype=np.uint8), np.ones(1)), place / "empty.npz")
    return place


@pytest.mark.parametrize("suffix", [".ls.json", ".skeleton.ply", ".qsm.csv", ".city.json"])
def test_formats_hold_the_tree(folder, suffix):
    done = compare(folder / f"sapling{suffix}", folder / "sapling.npz", "--json")
    assert done.exit_code == 0, done.output
    plain = json.loads(done.stdout)
    assert plain["nodes"]["max_mm"] < 1.5
    assert plain["surface"]["p95_mm"] < 1.5
    assert plain["recall"] == 1.0
    assert plain["bytes"]["a"] == (folder / f"sapling{suffix}").stat().st_size


def test_the_table(folder):
    done = compare(folder / "sapling.ls.json", folder / "sapling.npz")
    assert done.exit_code == 0
    for word in ("distances, mm", "bark of A", "DBH, cm", "recall", "order 1 in B", "bytes"):
        assert word in done.stdout


def test_points_and_truth(folder):
    call = ("--cloud", folder / "sapling.xyz", "--truth", folder / "sapling.truth.npz")
    done = compare(folder / "sapling.npz", *call, "--json")
    assert done.exit_code == 0, done.output
    plain = json.loads(done.stdout)
    assert plain["coverage"] > 0.99
    assert plain["surface"]["mean_mm"] == pytest.approx(plain["surface_floor_mm"], rel=0.2)
    assert plain["recall"] == plain["order_accuracy"] == 1.0
    assert plain["bytes"]["b"] is None
    for part in (call[:2], call[2:]):
        done = compare(folder / "sapling.npz", *part)
        assert done.exit_code == 0, done.output
        assert str(part[1]) in done.stdout


def test_a_page(folder, tmp_path):
    call = (folder / "sapling.ls.json", folder / "sapling.npz", "--html", tmp_path / "page.html")
    assert compare(*call).exit_code == 0
    assert "sapling.ls.json against sapling.npz" in (tmp_path / "page.html").read_text()
    again = compare(*call)
    assert again.exit_code == 2
    assert "--overwrite" in again.stderr
    assert compare(*call, "--overwrite").exit_code == 0


@pytest.mark.parametrize(
    ("arguments", "code", "told"),
    [
        (("sapling.npz",), 2, "--cloud or --truth"),
        (("sapling.npz", "far.npz", "--truth", "sapling.truth.npz"), 2, "one after the other"),
        (("sapling.npz", "--cloud", "sapling.xyz", "--align", "root"), 2, "where they stand"),
        (("sapling.npz", "sapling.npz", "--html", "page.txt"), 2, ".html"),
        (("sapling.npz", "sapling.npz", "--align", "tip"), 2, "align"),
        (("sapling.npz", "gone.npz"), 1, "gone.npz"),
        (("sapling.npz", "sapling.xyz"), 1, "sapling.xyz"),
        (("sapling.npz", "far.npz"), 1, "--align root"),
        (("french.npz", "dutch.npz"), 1, "--align root"),
        (("sapling.npz", "empty.npz"), 1, "B is empty"),
        (("far.npz", "--cloud", "sapling.xyz"), 1, "do not overlap"),
        (("far.npz", "--truth", "sapling.truth.npz"), 1, "do not overlap"),
    ],
)
def test_bad_input(folder, arguments, code, told):
    done = compare(*(folder / word if "." in word else word for word in arguments))
    assert done.exit_code == code, done.output
    assert told in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_moved_trees_are_laid_together(folder):
    done = compare(folder / "far.npz", folder / "sapling.npz", "--align", "root", "--json")
    plain = json.loads(done.stdout)
    assert plain["shift_m"] == pytest.approx(np.hypot(150_000, 400_000))
    assert plain["nodes"]["max_mm"] < 1e-3
    assert done.stderr == ""
