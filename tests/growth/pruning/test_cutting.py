"""Cuts by place and by length, crowns within bounds: limits hold, and nothing more goes than must."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.growth import DAMAGED
from pipeline.growth.pruning import CrownRaise, CutToBud, LimitLength, Reduce, Thin
from pipeline.growth.pruning.operation import leader
from tests.growth.pruning.conftest import SEEDS


def keys(growth) -> set[int]:
    return set(growth.metamers.held()["key"].tolist())


def test_a_cut_takes_the_wood_at_the_position_and_all_above(tree) -> None:
    held = tree.metamers.held()
    stem = tree.metamers.axis(0)
    cut = int(stem[5])
    below, gone = int(stem[4]), set(held["key"][tree.metamers.subtree([cut])].tolist())
    before = keys(tree)
    done = CutToBud(position=tuple((held["begin"][cut] + held["end"][cut]) / 2)).apply(tree)
    assert before - keys(tree) == gone
    assert done.removed == len(gone)
    assert tree.metamers.terminal_bud[below] == DAMAGED


def test_a_length_is_kept_down_to_a_bud(tree) -> None:
    CutToBud(order=0, length_m=0.65).apply(tree)
    stem = tree.metamers.axis(0)
    assert len(stem) == 7
    assert tree.metamers.terminal_bud[stem[-1]] == DAMAGED


def test_branches_without_a_length_go_altogether(tree) -> None:
    CutToBud(order=1, lowest_m=0.4).apply(tree)
    held = tree.metamers.held()
    assert held["begin"][held["is_lateral"] & (held["order"] == 1), 2].max() < 0.4


@pytest.mark.parametrize("length_m", [0.2, 0.45])
def test_no_wood_is_farther_from_where_its_branch_begins(tree_of, length_m) -> None:
    for seed in SEEDS:
        growth = tree_of(12, seed)
        before = keys(growth)
        LimitLength(length_m=length_m).apply(growth)
        held = growth.metamers.held()
        away = np.zeros(len(growth.metamers))
        for i in range(1, len(away)):
            if held["order"][i]:
                on = held["order"][held["parent"][i]] > 0
                away[i] = np.linalg.norm(held["end"][i] - held["begin"][i]) + (
                    away[held["parent"][i]] if on else 0
                )
        assert length_m - 0.1001 < away.max() <= length_m + 1e-9
        assert keys(growth) < before
        assert LimitLength(length_m=length_m).apply(growth).idle


@pytest.mark.parametrize("height_m", [0.35, 1.0])
def test_only_the_stem_is_below_a_raised_crown(tree_of, height_m) -> None:
    for seed in SEEDS:
        growth = tree_of(12, seed)
        held = growth.metamers.held()
        stem = growth.metamers.axis(0)
        high = [int(i) for i in stem if held["end"][i, 2] >= height_m and held["lateral_child"][i] >= 0]
        safe = {
            int(held["key"][growth.metamers.lateral_child[i]])
            for i in high
            if held["end"][growth.metamers.subtree([int(held["lateral_child"][i])]), 2].min() >= height_m
        }
        stems = set(held["key"][stem].tolist())
        CrownRaise(height_m=height_m).apply(growth)
        after = growth.metamers.held()
        low = np.minimum(after["begin"][:, 2], after["end"][:, 2]) < height_m - 1e-9
        assert set(after["key"][low].tolist()) <= stems
        assert stems | safe <= keys(growth)


def test_both_stems_of_a_fork_stay(tree) -> None:
    known = tree.metamers
    fork = next(int(i) for i in known.axis(0) if known.lateral_child[i] >= 0)
    partner = known.axis(int(known.lateral_child[fork]))
    known.width[known.axis(0)], known.width[partner] = 0.10, 0.09
    keep = known.key[partner].tolist()
    CrownRaise(height_m=1.0).apply(tree)
    assert set(keep) <= keys(tree)
    CrownRaise(height_m=1.0, codominant=0.95).apply(tree)
    assert not set(keep) & keys(tree)


def test_one_side_of_a_crown_can_be_raised(tree) -> None:
    before = keys(tree)
    east = tree.metamers.held()["key"][CrownRaise(height_m=9, azimuth_deg=0, order=1).starts(tree)]
    CrownRaise(height_m=9, azimuth_deg=0, order=1).apply(tree)
    assert len(east)
    assert not set(east.tolist()) & keys(tree)
    assert len(keys(tree)) > len(before) / 3


@pytest.mark.parametrize("shape", ["box", "cylinder", "ellipsoid"])
def test_a_reduced_crown_is_within_the_envelope(tree_of, shape) -> None:
    envelope = Reduce(shape=shape, width_m=0.9, depth_m=0.6, height_m=1.1, base_m=0.3)
    for seed in SEEDS:
        growth = tree_of(12, seed)
        before = growth.metamers.held()
        inside = envelope.holds(before["end"] - before["end"][0])
        within = inside.copy()
        stem = leader(growth.metamers)
        within[stem[before["end"][stem, 2] < 0.85]] = True
        for i in range(1, len(within)):
            within[i] &= within[before["parent"][i]]
        expected = set(before["key"][within].tolist())
        envelope.apply(growth)
        assert keys(growth) == expected
        assert envelope.apply(growth).idle
    points = [[0.0, 0.0, 0.85], [0.46, 0.0, 0.85], [0.0, 0.31, 0.85], [0.0, 0.0, 1.41]]
    assert envelope.holds(np.array(points)).tolist() == [True, False, False, False]
    assert envelope.holds(np.array([[0.44, 0.29, 1.39]])).all() == (shape == "box")


def test_thinning_stays_within_its_share_and_lets_light_in(tree_of) -> None:
    brighter = []
    for seed in SEEDS:
        growth = tree_of(14, seed)
        count = len(growth.metamers) - 1
        lit = growth.light.at_buds(growth.metamers)
        light = dict(zip(growth.metamers.held()["key"].tolist(), lit.terminal, strict=True))
        done = Thin(share=0.2).apply(growth)
        assert 0.1 * count < done.removed <= 0.2 * count
        after = growth.light.at_buds(growth.metamers).terminal
        before = np.array([light[key] for key in growth.metamers.held()["key"].tolist()])
        brighter.append(after.mean() > before.mean())
    assert all(brighter)
