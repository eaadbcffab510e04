"""Which buds grow, how far and which way, by hand and by plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.growth import DAMAGED, DORMANT, GROWN, Growth, GrowthOptions, Metamers, grow
from pipeline.growth.allocation import Resource
from pipeline.growth.shoots import buds_that_grow, grow_shoots

NO_PULL = np.zeros((1, 3))


def resource(tree: Metamers, terminal: float, lateral: float) -> Resource:
    """The same for every bud."""
    return Resource(np.full(len(tree), terminal), np.full(len(tree), lateral), 0.0)


def two_years() -> Metamers:
    """A stem of one metamer a year, all its lateral buds dormant."""
    tree, options = Metamers.one_bud(), GrowthOptions()
    for year in (1, 2):
        buds = buds_that_grow(tree, resource(tree, 1.0, 0.0), year, options)
        grow_shoots(tree, buds, np.zeros((len(buds.metamer), 3)), NO_PULL, year, options)
    return tree


def test_a_terminal_bud_needs_one_and_a_lateral_one_more() -> None:
    tree, options = two_years(), GrowthOptions()
    assert len(buds_that_grow(tree, resource(tree, 0.999, 1.799), 3, options).metamer) == 0
    assert buds_that_grow(tree, resource(tree, 1.0, 0.0), 3, options).is_lateral.tolist() == [False]
    both = buds_that_grow(tree, resource(tree, 0.0, 1.8), 3, options)
    assert (both.metamer.tolist(), both.is_lateral.tolist()) == ([1], [True])


def test_a_lateral_bud_waits_for_the_one_beside_it_or_for_its_end() -> None:
    tree, options = two_years(), GrowthOptions()
    assert buds_that_grow(tree, resource(tree, 0.0, 5.0), 2, options).metamer.tolist() == []
    tree.terminal_bud[2] = DAMAGED
    assert buds_that_grow(tree, resource(tree, 0.0, 5.0), 3, options).metamer.tolist() == [1, 2]


@pytest.mark.parametrize(("got", "number", "length"), [(1.0, 1, 0.1), (3.9, 3, 0.13), (30.0, 4, 0.1)])
def test_resource_becomes_whole_metamers_and_may_lengthen_them(
    got: float, number: int, length: float
) -> None:
    for by, metres in (("constant", 0.1), ("resource", length)):
        tree, options = two_years(), GrowthOptions(longest_shoot=4, length_by=by)
        buds = buds_that_grow(tree, resource(tree, got, 0.0), 3, options)
        assert buds.metamers.tolist() == [number]
        new = grow_shoots(tree, buds, np.zeros((1, 3)), NO_PULL, 3, options)
        assert new.stop - new.start == number
        assert buds.length[0] == pytest.approx(metres)


@pytest.mark.parametrize("light", ["shadow", "space"])
def test_directions_are_those_of_plain_numpy(light: str) -> None:
    options = GrowthOptions(light=light, takeover_weight=0.4, vertical_fall=0.01)
    growth = grow(options, 12, seed=6)
    stem = growth.metamers.axis()
    growth.remove(int(stem[np.flatnonzero(growth.metamers.lateral_bud[stem[:-1]] == DORMANT)[-2] + 1]))
    tree, year = growth.metamers, 13
    lit = growth.light.at_buds(tree)
    got = resource(tree, 2.0, 2.5)
    buds = buds_that_grow(tree, got, year, options)
    towards = growth.light.towards(tree, buds.metamer, buds.is_lateral)
    beside_a_cut = [
        bool(s and tree.terminal_bud[i] == DAMAGED)
        for i, s in zip(buds.metamer, buds.is_lateral, strict=True)
    ]
    made = grow_shoots(tree, buds, towards, NO_PULL, year, options)
    new = iter(range(made.start, made.stop))
    assert any(beside_a_cut)
    assert lit.terminal.sum() > 0
    up = np.array([0.0, 0.0, options.vertical_weight - 12 * options.vertical_fall])
    for b, below in enumerate(buds.metamer):
        own = tree.lateral_bud_direction[below] if buds.is_lateral[b] else tree.direction[below]
        takeover = beside_a_cut[b] * options.takeover_weight * tree.direction[below]
        start = tree.end[below]
        for _ in range(buds.metamers[b]):
            way = options.bud_weight * own + options.light_weight * towards[b] + up + takeover
            own = way / np.linalg.norm(way)
            if start[2] + 0.1 * own[2] < 0:
                break
            i = next(new)
            np.testing.assert_allclose(tree.direction[i], own, atol=1e-12)
            np.testing.assert_allclose(tree.begin[i], start, atol=1e-12)
            start, takeover = tree.end[i], 0.0
            np.testing.assert_allclose(start, tree.begin[i] + 0.1 * own, atol=1e-12)
    assert next(new, None) is None


def test_lateral_buds_stand_at_their_angles() -> None:
    options = GrowthOptions()
    tree = grow(options, 14, seed=2).metamers
    rows = np.arange(1, len(tree))
    lean = np.degrees(np.arccos((tree.direction[rows] * tree.lateral_bud_direction[rows]).sum(axis=1)))
    assert (abs(lean - options.insertion_deg) <= options.insertion_spread_deg + 1e-6).all()
    assert lean.std() > 1
    on = rows[~tree.is_lateral[rows] & (tree.parent[rows] > 0)]
    turn = tree.phyllotactic_angle[on] - tree.phyllotactic_angle[tree.parent[on]]
    assert (abs(turn - options.phyllotaxis_deg) <= options.phyllotaxis_spread_deg + 1e-6).all()
    for i in on[:30]:
        axis = tree.direction[i]
        flat = [v - (v @ axis) * axis for v in (tree.lateral_bud_direction[p] for p in (tree.parent[i], i))]
        angle = np.degrees(np.arctan2(np.cross(*flat) @ axis, flat[0] @ flat[1]))
        assert (angle - turn[list(on).index(i)] + 180) % 360 == pytest.approx(180, abs=1e-6)


def test_falling_vertical_weight_makes_twigs_hang() -> None:
    held = [
        grow(GrowthOptions(light_weight=0.2, vertical_fall=fall), 18, seed=1).metamers.held()
        for fall in (0, 0.03)
    ]
    rise = [h["direction"][(h["order"] > 0) & (h["birth_year"] > 14), 2].mean() for h in held]
    assert rise[1] < 0 < rise[0]


@pytest.mark.parametrize("kind", ["box", "cylinder", "ellipsoid"])
def test_no_shoot_leaves_the_bound(kind: str) -> None:
    options = GrowthOptions(
        bound=kind, bound_width_m=1.2, bound_depth_m=0.8, bound_height_m=2.0, bound_base_m=0.5
    )
    at = grow(options, 20, seed=3).metamers.held()["end"]
    assert at[:, 2].max() <= 2.5 + 1e-9
    assert at[:, 2].max() > 1.5
    u, v, w = at[:, 0] / 0.6, at[:, 1] / 0.4, at[:, 2] - 1.5
    stem = (w < 0) & (u**2 + v**2 < 0.15**2)
    flat = {"box": np.maximum(abs(u), abs(v)), "cylinder": np.hypot(u, v)}
    size = np.sqrt(u**2 + v**2 + w**2) if kind == "ellipsoid" else np.maximum(flat[kind], abs(w))
    assert (size[~stem] <= 1 + 1e-9).all()


def test_widths_are_those_of_plain_python_and_only_old_side_branches_die() -> None:
    options = GrowthOptions(shed_threshold=0.35)
    growth = Growth(Metamers.one_bud(), options, seed=1)
    shed = 0
    for _ in range(18):
        leader = growth.metamers.held()["key"][growth.metamers.axis()]
        shed += growth.grow_year().shed
        assert np.isin(leader, growth.metamers.held()["key"]).all()
    assert shed > 5
    tree = growth.metamers
    assert (tree.lateral_bud[: len(tree)] == DAMAGED).sum() > 1
    whole = grow(GrowthOptions(shed_threshold=0.0), 18, seed=1)
    assert sum(report.shed for report in whole.log) == 0
    tree, tip = whole.metamers, 2 * options.tip_radius_m
    for i in range(len(tree) - 1, -1, -1):
        above = [int(c[i]) for c in (tree.terminal_child, tree.lateral_child) if c[i] >= 0]
        carried = sum(tree.width[c] ** 2.3 for c in above) ** (1 / 2.3) if above else tip
        assert tree.width[i] == pytest.approx(carried)
        assert (tree.terminal_bud[i] == GROWN, tree.terminal_bud[i] == DORMANT) == (
            tree.terminal_child[i] >= 0,
            tree.terminal_child[i] < 0,
        )
