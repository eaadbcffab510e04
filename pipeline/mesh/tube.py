"""Closed tubes along crooked axes: compiled kernels on plain arrays.

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

from typing import NamedTuple

import numpy as np

from pipeline.geometry.compiled import compiled
from pipeline.mesh.rings import (
    Index,
    Rings,
    apart,
    chosen,
    crossing,
    flat_ring,
    ring_corners,
    ring_planes,
    skin,
)
from pipeline.mesh.touching import touching_ring
from pipeline.mesh.vector import put, row
from pipeline.model import Floats, Ints


class Tube(NamedTuple):
    """A closed tube.

    Attributes
    ----------
    kept : (R,) array of int64
        The nodes that carry a ring; empty where no two rings are a gap apart.
    vertices : (V, 3) array of float64
        Ring after ring.
    faces : (F, 3) array of int32
        Counter-clockwise seen from outside; the two ends come last.
    ends : int
        How many faces close the ends.
    """

    kept: Index
    vertices: Floats
    faces: Ints
    ends: int


class Tubes(NamedTuple):
    """Tubes of many axes, one after another.

    Attributes
    ----------
    kept : (R,) array of int64
        The rings that are drawn, of all that were given.
    vertices : (V, 3) array of float64
    faces : (F, 3) array of int32
        Numbers of vertices among all of them; of every tube the ends come last.
    first : (A + 1, 3) array of int64
        Where each tube begins in `kept`, `vertices` and `faces`, and where the last one ends.
    ends : (A,) array of int64
        How many faces close the ends of each.
    """

    kept: Index
    vertices: Floats
    faces: Ints
    first: Index
    ends: Index


class Rules(NamedTuple):
    """What makes a tube a proper solid.

    Attributes
    ----------
    gap : float
        Least distance between rings and between corners.
    mitre : float
        Largest stretch of a ring at a bend, >= 1.
    """

    gap: float
    mitre: float


@compiled
def tube(rings: Rings, rules: Rules) -> Tube:
    """Draw a closed tube, leaving out rings until it is proper.

    Parameters
    ----------
    rings : Rings
        Where some are spare, the tube has to be proper without them.
    rules : Rules

    Returns
    -------
    Tube
    """
    kept = np.arange(len(rings.points)) if rings.spare.any() else apart(rings.points, rules.gap)
    while len(kept) > 1:
        now = chosen(rings, kept)
        planes = ring_planes(now.points, rules.mitre)
        lost = crossing(now, planes, rules.gap)
        if not len(lost):
            first = np.zeros(len(kept) + 1, dtype=np.int64)
            narrow = rules.gap
            for k in range(len(kept)):
                first[k + 1] = first[k] + now.sides[k]
                narrow = min(narrow, now.edge[k])
            vertices = ring_corners(now, planes)
            faces = skin(first)
            one = flat_ring(vertices, faces, first, now, narrow / 3)
            if one < 0:
                one = touching_ring(vertices, first, now, planes, rules.gap)
            if one < 0:
                return Tube(kept, vertices, faces, now.sides[0] + now.sides[-1] - 4)
            lost = np.full(1, one)
        if now.spare.any() and not now.spare[lost].all():
            lost = np.flatnonzero(now.spare)
        stays = np.ones(len(kept), dtype=np.bool_)
        stays[lost] = False
        kept = kept[stays]
    return Tube(kept[:0], np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32), 0)


@compiled
def tubes_around(rings: Rings, first: Index, rules: Rules) -> Tubes:
    """Draw a closed tube along every axis.

    Parameters
    ----------
    rings : Rings
        Of one axis after another.
    first : (A + 1,) array of int64
        Where each axis begins, and where the last one ends.
    rules : Rules

    Returns
    -------
    Tubes
    """
    most = rings.sides.sum()
    kept = np.empty(len(rings.points), dtype=np.int64)
    vertices = np.empty((most, 3))
    faces = np.empty((2 * most, 3), dtype=np.int32)  # a tube has four faces fewer
    starts = np.zeros((len(first), 3), dtype=np.int64)
    ends = np.zeros(len(first) - 1, dtype=np.int64)
    for a in range(len(first) - 1):
        low, high = first[a], first[a + 1]
        own = Rings(
            rings.points[low:high],
            rings.corner[low:high],
            rings.sides[low:high],
            rings.edge[low:high],
            rings.spare[low:high],
        )
        one = tube(own, rules)
        ends[a] = one.ends
        ring, vertex, face = starts[a, 0], starts[a, 1], starts[a, 2]
        for k in range(len(one.kept)):
            kept[ring + k] = low + one.kept[k]
        for k in range(len(one.vertices)):
            put(row(one.vertices, k), vertices, vertex + k)
        for k in range(len(one.faces)):
            for corner in range(3):
                faces[face + k, corner] = vertex + one.faces[k, corner]
        starts[a + 1, 0] = ring + len(one.kept)
        starts[a + 1, 1] = vertex + len(one.vertices)
        starts[a + 1, 2] = face + len(one.faces)
    ring, vertex, face = starts[-1, 0], starts[-1, 1], starts[-1, 2]
    return Tubes(kept[:ring], vertices[:vertex], faces[:face], starts, ends)
