"""Resource by hand and by plain Python: gathered, split at forks or by rank, handed down from cut ends."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.growth import DAMAGED, DORMANT, Growth, GrowthOptions, Metamers, grow
from pipeline.growth.allocation import by_borchert_honda, by_priority, gather
from pipeline.growth.sight import BudLight, bud_light
from pipeline.growth.simulation import _is_by_priority


def pole(metamers: int) -> Metamers:
    """A stem of metamers with dormant buds: grown with resource for the terminal bud alone."""
    growth = Growth(Metamers.one_bud(), GrowthOptions(lateral_threshold=1.0), seed=1)
    growth.options = GrowthOptions(lateral_threshold=100.0)
    while len(growth.metamers) <= metamers:
        growth.grow_year()
    growth.remove(metamers + 1) if len(growth.metamers) > metamers + 1 else None
    growth.metamers.terminal_bud[metamers] = DORMANT
    return growth.metamers


def all_lit(tree: Metamers) -> BudLight:
    """Every bud in full light."""
    return bud_light(tree, np.ones(len(tree)), np.ones(len(tree)))


def axis_of(tree: Metamers, start: int) -> list[int]:
    """The metamers of an axis, and before them nothing."""
    return [int(i) for i in tree.axis(start)]


def alive(tree: Metamers, i: int) -> bool:
    """Whether a metamer or what it bears has a dormant bud."""
    return any(
        DORMANT in (tree.terminal_bud[j], tree.lateral_bud[j])
        for j in np.flatnonzero(tree.subtree([i])).tolist()
    )


def light_of(tree: Metamers, lit: BudLight, start: int) -> tuple[dict[int, float], dict[int, float]]:
    """Light that passes each fork of an axis: ahead, and from the side."""
    axis = axis_of(tree, start)
    side = {}
    for i in axis:
        s = int(tree.lateral_child[i])
        side[i] = float(lit.lateral[i]) if s < 0 else sum(part[s] for part in light_of(tree, lit, s))
    ahead = {axis[-1]: float(lit.terminal[axis[-1]])}
    if tree.terminal_bud[axis[-1]] == DAMAGED and not any(hears(tree, i) for i in axis):
        ahead[axis[-1]] = 0.0
    for low, high in zip(axis[-2::-1], axis[:0:-1], strict=True):
        ahead[low] = ahead[high] + side[high]
    return ahead, side


def hears(tree: Metamers, i: int) -> bool:
    """Whether the side of a metamer can take what is handed down."""
    s = int(tree.lateral_child[i])
    return bool(tree.lateral_bud[i] == DORMANT or (s >= 0 and alive(tree, s)))


def twin(tree: Metamers, lit: BudLight, options: GrowthOptions, start: int, v: float, out: dict) -> None:
    """Eq. 4.2 and 4.3 of the thesis and the shares below a damaged end, in plain Python."""
    ahead, side = light_of(tree, lit, start)
    got = {}
    for i in axis_of(tree, start):
        main, beside = options.dominance * ahead[i], (1 - options.dominance) * side[i]
        part = v * main / (main + beside) if main + beside else 0.0
        got[i], v = v - part, part
        last = i
    if tree.terminal_bud[last] == DAMAGED and v:
        takers = [i for i in reversed(axis_of(tree, start)) if hears(tree, i)]
        for i in takers:
            got[i] += options.damaged_share * v
            v -= options.damaged_share * v
        got[takers[-1]] += v
        v = 0.0
    out["terminal"][last] = v
    for i, amount in got.items():
        out["lateral"][i] = amount
        if tree.lateral_child[i] >= 0:
            twin(tree, lit, options, int(tree.lateral_child[i]), amount, out)


@pytest.mark.parametrize("cuts", [[], [8], [8, 3]])
def test_borchert_honda_is_that_of_plain_python(cuts: list[int]) -> None:
    growth = grow(GrowthOptions(), 11, seed=4)
    for cut in cuts:
        growth.remove(int(growth.metamers.axis()[cut]))
        growth.grow_year()
    tree, options = growth.metamers, growth.options
    lit = growth.light.at_buds(tree)
    got = by_borchert_honda(tree, gather(tree, lit), options)
    out: dict = {"terminal": {}, "lateral": {}}
    twin(tree, lit, options, 0, got.root, out)
    ends = sorted(out["terminal"])
    np.testing.assert_allclose(got.terminal[ends], [out["terminal"][i] for i in ends], rtol=1e-9, atol=1e-12)
    sides = sorted(out["lateral"])
    np.testing.assert_allclose(got.lateral[sides], [out["lateral"][i] for i in sides], rtol=1e-9, atol=1e-12)


def test_a_fork_of_equal_light_gives_the_main_axis_its_dominance() -> None:
    tree = pole(1)
    got = by_borchert_honda(tree, gather(tree, all_lit(tree)), GrowthOptions(dominance=0.7, alpha=2.0))
    assert got.root == pytest.approx(4.0)
    assert (got.terminal[1], got.lateral[1]) == (pytest.approx(2.8), pytest.approx(1.2))


def test_at_a_dominance_of_a_half_every_bud_gets_alpha_times_its_light() -> None:
    tree = pole(6)
    light = np.linspace(0.2, 1.0, len(tree))
    lit = bud_light(tree, light, light)
    got = by_borchert_honda(tree, gather(tree, lit), GrowthOptions(dominance=0.5, alpha=2.2))
    np.testing.assert_allclose(got.lateral[1:], 2.2 * light[1:])
    assert got.terminal[-1] == pytest.approx(2.2 * light[-1])


def test_a_damaged_end_hands_down_half_a_quarter_an_eighth_and_the_rest() -> None:
    tree, options = pole(4), GrowthOptions(dominance=0.5, alpha=2.0)
    tree.terminal_bud[4] = DAMAGED
    got = by_borchert_honda(tree, gather(tree, all_lit(tree)), options)
    assert got.terminal[4] == 0.0
    np.testing.assert_allclose(got.lateral[[4, 3, 2, 1]] - 2.0, 2.0 * np.array([0.5, 0.25, 0.125, 0.125]))


def test_priority_weighs_by_rank() -> None:
    tree = pole(4)
    light = np.array([0.0, 0.4, 0.8, 0.6, 0.2])
    options = GrowthOptions(
        allocation="priority", alpha=1.0, priority_most=1.0, priority_least=0.2, priority_fall=0.5
    )
    lit = bud_light(tree, np.where(np.arange(5) == 4, 0.5, 0.0), light)
    got = by_priority(tree, gather(tree, lit), options)
    weight = {"end": 1.0, 2: 0.6, 3: 0.2, 1: 0.2, 4: 0.2}
    total = 0.5 + sum(light[i] * weight[i] for i in (1, 2, 3, 4))
    assert got.terminal[4] == pytest.approx(2.5 * 0.5 / total)
    for i in (1, 2, 3, 4):
        assert got.lateral[i] == pytest.approx(2.5 * light[i] * weight[i] / total)


def test_priority_ends_with_its_last_year() -> None:
    both = GrowthOptions(allocation="priority", switch_year=3)
    assert [_is_by_priority(both, year) for year in (1, 3, 4)] == [True, True, False]
    assert _is_by_priority(GrowthOptions(allocation="priority"), 99)
    assert not _is_by_priority(GrowthOptions(switch_year=3), 1)
    first = grow(both, 3, seed=2).metamers.held()["end"]
    np.testing.assert_array_equal(
        first, grow(GrowthOptions(allocation="priority"), 3, seed=2).metamers.held()["end"]
    )


def test_more_dominance_makes_a_higher_tree() -> None:
    high, low = (
        grow(GrowthOptions(dominance=d, alpha=2.4), 15, seed=1).metamers.held() for d in (0.55, 0.45)
    )
    assert high["end"][:, 2].max() > low["end"][:, 2].max()
    assert high["order"].mean() < low["order"].mean()


def test_an_axis_with_too_many_sides_is_shared_out_fork_by_fork() -> None:
    tree, more = pole(6), GrowthOptions(allocation="priority", priority_sides=6)
    light = gather(tree, all_lit(tree))
    fewer, forks = (by(tree, light, GrowthOptions()) for by in (by_priority, by_borchert_honda))
    np.testing.assert_array_equal(fewer.terminal, forks.terminal)
    np.testing.assert_array_equal(fewer.lateral, forks.lateral)
    assert by_priority(tree, light, more).terminal[-1] > 2.0 * forks.terminal[-1]


def test_by_priority_trees_do_not_explode() -> None:
    forks = grow(GrowthOptions(), 25, seed=1)
    ranks = grow(GrowthOptions(allocation="priority"), 25, seed=1)
    assert len(ranks.metamers) < 4 * len(forks.metamers)
    height = [np.ptp(growth.metamers.held()["end"][:, 2]) for growth in (forks, ranks)]
    assert height[0] < height[1] < 1.5 * height[0]
