"""Greedy growth: all points join a stem one by one, the one that costs least first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.skeleton.stem import Stem

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Grown = tuple[Floats, Ints, Floats, NDArray[np.bool_]]  # nodes, parents, link lengths, is a point

AHEAD = 3.0  # spacings over which the direction of a branch is taken
SAME_M = 0.001  # a point this near to a node is there already
STEPS = 20  # places on a link where others may join, at most


def grown(points: Floats, stem: Stem, spacing: float, costs: tuple[float, float]) -> Grown:
    """Let all points join the stem.

    Parameters
    ----------
    points : (P, 3) array
        Off the stem, metres.
    stem : Stem
    spacing : float
        Of the points, metres.
    costs : tuple of float
        Of a metre of way to the root, and of a metre of link at a right angle.
    """
    first = len(stem.xyz)
    room = first + STEPS * len(points)
    xyz, parent = np.empty((room, 3)), np.full(room, -1, dtype=np.int64)
    way, link, is_point = np.zeros(room), np.zeros(room), np.zeros(room, dtype=bool)
    xyz[:first], parent[:first] = stem.xyz, np.arange(first) - 1
    way[:first] = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(stem.xyz, axis=0), axis=1))])
    count = _grow(points, first, (spacing, AHEAD * spacing), costs, (xyz, parent, way, link, is_point))
    return xyz[:count], parent[:count], link[:count], is_point[:count]


@compiled
def _grow(
    points: Floats,
    first: int,
    lengths: tuple[float, float],
    costs: tuple[float, float],
    tree: tuple[Floats, Ints, Floats, Floats, NDArray[np.bool_]],
) -> int:
    """Let the points join, the cheapest first; ties fall to the earlier point and node."""
    xyz, parent, way, link, is_point = tree
    step, ahead = lengths
    heading = np.zeros_like(xyz)
    best, via = np.full(len(points), np.inf), np.full(len(points), -1, dtype=np.int64)
    waiting = np.arange(len(points))
    left, done, count = len(points), 0, first
    for q in range(first):
        _head(q, ahead, xyz, parent, way, heading)
    while left > 0:
        for q in range(done, count):
            _offer(q, points, waiting[:left], costs, (xyz, way, heading), (best, via))
        done, at = count, 0
        for u in range(1, left):
            i, j = waiting[u], waiting[at]
            if best[i] < best[j] or (best[i] == best[j] and i < j):
                at = u
        point, left = waiting[at], left - 1
        waiting[at] = waiting[left]
        q = via[point]
        gap = np.sqrt(((points[point] - xyz[q]) ** 2).sum())
        if gap < SAME_M:
            continue
        pieces = min(max(int(np.ceil(gap / step)), 1), STEPS)
        for k in range(1, pieces + 1):
            xyz[count] = xyz[q] + (points[point] - xyz[q]) * (k / pieces)
            parent[count] = q if k == 1 else count - 1
            way[count], link[count] = way[q] + gap * k / pieces, gap
            _head(count, ahead, xyz, parent, way, heading)
            count += 1
        is_point[count - 1] = True
    return count


@compiled
def _offer(
    q: int,
    points: Floats,
    waiting: Ints,
    costs: tuple[float, float],
    tree: tuple[Floats, Floats, Floats],
    offers: tuple[Floats, Ints],
) -> None:
    """Let node `q` offer itself to every waiting point."""
    xyz, way, heading = tree
    best, via = offers
    base = costs[0] * way[q]
    for i in waiting:
        rest = best[i] - base
        if rest <= 0.0:
            continue
        x, y, z = points[i, 0] - xyz[q, 0], points[i, 1] - xyz[q, 1], points[i, 2] - xyz[q, 2]
        square = x * x + y * y + z * z
        if square * square * square >= rest * rest * rest * rest:  # d^1.5 alone is too much
            continue
        d = np.sqrt(square)
        along = x * heading[q, 0] + y * heading[q, 1] + z * heading[q, 2]
        cost = d * np.sqrt(d) + costs[1] * (d - along) + base
        if cost < best[i]:
            best[i], via[i] = cost, q


@compiled
def _head(i: int, ahead: float, xyz: Floats, parent: Ints, way: Floats, heading: Floats) -> None:
    """Direction of the last `ahead` metres of the way to node `i`; up at the root."""
    back = i
    while parent[back] >= 0 and way[i] - way[back] < ahead:
        back = parent[back]
    run = xyz[i] - xyz[back]
    norm = np.sqrt((run * run).sum())
    if norm > 0.0:
        heading[i] = run / norm
    elif parent[i] >= 0:
        heading[i] = heading[parent[i]]
    else:
        heading[i, 2] = 1.0
