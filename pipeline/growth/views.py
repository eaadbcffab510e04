"""What buds see of the markers: worked out once for each, as a bud stands still until it grows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.growth.jitter import FARTHEST, ROUNDING, Grid, column, marker, marker_in
from pipeline.growth.lattice import Counts
from pipeline.growth.state import Mask
from pipeline.model import Floats, Ints

BudPlaces = tuple[Floats, Floats, Floats]  # where buds are, the ways of terminal and of lateral ones
Place = tuple[Floats, Floats]  # where a bud is, and its way
Cone = tuple[float, float]  # how far it sees, and the cosine of half its angle
Space = tuple[Grid, Cone]
Box = tuple[NDArray[np.int64], NDArray[np.int64]]  # first and last cells along each axis

FREE, TAKEN = (0.0, 0.0), (np.inf, -1.0)
"""What `Met.held` has of a marker that is nobody's, and of one that wood has: no bud is nearer to that."""
FIRST_ROOM = 4096


class Met(NamedTuple):
    """The markers that a bud has seen so far, numbered as they were met: those near each other lie together.

    Attributes
    ----------
    number : (I, J, K) array of int32
        Of every cell of the box the number of its marker, 0 where none has been met.
    place : (R, 3) array
        Where the markers are, metres.
    held : (R, 2) array
        The bud that has each, counted on from year to year, and its squared distance.
    known : int
        Rows that mean something; the first does not.
    """

    number: Counts
    place: Floats
    held: Floats
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


def none_met(number: Counts) -> Met:
    """Return no markers."""
    return Met(number, np.zeros((FIRST_ROOM, 3)), np.zeros((FIRST_ROOM, 2)), 1)


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
def look(place: Place, space: Space, views: Views, met: Met) -> tuple[Views, Met, int]:
    """Write the markers in a bud's cone behind the rows that are used; with them, how many they are."""
    grid, cone = space
    _, low, size, seed = grid
    _, wide, deep = grid[0].shape
    first, last = cells_ahead(place, size, cone)
    room = (last[0] - first[0] + 1) * (last[1] - first[1] + 1) * (last[2] - first[2] + 1)
    views, met = with_room(views, met, room)
    seen, square = views.marker[views.used :], views.square[views.used :]
    found = in_cone(place, space, (first, last), (seen, square))
    number, values, count = met.number.reshape(-1), grid[0].reshape(-1), met.known
    for m in range(found):
        cell = seen[m]
        if number[cell] == 0:
            number[cell] = count
            met.held[count, 0], met.held[count, 1] = TAKEN if values[cell] else FREE
            i, j, k = cell // (wide * deep), cell // deep % wide, cell % deep
            u, v, w = marker(i + low[0], j + low[1], k + low[2], size, seed)
            met.place[count, 0], met.place[count, 1], met.place[count, 2] = u, v, w
            count += 1
        seen[m] = number[cell]
    return views, Met(met.number, met.place, met.held, count), found


@compiled
def in_cone(place: Place, space: Space, box: Box, found: tuple[Ints, Floats]) -> int:
    """Write the cells whose markers are in a cone, and the squared distances; how many they are.

    What does not count is written over by the next: that is quicker than to ask.
    """
    (values, low, size, seed), cone = space
    (first, last), (seen, square) = box, found
    x, y, z, p, q, r = place[0][0], place[0][1], place[0][2], place[1][0], place[1][1], place[1][2]
    sight, half = cone[0] * cone[0], cone[1]
    reach = (cone[0] + (FARTHEST + ROUNDING) * size) ** 2
    count = 0
    for i in range(first[0], last[0] + 1):
        for j in range(first[1], last[1] + 1):
            if ((i + 0.5) * size - x) ** 2 + ((j + 0.5) * size - y) ** 2 > reach:
                continue
            chances = column(i, j, seed)
            start = ((i - low[0]) * values.shape[1] + j - low[1]) * values.shape[2] - low[2]
            for k in range(first[2], last[2] + 1):
                u, v, w = marker_in(chances, i, j, k, size)
                u, v, w = u - x, v - y, w - z
                far = u * u + v * v + w * w
                seen[count], square[count] = start + k, far
                count += int((far < sight) & (u * p + v * q + w * r >= half * np.sqrt(far)))
    return count


@compiled
def with_room(views: Views, met: Met, more: int) -> tuple[Views, Met]:
    """Lengthen the rows so that `more` fit."""
    room, used = len(views.marker), views.used
    if used + more >= room:
        marker, square = np.empty(2 * room + more, dtype=np.int32), np.empty(2 * room + more)
        marker[:used], square[:used] = views.marker[:used], views.square[:used]
        views = Views(marker, square, used, views.start, views.size)
    room, count = len(met.place), met.known
    if count + more >= room:
        place, held = np.empty((2 * room + more, 3)), np.empty((2 * room + more, 2))
        place[:count], held[:count] = met.place[:count], met.held[:count]
        met = Met(met.number, place, held, count)
    return views, met


@compiled
def cells_ahead(place: Place, size: float, cone: Cone) -> Box:
    """Return the first and last cells along each axis that a bud's cone can touch."""
    at, ahead = place
    radius, along = cone
    across = np.sqrt(max(1.0 - along * along, 0.0))
    first, last = np.zeros(3, dtype=np.int64), np.zeros(3, dtype=np.int64)
    for c in range(3):
        flat = np.sqrt(max(1.0 - ahead[c] * ahead[c], 0.0)) * across
        up = radius if ahead[c] >= along else max(radius * (ahead[c] * along + flat), 0.0)
        down = radius if -ahead[c] >= along else max(radius * (flat - ahead[c] * along), 0.0)
        first[c] = int(np.floor((at[c] - down - ROUNDING * size) / size))
        last[c] = int(np.floor((at[c] + up + ROUNDING * size) / size))
    return first, last
