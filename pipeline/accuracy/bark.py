"""The nearest bark to every point, exactly: a tree of boxes over tapered segments.

The distance to a segment is that to its axis less the radius at the foot of the perpendicular, so a
segment is a tube with round ends. `pipeline.geometry.surface` finds the same for nearly every point
in less time; a measure of accuracy must not have a share of it from looking things up.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.geometry.surface import Nearest, Tubes

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAF = 4
"""A box with so few segments is not divided."""


class Boxes(NamedTuple):
    """A balanced tree of boxes: the halves of box i are the boxes 2 i + 1 and 2 i + 2.

    Attributes
    ----------
    item : (M,) array of int
        Segments in the order of the boxes.
    first, stop : (K,) arrays of int
        The part of `item` in each box.
    low, high : (K, 3) arrays
        Corners of the box around the axes.
    radius : (K,) array
        Largest radius in it.
    """

    item: Ints
    first: Ints
    stop: Ints
    low: Floats
    high: Floats
    radius: Floats


def nearest_bark(xyz: Floats, tubes: Tubes) -> Nearest:
    """Find the nearest tube surface to every point; of equals that of the smallest segment.

    Parameters
    ----------
    xyz : (P, 3) array
        Points in metres.
    tubes : Tubes
        One segment at least.
    """
    ends = (tubes.start, tubes.end, tubes.start_radius, tubes.end_radius)
    ends = tuple(np.ascontiguousarray(values, dtype=np.float64) for values in ends)  # type: ignore[assignment]  # still four
    points = np.ascontiguousarray(xyz, dtype=np.float64)
    return Nearest(*_nearest(points, ends, _boxes(tubes)))


def _boxes(tubes: Tubes) -> Boxes:
    """Halve the segments by the widest side of their box until few are left in each."""
    low, high = np.minimum(tubes.start, tubes.end), np.maximum(tubes.start, tubes.end)
    middle = (low + high) / 2
    thick = np.maximum(tubes.start_radius, tubes.end_radius)
    depth = max(0, int(np.ceil(np.log2(len(middle) / LEAF))))
    count = 2 ** (depth + 1) - 1
    item = np.arange(len(middle))
    first, stop = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    lows, highs, radius = np.full((count, 3), np.inf), np.full((count, 3), -np.inf), np.zeros(count)
    stop[0] = len(middle)
    for i in range(count):
        held = item[first[i] : stop[i]]
        if not len(held):
            continue
        lows[i], highs[i], radius[i] = low[held].min(axis=0), high[held].max(axis=0), thick[held].max()
        if 2 * i + 2 < count:
            axis = int(np.argmax(highs[i] - lows[i]))
            item[first[i] : stop[i]] = held[np.argsort(middle[held, axis], kind="stable")]
            half = (first[i] + stop[i]) // 2
            first[2 * i + 1], stop[2 * i + 1] = first[i], half
            first[2 * i + 2], stop[2 * i + 2] = half, stop[i]
    return Boxes(item, first, stop, lows, highs, radius)


@compiled
def _nearest(
    xyz: Floats, ends: tuple[Floats, Floats, Floats, Floats], boxes: Boxes
) -> tuple[Ints, Floats, Floats, Floats]:
    """Go down the tree of boxes for every point, the nearer half first."""
    start, end, start_radius, end_radius = ends
    segment = np.full(len(xyz), -1, dtype=np.int64)
    share, axial, surface = np.zeros(len(xyz)), np.zeros(len(xyz)), np.full(len(xyz), np.inf)
    waiting = np.zeros(128, dtype=np.int64)
    for i in range(len(xyz)):
        waiting[0] = 0
        count = 1
        while count > 0:
            count -= 1
            box = waiting[count]
            if _least(xyz[i], box, boxes) > abs(surface[i]):
                continue
            if 2 * box + 2 < len(boxes.first):
                near, far = 2 * box + 1, 2 * box + 2
                if _least(xyz[i], near, boxes) > _least(xyz[i], far, boxes):
                    near, far = far, near
                waiting[count], waiting[count + 1] = far, near
                count += 2
                continue
            for k in range(boxes.first[box], boxes.stop[box]):
                c = boxes.item[k]
                square, dot = 0.0, 0.0
                for d in range(3):
                    along = end[c, d] - start[c, d]
                    square += along * along
                    dot += along * (xyz[i, d] - start[c, d])
                t = min(max(dot / square, 0.0), 1.0) if square > 0.0 else 0.0
                away = 0.0
                for d in range(3):
                    away += (xyz[i, d] - start[c, d] - t * (end[c, d] - start[c, d])) ** 2
                away = np.sqrt(away)
                off = away - (start_radius[c] + t * (end_radius[c] - start_radius[c]))
                if abs(off) < abs(surface[i]) or (abs(off) == abs(surface[i]) and c < segment[i]):
                    segment[i], share[i], axial[i], surface[i] = c, t, away, off
    return segment, share, axial, surface


@compiled
def _least(point: Floats, box: int, boxes: Boxes) -> float:
    """Return what the distance to any bark in a box cannot fall below."""
    square = 0.0
    for d in range(3):
        out = max(boxes.low[box, d] - point[d], point[d] - boxes.high[box, d], 0.0)
        square += out * out
    return float(np.sqrt(square) - boxes.radius[box])
