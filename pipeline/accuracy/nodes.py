"""Pairs of nodes of two skeletons: by number, by shape, else by place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.spatial import cKDTree

from pipeline.model import Skeleton

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
MatchedBy = Literal["order", "structure", "nearest"]


@dataclass(frozen=True, eq=False)
class Pairs:
    """Which node of B stands for every node of A.

    Parameters
    ----------
    by : {"order", "structure", "nearest"}
    partner : (N,) array of int
    distance : (N,) array
        Metres.
    """

    by: MatchedBy
    partner: Ints
    distance: Floats


def pairs_of_nodes(a: Skeleton, b: Skeleton, shift: Floats | None = None) -> Pairs:
    """Pair the nodes of two skeletons.

    Parameters
    ----------
    a, b : Skeleton
        With the same parents, nodes of the same number are pairs. Where the trees have the same shape
        and other numbers, they are walked down together; children of the same shape go with the
        one that leaves in the most similar way. Else every node of A goes with the nearest of B.
    shift : (3,) array, optional
        Added to the coordinates of A.

    Returns
    -------
    Pairs
    """
    here = a.world + (0.0 if shift is None else shift)
    by: MatchedBy = "order"
    if np.array_equal(a.parent, b.parent):
        partner = np.arange(len(a))
    elif (found := _by_structure(a, b)) is not None:
        by, partner = "structure", found
    else:
        by, partner = "nearest", cKDTree(b.world).query(here)[1].astype(np.int64)
    return Pairs(by, partner, np.asarray(np.linalg.norm(here - b.world[partner], axis=1)))


def _by_structure(a: Skeleton, b: Skeleton) -> Ints | None:
    """Walk down two trees of one shape together; None where their shapes differ.

    References
    ----------
    Aho, Hopcroft and Ullman (1974), The Design and Analysis of Computer Algorithms, example 3.2: a
    number for every shape of a subtree.
    """
    known: dict[tuple[int, ...], int] = {}
    shape_a, shape_b = _shapes(a, known), _shapes(b, known)
    if len(a) != len(b) or shape_a[0] != shape_b[0]:
        return None
    way_a, way_b = _ways(a), _ways(b)
    partner = np.zeros(len(a), dtype=np.int64)
    waiting = [(0, 0)]
    while waiting:
        i, j = waiting.pop()
        partner[i] = j
        alike: dict[int, tuple[list[int], list[int]]] = {}
        for c in a.children[i]:
            alike.setdefault(shape_a[c], ([], []))[0].append(c)
        for c in b.children[j]:
            alike[shape_b[c]][1].append(c)
        for mine, theirs in alike.values():
            waiting += _paired(mine, theirs, way_a, way_b)
    return partner


def _shapes(graph: Skeleton, known: dict[tuple[int, ...], int]) -> list[int]:
    """Number the shape of the subtree at every node; the same shape has the same number."""
    shape = [0] * len(graph)
    for i in range(len(graph) - 1, -1, -1):
        below = tuple(sorted(shape[c] for c in graph.children[i]))
        shape[i] = known.setdefault(below, len(known))
    return shape


def _ways(graph: Skeleton) -> Floats:
    """(N, 3) step from the parent to every node."""
    return np.asarray(graph.xyz - graph.xyz[np.maximum(graph.parent, 0)])


def _paired(mine: list[int], theirs: list[int], way_a: Floats, way_b: Floats) -> list[tuple[int, int]]:
    """Pair children of one shape so that their ways differ least in sum."""
    if len(mine) == 1:
        return [(mine[0], theirs[0])]
    gap = np.linalg.norm(way_a[mine][:, None] - way_b[theirs][None], axis=2)
    rows, columns = linear_sum_assignment(gap)
    return [(mine[r], theirs[c]) for r, c in zip(rows.tolist(), columns.tolist(), strict=True)]
