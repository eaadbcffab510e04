"""What buds see of the markers: worked out once for each, as a bud stands still until it grows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.growth.bound import Limits, is_within
from pipeline.growth.columns import Point, Space, Span, columns, judge
from pipeline.growth.jitter import START, placed
from pipeline.growth.lattice import Counts, Voxels
from pipeline.growth.state import Mask
from pipeline.model import Floats, Ints

BudPlaces = tuple[Floats, Floats, Floats]  # where buds are, the ways of terminal and of lateral ones

FREE, TAKEN = (0.0, 0.0), (np.inf, -1.0)
"""What `Met.held` has of a marker that is nobody's, and of one that wood has: no bud is nearer to that."""
BLOCKED = 1 << 24
"""Metamers that a marker counts around it where no tree may grow: it is never free."""
CLOSED = -1
"""What the grid holds of a marker that nobody has met, and that neighbours or a building take."""
FIRST_ROOM = 4096
MOST_DEEP = 256
"""More cells than a column has that a bud sees."""


class Met(NamedTuple):
    """The markers met so far, numbered as they were met: those near each other lie together.

    The grid has the number of the marker of every cell, 0 (or `CLOSED`) where none has been met.

    Attributes
    ----------
    place : (R, 3) array
        Where the markers are, metres.
    held : (R, 2) array
        The bud that has each, counted on from year to year, and its squared distance.
    taken : (R,) array of int32
        How many metamers are too near for it to be free.
    known : int
        Rows that mean something; the first does not.
    """

    place: Floats
    held: Floats
    taken: Counts
    known: int


class Views(NamedTuple):
    """The markers that each bud sees, in the order of their cells.

    Attributes
    ----------
    marker : (R,) array of int32
        Numbers of markers.
    square : (R,) array
        Squared distances, metres.
    used : int
        Rows that mean something.
    start, size : (2 N,) arrays of int64
        Where in these rows the markers of each bud are: of the terminal and the lateral bud of every metamer
        in turn. A start of -1 tells that they are not known.
    """

    marker: Ints
    square: Floats
    used: int
    start: NDArray[np.int64]
    size: NDArray[np.int64]


def none_met() -> Met:
    """Return no markers."""
    room = FIRST_ROOM
    return Met(np.zeros((room, 3)), np.zeros((room, 2)), np.zeros(room, dtype=np.int32), 1)


def none_seen() -> Views:
    """Return the views of no bud."""
    nothing = np.zeros(0, dtype=np.int64)
    return Views(np.zeros(FIRST_ROOM, dtype=np.int32), np.zeros(FIRST_ROOM), 0, nothing, nothing)


@compiled
def kept(views: Views, before: BudPlaces, now: BudPlaces, waits: tuple[Mask, Mask]) -> Views:
    """Keep what buds that wait see, where they are as before; metamers keep their order as some go and come.

    Rows of other buds are closed up once they are more than the others.
    """
    count, had = len(now[0]), len(before[0])
    start, size = np.full(2 * count, -1, dtype=np.int64), np.zeros(2 * count, dtype=np.int64)
    live, old = 0, 0
    for i in range(count):
        while old < had and not is_same(before, old, now, i):
            old += 1
        if old == had:
            break
        for side in range(2):
            waiting = waits[1][i] if side else waits[0][i]
            if waiting and views.start[2 * old + side] >= 0:
                start[2 * i + side] = views.start[2 * old + side]
                size[2 * i + side] = views.size[2 * old + side]
                live += size[2 * i + side]
        old += 1
    if views.used <= 2 * live + FIRST_ROOM:
        return Views(views.marker, views.square, views.used, start, size)
    marker, square = np.empty(2 * live + FIRST_ROOM, dtype=np.int32), np.empty(2 * live + FIRST_ROOM)
    used = 0
    for b in range(2 * count):
        if start[b] >= 0:
            marker[used : used + size[b]] = views.marker[start[b] : start[b] + size[b]]
            square[used : used + size[b]] = views.square[start[b] : start[b] + size[b]]
            start[b] = used
            used += size[b]
    return Views(marker, square, used, start, size)


@compiled
def is_same(before: BudPlaces, old: int, now: BudPlaces, new: int) -> bool:
    """Whether a metamer's buds are where another's were, and look the same way."""
    for c in range(3):
        if (
            before[0][old, c] != now[0][new, c]
            or before[1][old, c] != now[1][new, c]
            or before[2][old, c] != now[2][new, c]
        ):
            return False
    return True


@compiled
def look(
    which: Voxels, most: int, buds: BudPlaces, space: Space, seen: tuple[Views, Met]
) -> tuple[Views, Met]:
    """Write the markers in the cones of some buds behind the rows that are used, up to as many as `most`.

    Buds that no room is left for stay unknown.
    """
    (views, met), cone = seen, space[1]
    (ends, directions, lateral), start, sizes, end, known = (
        buds,
        views.start,
        views.size,
        views.used,
        met.known,
    )
    for bud in which:
        if end > most:
            break
        b, way = bud // 2, lateral if bud % 2 else directions
        at, ahead = (ends[b, 0], ends[b, 1], ends[b, 2]), (way[b, 0], way[b, 1], way[b, 2])
        n, span = columns(at, ahead, cone, space)
        most_seen = n * (span[1] - span[0] + 1)
        if end + most_seen > len(views.marker):
            views = with_rows(views, end, most_seen)
        if known + most_seen > len(met.taken):
            met = with_room(met, known, most_seen)
        judge(n, span, (at, ahead), cone, space)
        start[bud] = end
        end, known = settle(n, (end, known), span, space, views, met)
        sizes[bud] = end - start[bud]
    views = Views(views.marker, views.square, end, start, sizes)
    return views, Met(met.place, met.held, met.taken, known)


@compiled
def settle(
    n: int, rows: tuple[int, int], span: Span, space: Space, views: Views, met: Met
) -> tuple[int, int]:
    """Write those of `n` columns of markers that are seen, column by column, from a row on.

    `rows` are the first of them that is free among what buds see, and among what has been met; returned is
    which are so then. No tuple of arrays is made, which takes longer than the work.
    """
    (cells, _, size, _), _, limits, (chances, x, y, cell, square, is_seen) = space
    (marker, far, _, _, _), (places, held, taken, _), (end, known) = views, met, rows
    deep = span[1] - span[0] + 1
    numbers, last = cells.reshape(-1), end
    for c in range(n):
        for k in range(deep):  # what is not seen is written over by the next: that is quicker than to ask
            marker[last], far[last] = c * MOST_DEEP + k, square[k, c]
            last += is_seen[k, c]
    for row in range(end, last):
        c, k = marker[row] // MOST_DEEP, marker[row] % MOST_DEEP
        here = cell[c] + k
        if numbers[here] <= 0:
            u, v, w = placed(chances[c] + np.uint64(span[0] + k), x[c], y[c], span[0] + k + START, size)
            places[known, 0], places[known, 1], places[known, 2] = u, v, w
            taken[known] = taken_at_first(numbers[here], (u, v, w), limits)
            held[known, 0], held[known, 1] = TAKEN if taken[known] else FREE
            numbers[here] = known
            known += 1
        marker[row] = numbers[here]
    return last, known


@compiled
def taken_at_first(was: int, at: Point, limits: Limits) -> int:
    """Return what a marker counts when it is met, by what the grid had: `BLOCKED` where no tree may grow."""
    return 0 if was != CLOSED and is_within(at, limits) else BLOCKED


@compiled
def with_rows(views: Views, used: int, more: int) -> Views:
    """Lengthen the rows of what buds see so that `more` fit behind those used."""
    room = 2 * len(views.marker) + more
    marker, square = np.empty(room, dtype=np.int32), np.empty(room)
    marker[:used], square[:used] = views.marker[:used], views.square[:used]
    return Views(marker, square, used, views.start, views.size)


@compiled
def with_room(met: Met, known: int, more: int) -> Met:
    """Lengthen the rows of markers so that `more` fit behind those known."""
    room = 2 * len(met.taken) + more
    place, held, taken = np.empty((room, 3)), np.empty((room, 2)), np.empty(room, dtype=np.int32)
    place[:known], held[:known], taken[:known] = met.place[:known], met.held[:known], met.taken[:known]
    return Met(place, held, taken, known)
