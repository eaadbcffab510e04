"""Rings along a crooked axis: compiled kernels that place them, and find those that do not fit."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.mesh.vector import Vector, across, cross, dot, length, minus, mix, put, row, turned, unit
from pipeline.model import Floats, Ints

Index = NDArray[np.int64]
Flags = NDArray[np.bool_]


class Rings(NamedTuple):
    """Where rings stand, how wide and how many-sided they are.

    Attributes
    ----------
    points : (K, 3) array of float64
        Axis from foot to tip.
    corner : (K,) array of float64
        Distance of the corners from the axis, > 0.
    sides : (K,) array of int64
        Corners of each ring, >= 3.
    edge : (K,) array of float64
        Length of a side.
    spare : (K,) array of bool
        Rings that go before any other goes.
    """

    points: Floats
    corner: Floats
    sides: Index
    edge: Floats
    spare: Flags


class Planes(NamedTuple):
    """How rings lie: unit normals, the directions in which they are drawn out, and how much."""

    axis: Floats
    bent: Floats
    stretch: Floats


@compiled
def apart(points: Floats, gap: float) -> Index:
    """Return the nodes that are at least `gap` from the one before; the tip stays rather than its like."""
    kept = np.zeros(len(points), dtype=np.int64)
    count = 1
    for i in range(1, len(points)):
        if length(minus(row(points, i), row(points, kept[count - 1]))) >= gap:
            kept[count] = i
            count += 1
    last = len(points) - 1
    if count > 1:
        kept[count - 1] = last  # the tip lies within the gap of the last one kept
    if count > 2 and length(minus(row(points, last), row(points, kept[count - 2]))) < gap:
        kept[count - 2] = last
        count -= 1
    return kept[:count].copy()


@compiled
def chosen(rings: Rings, kept: Index) -> Rings:
    """Return those rings alone."""
    return Rings(
        rings.points[kept], rings.corner[kept], rings.sides[kept], rings.edge[kept], rings.spare[kept]
    )


@compiled
def ring_planes(points: Floats, mitre: float) -> Planes:
    """Return the plane of every ring.

    The ends lie square to the axis. Where the axis turns right back, the ring stands along it.
    """
    count = len(points)
    axis = np.zeros((count, 3))
    bent = np.zeros((count, 3))
    stretch = np.ones(count)
    before = unit(minus(row(points, 1), row(points, 0)))
    put(before, axis, 0)
    for k in range(1, count - 1):
        after = unit(minus(row(points, k + 1), row(points, k)))
        half = mix(0.5, before, 0.5, after)
        share = length(half)  # cosine of half the bend
        middle = unit(half) if share > 1e-6 else across(before)
        put(middle, axis, k)
        if share < 1 - 1e-12:
            put(unit(mix(1.0, before, -dot(before, middle), middle)), bent, k)
            stretch[k] = 1.0 / share if share * mitre > 1.0 else mitre
        before = after
    put(before, axis, count - 1)
    return Planes(axis, bent, stretch)


@compiled
def reach(k: int, direction: Vector, planes: Planes) -> float:
    """Return how far ring `k`, an ellipse of corner distance 1, reaches from its centre along `direction`."""
    circle = 1.0 - dot(row(planes.axis, k), direction) ** 2
    drawn_out = (planes.stretch[k] ** 2 - 1.0) * dot(row(planes.bent, k), direction) ** 2
    return math.sqrt(max(circle + drawn_out, 0.0))


@compiled
def crossing(rings: Rings, planes: Planes, gap: float) -> Index:
    """Return the rings to leave out because they cut a neighbour; no two of them adjoin."""
    points, corner, stretch = rings.points, rings.corner, planes.stretch
    lost = np.zeros(len(points), dtype=np.int64)
    count = 0
    last = len(points) - 1
    k = 0
    while k < last:
        step = minus(row(points, k + 1), row(points, k))
        low, high = row(planes.axis, k), row(planes.axis, k + 1)
        above = dot(step, low) - corner[k + 1] * reach(k + 1, low, planes)
        below = dot(step, high) - corner[k] * reach(k, high, planes)
        folded = length(step) >= corner[k] * stretch[k] + corner[k + 1] * stretch[k + 1] + gap
        if min(above, below) < gap and not folded:
            worst = k + 1
            if k > 0 and (k + 1 == last or stretch[k] > stretch[k + 1]):
                worst = k
            if rings.spare[k] != rings.spare[k + 1]:
                worst = k if rings.spare[k] else k + 1
            lost[count] = worst
            count += 1
            k = worst + 1
        k += 1
    return lost[:count].copy()


@compiled
def ring_corners(rings: Rings, planes: Planes) -> Floats:
    """Place the corners of every ring, counter-clockwise about its axis."""
    points, corner, sides = rings.points, rings.corner, rings.sides
    total, most, many = 0, 0, 0
    for count in sides:
        total, most = total + count, max(most, count)
    vertices, circle = np.empty((total, 3)), np.empty((most, 2))
    placed = 0
    before = row(planes.axis, 0)
    right = across(before)
    for k in range(len(points)):
        if sides[k] != many:
            many = sides[k]
            for i in range(many):
                turn = 2 * math.pi * i / many
                circle[i, 0], circle[i, 1] = math.cos(turn), math.sin(turn)
        centre, axis, bent = row(points, k), row(planes.axis, k), row(planes.bent, k)
        right = turned(right, before, axis)
        ahead = cross(axis, right)
        for i in range(many):
            arm = mix(circle[i, 0], right, circle[i, 1], ahead)
            arm = mix(1.0, arm, (planes.stretch[k] - 1.0) * dot(bent, arm), bent)
            put(mix(1.0, centre, corner[k], arm), vertices, placed)
            placed += 1
        if k < len(points) - 1:
            before = unit(minus(row(points, k + 1), centre))
            right = turned(right, axis, before)
    return vertices


@compiled
def skin(first: Index) -> Ints:
    """Join the rings by triangles and close both ends."""
    rings = len(first) - 1
    ends = first[1] + first[rings] - first[rings - 1] - 4
    faces = np.zeros(
        (ends + 2 * first[rings] - first[1] - (first[rings] - first[rings - 1]), 3), dtype=np.int32
    )
    count = 0
    for k in range(rings - 1):
        a, b = first[k], first[k + 1]
        na, nb = b - a, first[k + 2] - b
        i, j = 0, 0
        while i < na or j < nb:  # go round both rings, always on with the one that lags
            low, high = a + i % na, b + j % nb
            if j == nb or (i < na and (i + 1) * nb <= (j + 1) * na):
                i += 1
                triangle(low, a + i % na, high, faces, count)
            else:
                j += 1
                triangle(low, b + j % nb, high, faces, count)
            count += 1
    for k in (0, rings - 1):
        low, high = first[k], first[k + 1] - 1
        from_low = True
        while high - low > 1:  # a strip across the end, from side to side
            middle = low + 1 if from_low else high - 1
            if k == 0:
                triangle(low, high, middle, faces, count)
            else:
                triangle(low, middle, high, faces, count)
            low, high = (middle, high) if from_low else (low, middle)
            from_low = not from_low
            count += 1
    return faces


@compiled
def triangle(a: int, b: int, c: int, faces: Ints, f: int) -> None:
    """Make three corners face `f`."""
    faces[f, 0], faces[f, 1], faces[f, 2] = a, b, c


@compiled
def flat_ring(vertices: Floats, faces: Ints, first: Index, rings: Rings, flat: float) -> int:
    """Return a ring to leave out because a triangle narrower than `flat` joins it to another; -1 for none."""
    last = len(first) - 2
    f = 0
    for low in range(last):
        for _ in range(first[low + 2] - first[low]):  # so many faces join two rings
            corner = row(vertices, faces[f, 0])
            u = minus(row(vertices, faces[f, 1]), corner)
            v = minus(row(vertices, faces[f, 2]), corner)
            longest = max(length(u), length(v), length(minus(u, v)))
            if length(cross(u, v)) < flat * longest:
                return left_out(low, low + 1, last, rings.spare)
            f += 1
    return -1


@compiled
def left_out(low: int, high: int, last: int, spare: Flags) -> int:
    """Return which of two rings to leave out: an added one, else the later, but never the tip."""
    if spare[low] != spare[high]:
        return low if spare[low] else high
    return low if high == last and low > 0 else high
