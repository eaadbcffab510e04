"""A branch that is cut to a bud goes where the bud looks; below the cut nothing changes."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.growth import DAMAGED, DORMANT, Metamers
from pipeline.growth.pruning import FacingBud, Outward
from pipeline.growth.pruning.facing import facing_bud, outward
from tests.growth.pruning.conftest import SEEDS, branches_of, chord, row_of

DOWN = np.array([0.0, 0.0, -1.0])
FIELDS = ("begin", "end", "direction", "lateral_bud_direction", "birth_year")


def straight_branch(buds) -> Metamers:
    """Return a stem of one metamer that bears a level branch along x whose buds look the given ways."""
    tree = Metamers.one_bud()
    tree.make_room(10)
    for i, side in enumerate([(0, 0, 1), *buds], start=1):
        above = i > 1
        tree.begin[i], tree.end[i] = [
            (i - 2, 0, 1) if above else (0, 0, 0),
            (i - 1, 0, 1) if above else (0, 0, 1),
        ]
        tree.direction[i] = (1, 0, 0) if above else (0, 0, 1)
        tree.parent[i], tree.is_lateral[i] = i - 1, i == 2
        tree.terminal_child[i] = tree.lateral_child[i] = -1
        tree.terminal_bud[i] = tree.lateral_bud[i] = DORMANT
        tree.lateral_bud_direction[i] = np.array(side) / np.linalg.norm(side)
        (tree.lateral_child if i == 2 else tree.terminal_child)[i - 1] = i
    tree.count = len(buds) + 2
    return tree


def test_the_bud_nearest_the_middle_is_chosen_that_looks_down() -> None:
    up, down = (1, 0, 1), (1, 0, -1)
    assert facing_bud(straight_branch([down, down, down, down, down, down]), 2, DOWN) == 4
    assert facing_bud(straight_branch([down, up, up, up, up, down]), 2, DOWN) == 2
    assert facing_bud(straight_branch([down, up, up, down, up, down]), 2, DOWN) == 5
    assert facing_bud(straight_branch([up, up, up, up, up, down]), 2, DOWN) is None
    tree = straight_branch([down, down, down, down, down, down])
    tree.lateral_bud[4] = DAMAGED
    assert facing_bud(tree, 2, DOWN) == 3


def regrown(growth, operation, way):
    """Return the chords beyond the cut of the longest branch, uncut and cut, three years on, in degrees."""
    tree = growth[0].metamers
    branch = max(branches_of(growth[0]), key=lambda start: (len(tree.axis(start)), -start))
    key = int(tree.key[facing_bud(tree, branch, way(tree, branch))])
    towards = way(tree, branch)
    tip = tuple(tree.end[tree.axis(branch)[-1]])
    below = tree.axis(branch)[: list(tree.key[tree.axis(branch)]).index(key) + 1]
    held = {name: getattr(tree, name)[below].copy() for name in FIELDS}
    kept = tree.key[below].tolist()
    operation(position=tip, within_m=0.01).apply(growth[1])
    for _ in range(3):
        for one in growth:
            one.grow_year()
    cut = growth[1].metamers
    rows = [row_of(growth[1], int(k)) for k in kept]
    for name, values in held.items():
        assert getattr(cut, name)[rows].tobytes() == values.tobytes(), name
    angle = [float(np.degrees(np.arccos(np.clip(chord(g, row_of(g, key)) @ towards, -1, 1)))) for g in growth]
    return angle[0] - angle[1]


def test_a_branch_goes_lower_from_a_bud_that_looks_down(tree_of) -> None:
    gain = [regrown([tree_of(10, s), tree_of(10, s)], FacingBud, lambda *_: DOWN) for s in SEEDS]
    assert np.mean(np.array(gain) > 0) >= 0.95
    assert 8 <= np.mean(gain) <= 25


def test_a_branch_goes_outward_from_a_bud_that_looks_outward(tree_of) -> None:
    gain = [regrown([tree_of(12, s), tree_of(12, s)], Outward, outward) for s in SEEDS]
    assert np.mean(gain) > 0
    assert np.mean(np.array(gain) > 0) >= 0.8


def test_outward_is_level_and_away_from_the_stem(tree) -> None:
    for branch in branches_of(tree):
        way = outward(tree.metamers, branch)
        middle = tree.metamers.end[tree.metamers.axis(branch)[len(tree.metamers.axis(branch)) // 2]]
        assert way[2] == 0
        assert np.linalg.norm(way) == pytest.approx(1)
        assert way @ (middle - tree.metamers.end[0]) > 0
