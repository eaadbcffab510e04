"""Figures against known truth are those of the independent scorer."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from pipeline.accuracy import NotComparableError, compare_cloud, compare_truth
from pipeline.accuracy.bark import nearest_bark
from pipeline.accuracy.clouds import points_of_tree
from pipeline.accuracy.wood import wood_of
from pipeline.cloud import read_cloud
from pipeline.formats import qsm
from pipeline.geometry.numbering import from_edges
from pipeline.model import Skeleton, TreeModel
from pipeline.synthetic import Truth, read_truth, truth_of
from tests.accuracy.conftest import changed, pole

SAME = (
    *("volume_error_pct", "stem_volume_error_pct", "branch_volume_error_pct", "length_error_pct"),
    *("dbh_error_pct", "branches_ratio", "radius_error_mm"),
    *("recall", "precision", "recall_by_order", "order_accuracy"),
)


@pytest.fixture(scope="module")
def scorer(shared_data):
    """The independent scorer as a module."""
    file = shared_data.parent / "tools" / "score.py"
    if not file.is_file():
        pytest.skip(f"the independent scorer is not at {file}")
    spec = importlib.util.spec_from_file_location("independent_scorer", file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def guessed(truth: Truth, seed: int) -> TreeModel:
    """A model that errs: nodes 2 cm off, other radii, the branches told apart anew, some of them lost."""
    rng = np.random.default_rng(seed)
    first = int(np.argmin(truth.parent))
    xyz = np.concatenate([truth.s[[first]], truth.e])
    gone = np.zeros(len(xyz), dtype=bool)
    for i, p in enumerate(truth.parent.tolist()):
        gone[i + 1] = (p >= 0 and gone[p + 1]) or (truth.order[i] > 0 and rng.random() < 0.004)
    kept = np.flatnonzero(~gone)
    number = np.cumsum(~gone) - 1
    edges = np.column_stack([truth.parent + 1, np.arange(len(truth.r)) + 1])[~gone[1:]]
    node, parent = from_edges(xyz[kept], number[edges])
    world = xyz[kept][node] + rng.normal(0, 0.02, (len(node), 3))
    radius = np.concatenate([truth.r[[first]], truth.r])[kept][node] * rng.lognormal(0, 0.2, len(node))
    origin = np.floor(world[0])
    return TreeModel(
        Skeleton(world - origin, parent, origin),
        radius,
        np.zeros(len(node), dtype=np.uint8),
        np.full(len(node), np.nan),
    )


@pytest.mark.parametrize(("name", "seed"), [("syn_A", 1), ("syn_A", 2), ("syn_B", 3)])
def test_the_scorer_says_the_same(name, seed, scorer, shared_data, tmp_path):
    folder: Path = shared_data / "truth"
    file = tmp_path / "guess.qsm.csv"
    qsm.write(guessed(read_truth(folder / f"{name}.truth.npz"), seed), file)
    cloud = folder / f"{name}_als.laz"
    theirs = scorer.score(
        scorer.read_model(file), scorer.read_cloud(str(cloud)), np.load(folder / f"{name}.truth.npz")
    )
    model, truth = qsm.read(file), read_truth(folder / f"{name}.truth.npz")
    ours = compare_cloud(model, read_cloud(cloud), truth).to_dict()
    assert 0.5 < theirs["recall"] < 0.99
    assert theirs["order_accuracy"] < 0.999
    for key in SAME:
        assert ours[key] == pytest.approx(theirs[key], rel=1e-9, abs=1e-9), key
    for key in ("mean", "median", "p95"):
        assert ours["surface"][f"{key}_mm"] == pytest.approx(theirs["surface_mm"][key], rel=1e-9)
    assert ours["surface_floor_mm"] == pytest.approx(theirs["surface_floor_mm"], rel=1e-9)
    for key in ("volume_l", "stem_volume_l", "branch_volume_l", "length_m", "dbh_cm", "branches_ge_1cm"):
        assert ours["amounts"]["a"][key] == pytest.approx(theirs[key], rel=1e-9), key
    assert compare_truth(model, truth).to_dict()["recall"] == ours["recall"]


def test_the_scorer_finds_no_nearer_bark(scorer, shared_data):
    """Its search looks at some candidates; ours at all. They part on no point of a dense cloud."""
    truth = read_truth(shared_data / "truth" / "syn_A.truth.npz")
    model = guessed(truth, 4)
    points = points_of_tree(read_cloud(shared_data / "truth" / "syn_A_noisy.laz"))[::10]
    wood = wood_of(model)
    tubes = wood.tubes()
    theirs = scorer.to_surface(points, tubes.start, tubes.end, tubes.start_radius, tubes.end_radius)
    ours = np.abs(nearest_bark(points, tubes).surface)
    assert (ours <= theirs + 1e-9).all()
    assert ours.mean() == pytest.approx(theirs.mean(), rel=1e-3)


def test_the_hanging_end_of_a_stem_is_no_trunk():
    """It crosses breast height once more, a centimetre thick."""
    hanging = pole(
        (0, 0, 0), (0, 0, 4), (1, 0, 5), (2, 0, 4), (2, 0, 0.5), radius=[0.2, 0.2, 0.05, 0.02, 0.005]
    )
    upright = pole((0, 0, 0), (0, 0, 4), radius=0.2)
    assert compare_truth(hanging, truth_of(upright)).dbh_error_pct == pytest.approx(0.0, abs=1e-9)


def test_truth_of_a_tree_is_its_equal(tree):
    found = compare_truth(tree, truth_of(tree))
    assert found.recall == found.precision == found.order_accuracy == 1.0
    assert found.length_error_pct == pytest.approx(0)
    assert found.volume_error_pct == pytest.approx(0, abs=2)  # cylinders for tapered segments
    assert (found.nodes, found.shift_m, found.matched_by) == (None, None, None)
    assert found.branches.matched == found.branches.b


def test_truth_of_another_place_is_refused(tree):
    with pytest.raises(NotComparableError, match="the truth do not overlap"):
        compare_truth(tree, truth_of(changed(tree, origin=[5000, 0, 0])))
