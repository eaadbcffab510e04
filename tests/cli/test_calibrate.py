"""`treepipe calibrate`: parameters for what two acquisitions show."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import pytest

from pipeline.config import Config
from pipeline.exchange import read_model, write
from pipeline.growth import GrowthOptions
from pipeline.growth.calibration import FITTED, SearchOptions, size_of
from pipeline.growth.carrying import Carrying, through
from pipeline.growth.events import read_events
from pipeline.jobs.calibration import acquire, events_path, fit_growth, report_lines
from pipeline.model import Skeleton
from pipeline.run import grow_on


@pytest.fixture(scope="module")
def pair(made, tmp_path_factory):
    """A sapling, and what it was after a branch was cut and it had grown for four years."""
    folder = tmp_path_factory.mktemp("pair")
    earlier = (
        read_model(made / "sapling" / "sapling.npz") if (made / "sapling" / "sapling.npz").exists() else None
    )
    earlier = earlier or read_model(made / "sapling" / "sapling.ls.json")
    growth = Carrying(earlier, GrowthOptions(alpha=2.6), seed=9)
    held = growth.metamers.held()
    inside = [
        growth.metamers.subtree([i]).sum() if held["is_lateral"][i] else 0 for i in range(len(held["order"]))
    ]
    growth.remove(max(range(len(inside)), key=inside.__getitem__))
    for _ in through(growth, 4):
        pass
    paths = folder / "earlier.npz", folder / "later.npz"
    write(earlier, paths[0])
    write(growth.to_model(), paths[1])
    return paths


def test_parameters_and_cuts_are_written_and_can_be_read(call, pair, tmp_path):
    target = tmp_path / "fit.toml"
    result = call("calibrate", *pair, "--years", 4, "-o", target, "--trials", 25)
    assert result.exit_code == 0, result.stderr
    text = target.read_text()
    assert "years between the acquisitions are as given" in text
    assert "height" in result.stdout
    options = GrowthOptions.model_validate(tomllib.loads(text))
    assert set(FITTED) <= set(tomllib.loads(text))
    events = tomllib.loads(events_path(target).read_text())["event"]
    assert {"year", "operation", "position"} <= set(events[0])
    assert events[0]["operation"] == "cut-to-bud"
    earlier, later = map(read_model, pair)
    grown = grow_on(earlier, options, 4, events=read_events(events_path(target)))
    reached, wanted, was = size_of(grown), size_of(later), size_of(earlier)
    assert abs(reached.height_m - wanted.height_m) < abs(wanted.height_m - was.height_m)
    again = call(
        "simulate", pair[0], "--params", target, "--years", 2, "-o", tmp_path / "out", "--no-picture"
    )
    assert again.exit_code == 0, again.stderr


def test_the_same_files_give_the_same_bytes(call, pair, tmp_path):
    targets = tmp_path / "a.toml", tmp_path / "b.toml"
    for target in targets:
        assert call("calibrate", *pair, "--years", 4, "-o", target, "--trials", 4, "--seed", 2).exit_code == 0
    assert targets[0].read_bytes() == targets[1].read_bytes()


def test_what_is_wrong_is_named(call, pair, tmp_path):
    target = tmp_path / "fit.toml"
    for arguments, code, said in (
        ((*pair, "--years", 0, "-o", target), 2, "--years"),
        ((*pair, "--years", 2, "-o", tmp_path / "fit.json"), 2, "end the name in .toml"),
        ((*pair, "--years", 2, "-o", target, "--species", "oak"), 2, "unknown species"),
        ((pair[0], tmp_path / "none.npz", "--years", 2, "-o", target), 1, "none.npz"),
        ((tmp_path / "none.laz", pair[0], "--years", 2, "-o", target), 1, "none.laz"),
        ((pair[0], tmp_path, "--years", 2, "-o", target), 1, "is a directory, and no model"),
        ((*pair, "--years", 2, "-o", pair[0] / "fit.toml"), 1, "choose another folder with -o"),
    ):
        result = call("calibrate", *arguments)
        assert (result.exit_code, said in result.stderr) == (code, True), result.stderr
    target.write_text("here = 1\n")
    result = call("calibrate", *pair, "--years", 2, "-o", target)
    assert (result.exit_code, "exists already" in result.stderr) == (2, True)
    assert target.read_text() == "here = 1\n"


def test_trees_that_stand_apart_are_not_searched_for_lost_wood(pair):
    earlier, later = (acquire(path, Config()) for path in pair)
    later.tree.skeleton.__dict__["world"] = later.tree.skeleton.world + 5.0  # as if in another system
    fit = fit_growth(earlier, later, 2, start=GrowthOptions(), search=SearchOptions(trials=1))
    assert fit.cuts == ()
    assert "bring both into one system" in "\n".join(report_lines(fit))


def test_that_feet_are_apart_is_said_once(call, pair, tmp_path):
    later = read_model(pair[1])
    graph = later.skeleton
    aside = Skeleton(graph.xyz, graph.parent, graph.origin + 5.0, graph.crs, graph.metadata)
    path = tmp_path / "aside.npz"
    write(replace(later, skeleton=aside), path)
    result = call("calibrate", pair[0], path, "--years", 4, "-o", tmp_path / "fit.toml", "--trials", 2)
    assert result.exit_code == 0, result.stderr
    assert (result.stdout + result.stderr).count("m apart, so lost wood is not sought") == 1
    assert "m apart, so lost wood is not sought" in (tmp_path / "fit.toml").read_text()


@pytest.mark.slow
def test_two_scans_of_one_tree(call, shared_data, tmp_path):
    clouds = [shared_data / "trees" / name for name in ("voxr_t0.asc", "voxr_t1.asc")]
    thin = tmp_path / "thin.toml"
    thin.write_text("[clean]\nvoxel_m = 0.03\n")
    more = ("--trials", 30, "--config", thin)
    result = call("calibrate", *clouds, "--years", 3, "-o", tmp_path / "fit.toml", *more)
    assert result.exit_code == 0, result.stderr
    rows = [line.split() for line in result.stdout.splitlines()]
    shares = {
        row[0]: float(row[-2].rstrip("%")) for row in rows if row and row[0] in {"height", "DBH", "crown"}
    }
    assert len(shares) == 3
    assert max(shares.values()) < 50  # 100 without any growth
