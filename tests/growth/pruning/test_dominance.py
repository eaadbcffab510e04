"""What the side branches below a cut gain: the structure of table 5.1 of the thesis, not its digits."""

from __future__ import annotations

import copy
from typing import NamedTuple

import numpy as np
import pytest

from pipeline.growth import DAMAGED, DORMANT, GROWN, GrowthOptions, grow
from pipeline.growth.allocation import Resource, by_borchert_honda, gather
from pipeline.growth.pruning import CutToBud
from tests.growth.pruning.conftest import SEEDS

OPTIONS = GrowthOptions()
YEARS = 8
PATTERN = [GROWN, DORMANT, GROWN, DORMANT, GROWN]
THRESHOLD = OPTIONS.lateral_threshold


class Table(NamedTuple):
    """Resource before and after the cut: at the root, of the five sides, and of the axis that was cut."""

    root: float
    cut_root: float
    before: np.ndarray
    after: np.ndarray
    leader: float


def shares(growth) -> Resource:
    """What the buds of a tree get next."""
    return by_borchert_honda(
        growth.metamers, gather(growth.metamers, growth.light.at_buds(growth.metamers)), OPTIONS
    )


@pytest.fixture(scope="module")
def tables():
    """Resource at the root and of five sides below a cut, before and after, wherever a stem fits the table.

    It fits where the sides from the cut down are a branch, a dormant bud, a branch, a bud and a branch.
    """
    found = []
    for seed in SEEDS:
        whole = grow(OPTIONS, YEARS, seed=seed)
        tree = whole.metamers
        stem = [int(i) for i in tree.axis(0)[1:] if tree.lateral_bud[i] != DAMAGED][::-1]
        for top in range(len(stem) - len(PATTERN)):
            rows = stem[top : top + len(PATTERN)]
            if tree.terminal_child[rows[0]] >= 0 and [int(tree.lateral_bud[i]) for i in rows] == PATTERN:
                found.append(table(whole, rows))
    return found


def table(whole, rows) -> Table:
    """Cut right above the first of the rows, and tell what they get."""
    cut = copy.deepcopy(whole)
    above = whole.metamers.end[whole.metamers.terminal_child[rows[0]]]
    CutToBud(position=tuple(above), within_m=0.01).apply(cut)
    keys = cut.metamers.held()["key"].tolist()
    there = [keys.index(int(whole.metamers.key[i])) for i in rows]
    before, after = shares(whole), shares(cut)
    return Table(
        before.root, after.root, before.lateral[rows], after.lateral[there], after.terminal[there[0]]
    )


def test_the_whole_falls_and_the_cut_axis_gets_nothing(tables) -> None:
    assert len(tables) >= 30
    for row in tables:
        assert row.cut_root < row.root
        assert row.leader == 0


def test_every_side_gains_in_value_and_in_share(tables) -> None:
    for row in tables:
        assert (row.after > row.before).all()
        assert (row.after / row.cut_root > row.before / row.root).all()


def test_the_gain_falls_with_the_distance_from_the_cut(tables) -> None:
    gain = np.array([row.after / row.before - 1.0 for row in tables])
    assert (np.diff(gain[:, [0, 2, 4]]) < 0).all(axis=1).mean() >= 0.8
    assert (gain[:, 3] < gain[:, 1]).mean() >= 0.9
    branches, buds = np.median(gain[:, [0, 2, 4]], axis=0), np.median(gain[:, [1, 3]], axis=0)
    assert branches[0] > branches[1] > branches[2]
    assert buds[0] > buds[1]


def test_the_bud_nearest_the_cut_comes_closest_to_growing(tables) -> None:
    wait = np.array([row.after[[1, 3]] / THRESHOLD for row in tables])
    assert (wait[:, 0] > wait[:, 1]).mean() >= 0.8
    assert (wait >= 1.0).any(axis=0).tolist() == [True, False]
