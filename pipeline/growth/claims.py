"""Markers go to the nearest bud that sees them."""

from __future__ import annotations

import numpy as np

from pipeline.geometry.compiled import compiled
from pipeline.growth.columns import Space
from pipeline.growth.state import Mask
from pipeline.growth.views import BudPlaces, Met, Views, look
from pipeline.model import Floats, Ints

MOST_KEPT = 20_000_000
"""Rows of what buds see that are kept, a quarter of a gigabyte; buds beyond them look anew every year."""
ALL = 1 << 62
"""More rows than there can be."""


@compiled
def claim(
    space: Space, buds: BudPlaces, waits: tuple[Mask, Mask], first: int, views: Views, met: Met
) -> tuple[Ints, Views, Met]:
    """Let the nearest bud that sees a free marker have it; of two as near, the first.

    Buds are numbered from `first` on, more than in any earlier year: what is left from those means nobody, so
    that nothing need be wiped. Returns the number of markers of the terminal and the lateral bud of every
    metamer in turn; and what they see, and the markers.
    """
    count = len(buds[0])
    number, waiting = np.zeros(2 * count + 1, dtype=np.int32), np.zeros(2 * count, dtype=np.bool_)
    waiting[::2], waiting[1::2] = waits
    views, met = look(np.flatnonzero(waiting & (views.start < 0)), MOST_KEPT, buds, space, (views, met))
    bud = take((0, 2 * count), waiting, first, views, met.held, number)
    while bud < 2 * count:
        used = views.used
        views, met = look(np.full(1, bud), ALL, buds, space, (views, met))
        take((bud, bud + 1), waiting, first, views, met.held, number)
        views.start[bud] = -1
        views = Views(views.marker, views.square, used, views.start, views.size)
        bud = take((bud + 1, 2 * count), waiting, first, views, met.held, number)
    return number[:-1], views, met


@compiled
def take(buds: tuple[int, int], waiting: Mask, first: int, views: Views, held: Floats, number: Ints) -> int:
    """Give buds, from one up to another, the free markers that they see and no nearer bud has.

    Stops before a bud of which is not known what it sees, and tells it. Without a branch for a marker, as it
    could be foretold for none of them: what is not lost by anybody is taken from the last place of `number`,
    which means nothing.
    """
    markers, squares, start, size = views.marker, views.square, views.start, views.size
    nobody = len(number) - 1
    for bud in range(buds[0], buds[1]):
        if not waiting[bud]:
            continue
        if start[bud] < 0:
            return bud
        got, mine = 0, float(first + bud)
        for m in range(start[bud], start[bud] + size[bud]):
            marker, square = markers[m], squares[m]
            had, near = held[marker, 0], held[marker, 1]
            free = had < first
            wins = free | (square < near)
            number[int(had) - first if wins & (not free) else nobody] -= 1
            held[marker, 0] = mine if wins else had
            held[marker, 1] = square if wins else near
            got += int(wins)
        number[bud] += got
    return buds[1]


@compiled
def middles(
    which: tuple[Ints, Mask], buds: BudPlaces, space: Space, first: int, views: Views, met: Met
) -> Floats:
    """(K, 3) unit vectors to the middle of the markers that some buds have; 0 where they have none."""
    metamer, is_lateral = which
    out = np.zeros((len(metamer), 3))
    for b in range(len(metamer)):
        bud, at, used = 2 * metamer[b] + int(is_lateral[b]), buds[0][metamer[b]], views.used
        is_new = views.start[bud] < 0
        if is_new:
            views, met = look(np.full(1, bud), ALL, buds, space, (views, met))
        rows = slice(views.start[bud], views.start[bud] + views.size[bud])
        add_ways(views.marker[rows], float(first + bud), at, met, out[b])
        if is_new:
            views.start[bud] = -1
            views = Views(views.marker, views.square, used, views.start, views.size)
    return out


@compiled
def add_ways(markers: Ints, bud: float, at: Floats, met: Met, out: Floats) -> None:
    """Write the unit vector to the middle of those markers that a bud has."""
    held, place = met.held, met.place
    for marker in markers:
        if held[marker, 0] == bud:
            far = np.sqrt(held[marker, 1])
            for c in range(3):
                out[c] += (place[marker, c] - at[c]) / far
    length = np.sqrt((out * out).sum())
    if length > 1e-9:
        out /= length
