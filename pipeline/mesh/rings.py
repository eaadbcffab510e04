"""Rings along a crooked axis: compiled kernels that place them, and find those that do not fit."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.mesh.vector import across, cross, dot, length, mix, turned, unit
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
    spare : (K,) array of bool
        Rings that go before any other goes.
    """

    points: Floats
    corner: Floats
    sides: Index
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
        if length(mix(1.0, points[i], -1.0, points[kept[count - 1]])) >= gap:
            kept[count] = i
            count += 1
    last = len(points) - 1
    if count > 1:
        kept[count - 1] = last  # the tip lies within the gap of the last one kept
    if count > 2 and length(mix(1.0, points[last], -1.0, points[kept[count - 2]])) < gap:
        kept[count - 2] = last
        count -= 1
    return kept[:count].copy()


@compiled
def ring_planes(points: Floats, mitre: float) -> Planes:
    """Return the plane of every ring.

    The ends lie square to the axis. Where the axis turns right back, the ring stands along it.
    """
    count = len(points)
    axis = np.zeros((count, 3))
    bent = np.zeros((count, 3))
    stretch = np.ones(count)
    before = unit(mix(1.0, points[1], -1.0, points[0]))
    axis[0] = before
    for k in range(1, count - 1):
        after = unit(mix(1.0, points[k + 1], -1.0, points[k]))
        half = mix(0.5, before, 0.5, after)
        share = length(half)  # cosine of half the bend
        axis[k] = unit(half) if share > 1e-6 else across(before)
        if share < 1 - 1e-12:
            bent[k] = unit(mix(1.0, before, -dot(before, axis[k]), axis[k]))
            stretch[k] = 1.0 / share if share * mitre > 1.0 else mitre
        before = after
    axis[count - 1] = before
    return Planes(axis, bent, stretch)


@compiled
def reach(k: int, direction: Floats, planes: Planes) -> float:
    """Return how far ring `k`, an ellipse of corner distance 1, reaches from its centre along `direction`."""
    circle = 1.0 - dot(planes.axis[k], direction) ** 2
    drawn_out = (planes.stretch[k] ** 2 - 1.0) * dot(planes.bent[k], direction) ** 2
    return math.sqrt(max(circle + drawn_out, 0.0))


@compiled
def crossing(rings: Rings, planes: Planes, gap: float) -> Index:
    """Return the rings to leave out because they cut a neighbour; no two of them adjoin."""
    points, corner, axis, stretch = rings.points, rings.corner, planes.axis, planes.stretch
    lost = np.zeros(len(points), dtype=np.int64)
    count = 0
    last = len(points) - 1
    k = 0
    while k < last:
        step = mix(1.0, points[k + 1], -1.0, points[k])
        above = dot(step, axis[k]) - corner[k + 1] * reach(k + 1, axis[k], planes)
        below = dot(step, axis[k + 1]) - corner[k] * reach(k, axis[k + 1], planes)
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
    axis, bent, stretch = planes.axis, planes.bent, planes.stretch
    vertices = np.zeros((sides.sum(), 3))
    placed = 0
    before = axis[0]
    right = across(before)
    for k in range(len(points)):
        right = turned(right, before, axis[k])
        ahead = cross(axis[k], right)
        for i in range(sides[k]):
            turn = 2 * math.pi * i / sides[k]
            arm = mix(math.cos(turn), right, math.sin(turn), ahead)
            arm = mix(1.0, arm, (stretch[k] - 1.0) * dot(bent[k], arm), bent[k])
            vertices[placed] = mix(1.0, points[k], corner[k], arm)
            placed += 1
        if k < len(points) - 1:
            before = unit(mix(1.0, points[k + 1], -1.0, points[k]))
            right = turned(right, axis[k], before)
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
                faces[count] = (low, a + i % na, high)
            else:
                j += 1
                faces[count] = (low, b + j % nb, high)
            count += 1
    for k in (0, rings - 1):
        low, high = first[k], first[k + 1] - 1
        from_low = True
        while high - low > 1:  # a strip across the end, from side to side
            middle = low + 1 if from_low else high - 1
            if k == 0:
                faces[count] = (low, high, middle)
            else:
                faces[count] = (low, middle, high)
            low, high = (middle, high) if from_low else (low, middle)
            from_low = not from_low
            count += 1
    return faces


@compiled
def flat_ring(vertices: Floats, faces: Ints, first: Index, rings: Rings, flat: float) -> int:
    """Return a ring to leave out because a triangle narrower than `flat` joins it to another; -1 for none."""
    last = len(first) - 2
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        low = np.searchsorted(first, min(a, b, c), side="right") - 1
        if max(a, b, c) < first[low + 1]:
            continue  # within the end
        u = mix(1.0, vertices[b], -1.0, vertices[a])
        v = mix(1.0, vertices[c], -1.0, vertices[a])
        longest = max(length(u), length(v), length(mix(1.0, u, -1.0, v)))
        if length(cross(u, v)) < flat * longest:
            return left_out(low, low + 1, last, rings.spare)
    return -1


@compiled
def touching_ring(vertices: Floats, first: Index, rings: Rings, planes: Planes, gap: float) -> int:
    """Return a ring to leave out because a corner of it touches that of a ring farther on; -1 for none.

    Rings next to each other are a gap apart already, and so are rings that lie beyond each other's plane.
    """
    points, axis = rings.points, planes.axis
    widest = rings.corner * planes.stretch
    last = len(points) - 1
    for low in range(last + 1):
        for high in range(low + 2, last + 1):
            step = mix(1.0, points[high], -1.0, points[low])
            near = length(step) < widest[low] + widest[high] + gap
            if not near or dot(step, axis[low]) >= widest[high] + gap:
                continue
            for i in range(first[low], first[low + 1]):
                for j in range(first[high], first[high + 1]):
                    if length(mix(1.0, vertices[i], -1.0, vertices[j])) < gap:
                        return left_out(low, high, last, rings.spare)
    return -1


@compiled
def left_out(low: int, high: int, last: int, spare: Flags) -> int:
    """Return which of two rings to leave out: an added one, else the later, but never the tip."""
    if spare[low] != spare[high]:
        return low if spare[low] else high
    return low if high == last and low > 0 else high
