"""What stands in the scene: lines along axes, a cylinder around every segment, points, near one zero."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Floats, Skeleton, TreeModel

Index = NDArray[np.int64]

SIDES = 8
"""Of a cylinder; thin ones have half as many."""

THIN_M = 0.01
THINNEST_M = 0.002
"""Twigs are drawn at least so thick, lest they break up into dots."""

MOST_POINTS = 300_000
"""Points that a browser draws at ease; of more, every second or third, ... is shown."""


class Shape(NamedTuple):
    """Triangles or lines.

    Attributes
    ----------
    vertices : (V, 3) array
        Metres from the zero.
    cells : (C, 2) or (C, 3) array of int
        Ends of lines, or corners of triangles.
    segment : (V,) array of int
        The segment that a vertex belongs to: one less than its node.
    normals : (V, 3) array or None
    """

    vertices: Floats
    cells: Index
    segment: Index
    normals: Floats | None = None


def zero_of(graph: Skeleton) -> Floats:
    """Return a zero beside a tree, so near that the float32 of graphics keeps a tenth of a millimetre."""
    return np.asarray(np.floor(graph.world[0]))


def axes(graph: Skeleton, zero: Floats) -> Shape:
    """Return a line along every segment."""
    world = graph.world - zero
    count = len(graph) - 1
    ends = np.stack([world[graph.parent[1:]], world[1:]], axis=1).reshape(-1, 3)
    return Shape(ends, np.arange(2 * count).reshape(-1, 2), np.repeat(np.arange(count), 2))


def cylinders(tree: TreeModel, zero: Floats) -> Shape:
    """Return a tapered, open cylinder around every segment.

    Every one has corners of its own, so that each can have its own colour; its normals make it round.
    """
    graph, radius = tree.skeleton, np.maximum(tree.radius[1:], THINNEST_M)
    world = graph.world - zero
    start, end = world[graph.parent[1:]], world[1:]
    first = np.maximum(tree.start_radius[1:], THINNEST_M)
    thin = np.maximum(first, radius) < THIN_M
    parts = [
        _cylinders(np.flatnonzero(which), (start, end, first, radius), sides)
        for which, sides in ((~thin, SIDES), (thin, SIDES // 2))
    ]
    return Shape(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([parts[0].cells, parts[1].cells + len(parts[0].vertices)]),
        np.concatenate([part.segment for part in parts]),
        np.concatenate([part.normals for part in parts if part.normals is not None]),
    )


def _cylinders(which: Index, ends: tuple[Floats, Floats, Floats, Floats], sides: int) -> Shape:
    """Return cylinders of so many sides around some of the segments; those without length are left out."""
    start, end, first, last = (values[which] for values in ends)
    length = np.linalg.norm(end - start, axis=1)
    held = length > 0
    which, start, end, first, last = (values[held] for values in (which, start, end, first, last))
    axis = (end - start) / length[held, None]
    right = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis), axis=1)])
    right /= np.linalg.norm(right, axis=1)[:, None]
    ahead = np.cross(axis, right)
    turn = 2 * np.pi / sides * np.arange(sides)
    arm = np.cos(turn)[:, None] * right[:, None] + np.sin(turn)[:, None] * ahead[:, None]
    rings = np.stack(
        [start[:, None] + first[:, None, None] * arm, end[:, None] + last[:, None, None] * arm], axis=1
    )
    corner, after = np.arange(sides), (np.arange(sides) + 1) % sides
    skin = np.concatenate(
        [
            np.column_stack([corner, after, after + sides]),
            np.column_stack([corner, after + sides, corner + sides]),
        ]
    )
    cells = (2 * sides * np.arange(len(which)))[:, None, None] + skin
    return Shape(
        rings.reshape(-1, 3),
        cells.reshape(-1, 3),
        np.repeat(which, 2 * sides),
        np.repeat(arm[:, None], 2, axis=1).reshape(-1, 3),
    )


def evenly(count: int, most: int = MOST_POINTS) -> Index:
    """Return at most so many of the numbers below `count`, evenly."""
    return np.arange(count) if count <= most else np.linspace(0, count - 1, most).astype(np.int64)


def shares(counts: list[int], most: int = MOST_POINTS) -> list[int]:
    """Return how many of each kind of points are shown, so that all together are at most `most`.

    Examples
    --------
    >>> shares([600_000, 200_000, 0])
    [225000, 75000, 0]
    >>> shares([10, 20])
    [10, 20]
    """
    total = sum(counts)
    return list(counts) if total <= most else [count * most // total for count in counts]
