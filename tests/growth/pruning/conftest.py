"""Trees to prune: small ones, grown once, copied for every test."""

from __future__ import annotations

import copy
from functools import cache

import numpy as np
import pytest

from pipeline.growth import Growth, GrowthOptions, grow
from pipeline.growth.pruning.operation import leader

OPTIONS = GrowthOptions()
SEEDS = range(30)


@cache
def _grown(years: int, seed: int) -> Growth:
    return grow(OPTIONS, years, seed=seed)


@pytest.fixture
def tree_of():
    """Return a function that gives a tree of some years and a seed; changing it changes no other."""
    return lambda years, seed=0: copy.deepcopy(_grown(years, seed))


@pytest.fixture(params=[8, 12])
def tree(request, tree_of):
    """A tree of 8 or 12 years."""
    return tree_of(request.param)


def check_whole(growth: Growth) -> None:
    """Fail unless the indices agree with each other, and the light with the wood."""
    tree, count = growth.metamers, len(growth.metamers)
    held = tree.held()
    above = np.arange(1, count)
    parent = held["parent"][1:]
    assert (parent < above).all()
    assert (parent >= 0).all()
    child = np.where(held["is_lateral"][1:], held["lateral_child"][parent], held["terminal_child"][parent])
    np.testing.assert_array_equal(child, above)
    for bud, grown in (("terminal_bud", "terminal_child"), ("lateral_bud", "lateral_child")):
        np.testing.assert_array_equal(held[bud] == 1, held[grown] >= 0)
    np.testing.assert_array_equal(held["begin"][1:], held["end"][parent])
    fresh = Growth(copy.deepcopy(tree), growth.options, seed=growth.seed)
    one, other = growth.light.at_buds(tree), fresh.light.at_buds(tree)
    for mine, expected in zip(one, other, strict=True):
        np.testing.assert_array_equal(mine, expected)


def row_of(growth: Growth, key: int) -> int:
    """Return where the metamer of a key stands now."""
    return int(np.flatnonzero(growth.metamers.held()["key"] == key)[0])


def chord(growth: Growth, base: int, steps: int = 3) -> np.ndarray:
    """(3,) unit vector from the end of a metamer to that of the one some steps on, past cuts."""
    path = leader(growth.metamers, base)
    step = growth.metamers.end[path[steps]] - growth.metamers.end[base]
    return step / np.linalg.norm(step)


def branches_of(growth: Growth) -> list[int]:
    """Return the side branches of the stem, from the base up."""
    tree = growth.metamers
    return [int(tree.lateral_child[i]) for i in tree.axis(0) if tree.lateral_child[i] >= 0]
