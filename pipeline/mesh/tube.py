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

from typing import NamedTuple

import numpy as np

from pipeline.mesh.rings import (
    Index,
    Rings,
    apart,
    crossing,
    flat_ring,
    ring_corners,
    ring_planes,
    skin,
    touching_ring,
)
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
    plain = not rings.spare.any()
    kept = apart(rings.points, rules.gap) if plain else np.arange(len(rings.points))
    while len(kept) > 1:
        now = Rings(*(column[kept] for column in rings))
        planes = ring_planes(now.points, rules.mitre)
        lost = crossing(now, planes, rules.gap)
        if not len(lost):
            first = np.concatenate([[0], np.cumsum(now.sides)])
            vertices = ring_corners(now, planes)
            faces = skin(first)
            edge = float((2 * now.corner * np.sin(np.pi / now.sides)).min())
            one = flat_ring(vertices, faces, first, now, min(rules.gap, edge) / 3)
            if one < 0:
                one = touching_ring(vertices, first, now, planes, rules.gap)
            if one < 0:
                return Tube(kept, vertices, faces, int(now.sides[0] + now.sides[-1]) - 4)
            lost = np.array([one])
        if now.spare.any() and not now.spare[lost].all():
            lost = np.flatnonzero(now.spare)
        kept = np.delete(kept, lost)
    return Tube(kept[:0], np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32), 0)
