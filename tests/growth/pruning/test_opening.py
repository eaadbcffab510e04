"""An open tree: two or three leaders, wider for its height, lower."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.growth import DAMAGED, GrowthOptions, grow
from pipeline.growth.events import planned
from pipeline.growth.pruning import OpenCentre
from tests.growth.pruning.conftest import SEEDS, branches_of

OPTIONS = GrowthOptions()
YEARS, CUT = 18, 9


def size(growth) -> tuple[float, float]:
    """Greatest width in plan over height, and height, metres: the way it lies is no matter."""
    end, turn = growth.metamers.held()["end"], np.radians(np.arange(0.0, 180.0, 5.0))
    wide = np.ptp(end[:, :2] @ np.stack([np.cos(turn), np.sin(turn)]), axis=0).max()
    high = np.ptp(end[:, 2])
    return wide / high, high


def leaders(growth) -> int:
    """Branches of the stem with a tenth of the wood that reach two thirds of the tree's height."""
    tree = growth.metamers
    top = tree.held()["end"][:, 2].max()
    parts = [tree.subtree([branch]) for branch in branches_of(growth)]
    return sum(p.mean() >= 0.1 and tree.held()["end"][p, 2].max() >= top * 2 / 3 for p in parts)


@pytest.fixture(scope="module")
def trees():
    """For every seed: left alone, opened once, and kept open."""
    once, again = planned(OpenCentre(), CUT), planned(OpenCentre(), CUT, until=YEARS, every=2)
    return [[grow(OPTIONS, YEARS, seed=s, events=what) for what in ((), once, again)] for s in SEEDS]


def test_the_cut_is_right_above_the_third_side_branch(tree_of) -> None:
    for seed in SEEDS:
        growth = tree_of(10, seed)
        tree = growth.metamers
        stem = tree.axis(0)
        third = [int(i) for i in stem if tree.lateral_child[i] >= 0][2]
        keep = tree.key[stem[: list(stem).index(third) + 1]].tolist()
        assert OpenCentre().apply(growth).cuts == 1
        assert tree.key[tree.axis(0)].tolist() == keep
        assert tree.terminal_bud[tree.axis(0)[-1]] == DAMAGED
        assert len(branches_of(growth)) == 3


def test_two_or_three_leaders_a_lower_and_relatively_wider_tree(trees) -> None:
    alone, once, again = (np.array([size(row[i]) for row in trees]) for i in range(3))
    assert all(leaders(row[1]) in {2, 3} for row in trees)
    assert all(leaders(row[2]) in {2, 3} for row in trees)
    assert (once[:, 1] < alone[:, 1]).all()
    assert (once[:, 0] > alone[:, 0]).mean() >= 0.75
    assert once[:, 0].mean() > alone[:, 0].mean()
    assert (again[:, 1] < alone[:, 1]).all()
    assert (again[:, 0] > alone[:, 0]).mean() >= 0.9
    assert again[:, 0].mean() > once[:, 0].mean()


def test_no_stem_goes_on_through_the_crown(trees) -> None:
    for _, once, _ in trees:
        assert len(once.metamers.axis(0)) < 12


def test_level_heads_the_higher_branches_back_to_the_middle_one(tree_of) -> None:
    for seed in SEEDS:
        plain, level = tree_of(10, seed), tree_of(10, seed)
        OpenCentre().apply(plain)
        OpenCentre(level=True).apply(level)
        before, after = (
            sorted(g.metamers.held()["end"][g.metamers.subtree([b]), 2].max() for b in branches_of(g))
            for g in (plain, level)
        )
        assert len(after) == 3
        assert set(level.metamers.held()["key"].tolist()) <= set(plain.metamers.held()["key"].tolist())
        assert after[-1] <= before[1] + 1e-9


def test_level_makes_more_leaders_and_a_relatively_wider_tree(trees) -> None:
    events = planned(OpenCentre(level=True), CUT)
    level = [grow(OPTIONS, YEARS, seed=s, events=events) for s in SEEDS]
    alone, once = (np.array([size(row[i])[0] for row in trees]) for i in range(2))
    ratio = np.array([size(growth)[0] for growth in level])
    assert (ratio > alone).mean() >= 0.85
    assert ratio.mean() > once.mean()
    assert all(leaders(growth) in {2, 3} for growth in level)


def test_a_tree_with_too_few_branches_waits(tree_of) -> None:
    growth = tree_of(10)
    assert OpenCentre(leaders=20).apply(growth).idle


def test_branches_can_be_opened_too(tree_of) -> None:
    growth = tree_of(14)
    done = OpenCentre(order=1, leaders=2).apply(growth)
    assert done.cuts > 1
    assert len(growth.metamers.axis(0)) > 10


def test_a_bare_stem_may_be_longer(tree_of) -> None:
    short, long = tree_of(12), tree_of(12)
    OpenCentre().apply(short)
    OpenCentre(trunk_m=0.6).apply(long)
    assert len(short.metamers.axis(0)) < len(long.metamers.axis(0))
