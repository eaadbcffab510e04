"""Columns of cells whose markers are judged, many at a time: how far they are, and whether in a cone."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.growth.bound import Limits
from pipeline.growth.jitter import FARTHEST, ROUNDING, START, Grid, column, placed
from pipeline.growth.state import Mask
from pipeline.model import Floats, Ints

Point = tuple[float, float, float]
Span = tuple[int, int]  # first and last cell
Cone = tuple[float, float]  # how far a bud sees, and the cosine of half its angle

LANES = 16
"""What the number of columns is filled up to that are judged at once: machines take several."""


class Batch(NamedTuple):
    """Columns of markers about to be judged; all have as many cells.

    Attributes
    ----------
    chances : (C,) array of uint64
        `jitter.column` of each, and on by one from cell to cell.
    x, y : (C,) arrays
        The lowest place that its markers can have, in cells.
    cell : (C,) array of int32
        Its first cell.
    square : (K, C) array
        Squared distances of the markers, metres.
    is_seen : (K, C) array of bool
    """

    chances: NDArray[np.uint64]
    x: Floats
    y: Floats
    cell: Ints
    square: Floats
    is_seen: Mask


Space = tuple[Grid, Cone, Limits, Batch]


def no_batch(reach: float) -> Batch:
    """Return room for the columns of markers within a reach, in cells."""
    deep = 2 * int(np.ceil(reach)) + 3
    room = (deep * deep // LANES + 1) * LANES
    x, y = np.zeros((2, room))
    chances, cell = np.zeros(room, dtype=np.uint64), np.zeros(room, dtype=np.int32)
    return Batch(chances, x, y, cell, np.zeros((deep, room)), np.zeros((deep, room), dtype=bool))


@compiled
def columns(at: Point, ahead: Point, cone: Cone, space: Space) -> tuple[int, Span]:
    """Lay out the columns of cells that a cone can touch; how many, and their first and last cell."""
    (cells, low, size, seed), _, _, (chances, x, y, cell, _, _) = space
    wide, deep = cells.shape[1], cells.shape[2]
    i0, i1 = cells_ahead(at[0], ahead[0], size, cone)
    j0, j1 = cells_ahead(at[1], ahead[1], size, cone)
    span = cells_ahead(at[2], ahead[2], size, cone)
    reach = (cone[0] + (FARTHEST + ROUNDING) * size) ** 2
    n = 0
    for i in range(i0, i1 + 1):
        for j in range(j0, j1 + 1):
            if ((i + 0.5) * size - at[0]) ** 2 + ((j + 0.5) * size - at[1]) ** 2 > reach:
                continue
            chances[n], x[n], y[n] = column(i, j, seed), i + START, j + START
            cell[n] = ((i - low[0]) * wide + j - low[1]) * deep + span[0] - low[2]
            n += 1
    return n, span


@compiled
def judge(n: int, span: Span, bud: tuple[Point, Point], cone: Cone, space: Space) -> None:
    """Work out how far the markers of `n` columns are from a bud, and whether they are in its cone.

    Nothing in the inner loop hangs on what came before, so that machines take several markers at a time.
    """
    (at, ahead), (radius, half), (_, _, size, _) = bud, cone, space[0]
    chances, x, y, _, squares, seen = space[3]
    for k in range(span[0], span[1] + 1):
        square, is_seen = squares[k - span[0]], seen[k - span[0]]
        for c in range((n + LANES - 1) // LANES * LANES):
            u, v, w = placed(chances[c] + np.uint64(k), x[c], y[c], k + START, size)
            u, v, w = u - at[0], v - at[1], w - at[2]
            far = u * u + v * v + w * w
            square[c] = far
            is_seen[c] = (far < radius * radius) & (
                u * ahead[0] + v * ahead[1] + w * ahead[2] >= half * np.sqrt(far)
            )


@compiled
def cells_ahead(at: float, ahead: float, size: float, cone: Cone) -> Span:
    """Return the first and last cell along an axis that a cone can touch, by where it begins and goes."""
    radius, along = cone
    flat = np.sqrt(max(1.0 - ahead * ahead, 0.0)) * np.sqrt(max(1.0 - along * along, 0.0))
    up = radius if ahead >= along else max(radius * (ahead * along + flat), 0.0)
    down = radius if -ahead >= along else max(radius * (flat - ahead * along), 0.0)
    return (
        int(np.floor((at - down - ROUNDING * size) / size)),
        int(np.floor((at + up + ROUNDING * size) / size)),
    )
