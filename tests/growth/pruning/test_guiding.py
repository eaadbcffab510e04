"""Stakes keep stems straight, not perfectly; bent wood keeps its lengths."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.errors import UsageError
from pipeline.growth import GrowthOptions, grow
from pipeline.growth.events import planned
from pipeline.growth.pruning import BendAndTie, Stake
from tests.growth.pruning.conftest import SEEDS, branches_of, check_whole

OPTIONS = GrowthOptions()
MEASURABLE_M = 0.001
"""In shadow alone, some stems are straight without a stake."""


def deviation(growth, way=(0.0, 0.0, 1.0)) -> float:
    """Mean distance of the stem's metamers from a line through the foot, metres."""
    stem = growth.metamers.end[growth.metamers.axis(0)[1:]]
    along = np.array(way) / np.linalg.norm(way)
    return float(np.linalg.norm(stem - (stem @ along)[:, None] * along, axis=1).mean())


@pytest.mark.parametrize("light", ["shadow", "space"])
def test_a_stake_halves_the_deviation_and_leaves_some(light) -> None:
    options = OPTIONS.model_copy(update={"light": light})
    ways = ((), planned(Stake(), 0))
    both = np.array([[deviation(grow(options, 10, seed=s, events=way)) for way in ways] for s in SEEDS])
    free, tied = both[both[:, 0] > MEASURABLE_M].T
    assert len(free) >= (30 if light == "space" else 15)
    assert tied.mean() <= free.mean() / 2
    assert np.mean(tied <= free / 2) >= 0.9
    assert np.mean(tied > MEASURABLE_M / 10) >= 0.9


@pytest.mark.parametrize(("way", "most"), [((1, 0, 1), 15.0), ((0, -1, 0), 25.0)], ids=["cordon", "level"])
def test_a_stake_may_lean(way, most) -> None:
    for seed in range(8):
        growth = grow(OPTIONS, 10, seed=seed, events=planned(Stake(direction=way), 0))
        stem = growth.metamers.end[growth.metamers.axis(0)[-1]]
        cosine = stem @ np.array(way) / np.linalg.norm(stem) / np.linalg.norm(way)
        assert np.degrees(np.arccos(cosine)) < most


def test_ties_are_taken_off_after_their_years() -> None:
    def lean(years) -> float:
        growth = grow(OPTIONS, 12, seed=3, events=planned(Stake(direction=(1, 0, 0.3), years=years), 0))
        return float(growth.metamers.direction[growth.metamers.axis(0)[-1], 2])

    assert lean(None) < 0.6 < lean(4)


def test_bending_keeps_lengths_and_joints_and_lays_the_branch_level(tree_of) -> None:
    for seed in SEEDS:
        growth = tree_of(12, seed)
        tree = growth.metamers
        high = [start for start in branches_of(growth) if tree.begin[start, 2] >= 0.5]
        branch = max(high, key=lambda start: len(tree.axis(start)))
        part = tree.subtree([branch])
        before = {name: values.copy() for name, values in tree.held().items()}
        done = BendAndTie(position=tuple(tree.end[tree.axis(branch)[-1]]), within_m=0.01).apply(growth)
        assert (done.bent, done.tied, done.removed) == (1, 1, 0)
        after = tree.held()
        length = [np.linalg.norm(held["end"] - held["begin"], axis=1) for held in (before, after)]
        np.testing.assert_allclose(*length, atol=1e-12)
        for name, values in before.items():
            if name != "support":
                assert after[name][~part].tobytes() == values[~part].tobytes(), name
        axis = tree.axis(branch)
        step = tree.end[axis[-1]] - tree.end[axis[2]]
        assert abs(step[2]) < 1e-9
        check_whole(growth)


def test_a_bent_branch_stays_nearly_level_as_it_grows(tree_of) -> None:
    growth = tree_of(10)
    branch = branches_of(growth)[3]
    key = int(growth.metamers.key[branch])
    BendAndTie(position=tuple(growth.metamers.end[branch])).apply(growth)
    for _ in range(4):
        growth.grow_year()
    axis = growth.metamers.axis(int(np.flatnonzero(growth.metamers.held()["key"] == key)[0]))
    step = growth.metamers.end[axis[-1]] - growth.metamers.end[axis[2]]
    assert abs(np.degrees(np.arcsin(step[2] / np.linalg.norm(step)))) < 15


def test_what_cannot_be_bent_is_told(tree) -> None:
    before = tree.metamers.held()["end"].copy()
    with pytest.raises(
        UsageError, match=r"wood \d\.\d cm thick does not bend \(thickest_m is 1 cm\); bend it farther"
    ):
        BendAndTie(order=0, direction=(1, 0, 0), thickest_m=0.01).apply(tree)
    with pytest.raises(UsageError, match=r"would lie \d\.\d\d m below the foot; bend it less"):
        BendAndTie(order=0, direction=(1, 0, -1), thickest_m=1).apply(tree)
    np.testing.assert_array_equal(tree.metamers.held()["end"], before)
    stem = tree.metamers.axis(0)
    tree.metamers.end[stem[-1], :2] = tree.metamers.begin[stem[1], :2] = 0.0
    with pytest.raises(UsageError, match="goes nowhere in plan"):
        BendAndTie(order=0, thickest_m=1).apply(tree)
