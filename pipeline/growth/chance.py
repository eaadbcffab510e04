"""Chances that depend on a place in the tree or in space alone, never on what was asked before."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.growth.state import Mask, Metamers
from pipeline.model import Ints

Keys = NDArray[np.uint64]

GOLDEN = np.uint64(0x9E3779B97F4A7C15)
ONE, TWO = np.uint64(1), np.uint64(2)
FIRST, SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
RIGHT = (np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11))
"""Steps of splitmix64 (Steele, Lea & Flood 2014)."""


@compiled
def scramble(key: np.uint64) -> np.uint64:
    """Return the next number of splitmix64."""
    z = key + GOLDEN
    z = (z ^ (z >> RIGHT[0])) * FIRST
    z = (z ^ (z >> RIGHT[1])) * SECOND
    return z ^ (z >> RIGHT[2])


@compiled
def lineage(key: np.uint64, is_lateral: bool) -> np.uint64:
    """Return the key of the metamer that a bud becomes."""
    return scramble(key ^ scramble(TWO if is_lateral else ONE))


@compiled
def chance(key: np.uint64, which: int) -> float:
    """Return one of the chances of a key, evenly between -1 and 1."""
    z = scramble(key + np.uint64(which + 3) * FIRST)
    return float(z >> RIGHT[3]) / 4503599627370496.0 - 1.0


@compiled
def pass_on(key: Keys, parent: Ints, is_lateral: Mask) -> None:
    """Give every metamer the key that follows from the foot's."""
    for i in range(1, len(parent)):
        key[i] = lineage(key[parent[i]], is_lateral[i])


def sow(tree: Metamers, seed: int) -> None:
    """Give all metamers the chances of a seed."""
    tree.key[0] = scramble(np.uint64(seed & 0xFFFFFFFFFFFFFFFF))
    pass_on(tree.key, tree.parent[: len(tree)], tree.is_lateral[: len(tree)])
