"""A growing tree: what is shared adds up, cuts leave no trace, and the rules of buds hold."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.errors import UsageError
from pipeline.growth import (
    DAMAGED,
    DORMANT,
    BarePoleWarning,
    Growth,
    GrowthOptions,
    Metamers,
    bare_pole,
    grow,
)
from pipeline.growth.light import Shadow
from pipeline.growth.views import BLOCKED


@pytest.mark.parametrize("allocation", ["bh", "priority"])
def test_buds_share_exactly_what_the_root_has(allocation: str) -> None:
    growth = grow(GrowthOptions(allocation=allocation), 10, seed=1)
    growth.remove(int(growth.metamers.axis()[8]))
    tree, options = growth.metamers, growth.options
    from pipeline.growth.allocation import by_borchert_honda, by_priority, gather

    share = by_priority if allocation == "priority" else by_borchert_honda
    got = share(tree, gather(tree, growth.light.at_buds(tree)), options)
    ends = tree.terminal_bud[: len(tree)] == DORMANT
    sides = tree.lateral_bud[: len(tree)] == DORMANT
    assert got.root > 0
    assert got.terminal[ends].sum() + got.lateral[sides].sum() == pytest.approx(got.root, rel=1e-12)
    assert got.terminal[tree.terminal_bud[: len(tree)] == DAMAGED].sum() == 0


def test_a_cut_leaves_no_trace_in_the_shade() -> None:
    growth = grow(GrowthOptions(), 10, seed=2)
    growth.remove(int(growth.metamers.axis()[5]))
    fresh = Growth(growth.metamers, growth.options, seed=2).light.grid
    at = fresh.low - growth.light.grid.low
    inner = tuple(slice(a, a + n) for a, n in zip(at, fresh.values.shape, strict=True))
    np.testing.assert_array_equal(growth.light.grid.values[inner], fresh.values)
    assert growth.light.grid.values.sum() == fresh.values.sum()


def test_a_cut_leaves_no_trace_in_space() -> None:
    growth = grow(GrowthOptions(light="space"), 10, seed=2)
    growth.remove(int(growth.metamers.axis()[5]))
    fresh = Growth(growth.metamers, growth.options, seed=2)
    held = [
        {tuple(place): count for place, count in zip(*light.taken(), strict=True)}
        for light in (growth.light, fresh.light)
    ]
    assert len(held[0]) > len(held[1]) > 100
    assert {place: held[0][place] for place in held[1]} == held[1]
    assert all(held[0][place] in (0, BLOCKED) for place in held[0].keys() - held[1].keys())


def test_growth_turns_away_from_a_shade_off_the_axis() -> None:
    shadow = Shadow(GrowthOptions())
    shadow.add(np.array([[0.25, 0.05, 0.25]]))
    tree = Metamers.one_bud((0.05, 0.05, 0.05))
    way = shadow.towards(tree, np.array([0], dtype=np.int32), np.array([False]))[0]
    assert way[0] < -0.1
    assert way[2] < 0
    assert np.linalg.norm(way) == pytest.approx(1)


def test_laterals_wait_for_the_terminal() -> None:
    tree = grow(GrowthOptions(), 12, seed=1).metamers
    side = np.flatnonzero(tree.is_lateral[: len(tree)])
    above = tree.terminal_child[tree.parent[side]]
    assert len(side) > 5
    grown = above >= 0
    assert (tree.birth_year[above[grown]] < tree.birth_year[side[grown]]).all()


def test_the_same_seed_gives_the_same_tree_and_widths_never_fall() -> None:
    one, two = (grow(GrowthOptions(), 9, seed=5) for _ in range(2))
    for name, values in one.metamers.held().items():
        np.testing.assert_array_equal(values, two.metamers.held()[name])
    before = one.metamers.width[1]
    one.remove(int(one.metamers.axis()[3]))
    one.grow_year()
    assert one.metamers.width[1] >= before


def test_too_many_metamers_stop_with_the_number() -> None:
    with pytest.raises(UsageError, match=r"most_metamers, 100; raise it"):
        grow(GrowthOptions(most_metamers=100), 25, seed=1)


def test_a_bare_pole_is_warned_of() -> None:
    with pytest.warns(BarePoleWarning, match="raise alpha above"):
        grow(GrowthOptions(alpha=2.0), 1, seed=1)


@pytest.mark.parametrize(("perception_deg", "alpha"), [(110.0, 2.2), (140.0, 3.0), (180.0, 4.0)])
def test_wide_cones_grow_a_bare_pole_and_are_warned_of(perception_deg: float, alpha: float) -> None:
    options = GrowthOptions(light="space", perception_deg=perception_deg, alpha=alpha)
    with pytest.warns(BarePoleWarning, match="or lower lateral_threshold or perception_deg"):
        growth = grow(options, 10, seed=1)
    assert growth.metamers.held()["is_lateral"].sum() <= 1
    enough = float(str(bare_pole(options)).split("raise alpha above ")[1].split()[0])
    assert bare_pole(options.model_copy(update={"alpha": 1.01 * enough})) is None


def test_cones_that_let_branches_grow_are_not_warned_of() -> None:
    for options in (
        GrowthOptions(light="space"),
        GrowthOptions(light="space", perception_deg=120.0, alpha=4.0),
    ):
        assert grow(options, 10, seed=1).metamers.held()["is_lateral"].sum() > 5


@pytest.mark.parametrize("metamer", [0, -1, 10_000])
def test_the_foot_and_what_is_not_there_cannot_be_cut(metamer: int) -> None:
    with pytest.raises(UsageError, match="choose one of them"):
        grow(GrowthOptions(), 3, seed=1).remove(metamer)
