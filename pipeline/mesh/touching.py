"""Rings of one tube that touch each other though others lie between them: compiled, near linear.

Most axes climb: every ring lies wholly beyond all but the one before it, seen along the line from foot to
tip, and that settles it. Where an axis does not, corners are put into a grid, so that each meets only its
neighbours, however many rings there are.
"""

from __future__ import annotations

import math

import numpy as np

from pipeline.geometry.compiled import compiled
from pipeline.mesh.rings import Index, Planes, Rings, left_out, reach
from pipeline.mesh.vector import Vector, dot, length, minus, row, unit
from pipeline.model import Floats

SURE_M = 1e-6
"""So much more than the gap, metres, that rounding cannot matter."""

WIDER = 1.0 + 1e-6
"""Likewise for the cells of the grid."""

PRIME = 1_000_003  # spreads cells over buckets


@compiled
def touching_ring(vertices: Floats, first: Index, rings: Rings, planes: Planes, gap: float) -> int:
    """Return a ring to leave out because a corner of it touches that of a ring farther on; -1 for none.

    Rings next to each other are a gap apart already, and so are rings that lie beyond each other's plane.
    Of several pairs it is the one that begins first, and of those the one that ends first.
    """
    if climbs(rings, planes, gap):
        return -1
    widest = rings.corner * planes.stretch
    last = len(first) - 2
    ring = np.empty(len(vertices), dtype=np.int64)
    for k in range(last + 1):
        ring[first[k] : first[k + 1]] = k
    cell_m = 2.0 * gap * WIDER
    head, after = gridded(vertices, cell_m)
    for low in range(last - 1):
        high = last + 1
        axis = row(planes.axis, low)
        for i in range(first[low], first[low + 1]):
            at = row(vertices, i)
            for side in range(8):
                j = head[bucket(at, cell_m, side, len(head))]
                while j >= 0:
                    if low + 2 <= ring[j] < high and length(minus(at, row(vertices, j))) < gap:
                        step = minus(row(rings.points, ring[j]), row(rings.points, low))
                        near = length(step) < widest[low] + widest[ring[j]] + gap
                        if near and dot(step, axis) < widest[ring[j]] + gap:
                            high = ring[j]
                    j = after[j]
        if high <= last:
            return left_out(low, high, last, rings.spare)
    return -1


@compiled
def climbs(rings: Rings, planes: Planes, gap: float) -> bool:
    """Tell whether every ring clears, by the gap, all those before its neighbour on the way to the tip."""
    foot, last = row(rings.points, 0), len(rings.points) - 1
    way = unit(minus(row(rings.points, last), foot))
    top, neighbour = -math.inf, -math.inf
    for k in range(last + 1):
        height = dot(minus(row(rings.points, k), foot), way)
        half = rings.corner[k] * reach(k, way, planes)
        if height - half < top + gap + SURE_M:
            return False
        top = max(top, neighbour)
        neighbour = height + half
    return True


@compiled
def gridded(vertices: Floats, cell_m: float) -> tuple[Index, Index]:
    """Put corners into buckets by their cells.

    Returns
    -------
    head : (M,) array of int64
        A corner of every bucket, -1 where there is none; M is a power of two.
    after : (C,) array of int64
        The next corner of the same bucket, -1 after the last.
    """
    size = 16
    while size < 2 * len(vertices):
        size *= 2
    head = np.full(size, -1, dtype=np.int64)
    after = np.empty(len(vertices), dtype=np.int64)
    for i in range(len(vertices)):
        home = bucket(row(vertices, i), cell_m, 0, size)
        after[i] = head[home]
        head[home] = i
    return head, after


@compiled
def bucket(at: Vector, cell_m: float, side: int, size: int) -> int:
    """Return the bucket of the cell that a place is in, or of one of the seven next to it.

    Parameters
    ----------
    at : (float, float, float)
    cell_m : float
        What is nearer than half of it lies in one of the eight cells.
    side : int
        Which cell, from 0, that of the place; every bit steps over the nearer wall in one direction.
    size : int
        How many buckets there are, a power of two.
    """
    key = 0
    for k in range(3):
        place = at[k] / cell_m
        cell = math.floor(place)
        if side >> k & 1:
            cell += 1 if place - cell >= 0.5 else -1
        key = key * PRIME + cell
    return (key ^ key >> 29) & (size - 1)
