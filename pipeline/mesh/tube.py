"""One closed tube along one crooked axis: compiled kernels on plain arrays.

The axis is a row of nodes; every node carries a ring of corners. An inner ring lies in the plane
that halves the bend of the axis and is drawn out to a mitre joint. Frames go from segment to
segment by the smallest rotation, so that the tube does not twist [1]_.

Two rules keep the tube a proper solid. A ring must lie wholly above the plane of the ring before it
and wholly below that of the ring after it; a ring that does not is left out. And no two corners may
lie closer than the gap, nor may a triangle between two rings be narrower than a third of it. Only
where the axis folds back on itself over more than its own thickness do rings stay that break the
first rule: there the tube passes through itself, as its axis does.

References
----------
.. [1] Bishop, R. L. (1975). There is more than one way to frame a curve. The American Mathematical
   Monthly 82(3), 246-251. On a polyline the frame without twist is the smallest rotation at each bend.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.mesh.vector import across, cross, dot, length, mix, turned, unit
from pipeline.model import Floats, Ints

Index = NDArray[np.int64]


def tube(points: Floats, corner: Floats, sides: Index, gap: float, mitre: float) -> tuple[Floats, Ints]:
    """Draw a closed tube through `points`.

    Parameters
    ----------
    points : (K, 3) array of float64
        Axis from foot to tip.
    corner : (K,) array of float64
        Distance of the corners from the axis, > 0.
    sides : (K,) array of int64
        Corners of each ring, >= 3.
    gap : float
        Least distance between rings and between corners.
    mitre : float
        Largest stretch of a ring at a bend, >= 1.

    Returns
    -------
    vertices : (V, 3) array of float64
        Ring after ring.
    faces : (F, 3) array of int32
        Counter-clockwise seen from outside. Both are empty where no two rings are a gap apart.
    """
    kept = apart(points, gap)
    points, corner, sides = points[kept], corner[kept], sides[kept]
    while len(points) > 1:
        axis, bent, stretch = ring_planes(points, mitre)
        lost = crossing(points, corner, axis, bent, stretch, gap)
        if not len(lost):
            first = np.concatenate([[0], np.cumsum(sides)])
            vertices = ring_corners(points, corner, sides, axis, bent, stretch)
            faces = skin(first)
            edge = float((2 * corner * np.sin(np.pi / sides)).min())
            one = flat_ring(vertices, faces, first, min(gap, edge) / 3)
            if one < 0:
                one = touching_ring(vertices, first, points, axis, corner * stretch, gap)
            if one < 0:
                return vertices, faces
            lost = np.array([one])
        stays = np.delete(np.arange(len(points)), lost)
        points, corner, sides = points[stays], corner[stays], sides[stays]
    return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)


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
def ring_planes(points: Floats, mitre: float) -> tuple[Floats, Floats, Floats]:
    """Return of every ring its unit normal, the direction in which it is drawn out, and how much.

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
    return axis, bent, stretch


@compiled
def reach(k: int, direction: Floats, axis: Floats, bent: Floats, stretch: Floats) -> float:
    """Return how far ring `k`, an ellipse of corner distance 1, reaches from its centre along `direction`."""
    circle = 1.0 - dot(axis[k], direction) ** 2
    drawn_out = (stretch[k] ** 2 - 1.0) * dot(bent[k], direction) ** 2
    return math.sqrt(max(circle + drawn_out, 0.0))


@compiled
def crossing(
    points: Floats, corner: Floats, axis: Floats, bent: Floats, stretch: Floats, gap: float
) -> Index:
    """Return the rings to leave out because they cut a neighbour; no two of them adjoin."""
    lost = np.zeros(len(points), dtype=np.int64)
    count = 0
    last = len(points) - 1
    k = 0
    while k < last:
        step = mix(1.0, points[k + 1], -1.0, points[k])
        above = dot(step, axis[k]) - corner[k + 1] * reach(k + 1, axis[k], axis, bent, stretch)
        below = dot(step, axis[k + 1]) - corner[k] * reach(k, axis[k + 1], axis, bent, stretch)
        folded = length(step) >= corner[k] * stretch[k] + corner[k + 1] * stretch[k + 1] + gap
        if min(above, below) < gap and not folded:
            worst = k + 1
            if k > 0 and (k + 1 == last or stretch[k] > stretch[k + 1]):
                worst = k
            lost[count] = worst
            count += 1
            k = worst + 1
        k += 1
    return lost[:count].copy()


@compiled
def ring_corners(
    points: Floats, corner: Floats, sides: Index, axis: Floats, bent: Floats, stretch: Floats
) -> Floats:
    """Place the corners of every ring, counter-clockwise about its axis."""
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
def flat_ring(vertices: Floats, faces: Ints, first: Index, flat: float) -> int:
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
            return left_out(low, low + 1, last)
    return -1


@compiled
def touching_ring(
    vertices: Floats, first: Index, points: Floats, axis: Floats, widest: Floats, gap: float
) -> int:
    """Return a ring to leave out because a corner of it touches that of a ring farther on; -1 for none.

    Rings next to each other are a gap apart already, and so are rings that lie beyond each other's plane.
    """
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
                        return left_out(low, high, last)
    return -1


@compiled
def left_out(low: int, high: int, last: int) -> int:
    """Return which of two rings to leave out: the later, but the earlier if the later is the tip."""
    return low if high == last and low > 0 else high
