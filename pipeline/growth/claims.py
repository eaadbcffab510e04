"""Markers go to the nearest bud that sees them."""

from __future__ import annotations

import numpy as np

from pipeline.geometry.compiled import compiled
from pipeline.growth.state import Mask
from pipeline.growth.views import BudPlaces, Met, Space, Views, look
from pipeline.model import Floats, Ints

MOST_KEPT = 20_000_000
"""Rows of what buds see that are kept, a quarter of a gigabyte; buds beyond them look anew every year."""


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
    number = np.zeros(2 * count + 1, dtype=np.int32)
    for b in range(2 * count):
        i, side = b // 2, b % 2
        if not (waits[1][i] if side else waits[0][i]):
            continue
        begin, size = views.start[b], views.size[b]
        if begin < 0:
            views, met, size = look((buds[0][i], buds[2][i] if side else buds[1][i]), space, views, met)
            begin = views.used
            if begin + size <= MOST_KEPT:
                views.start[b], views.size[b] = begin, size
                views = Views(views.marker, views.square, begin + size, views.start, views.size)
        take(b, (begin, size), first, views, met.held, number)
    return number[:-1], views, met


@compiled
def take(bud: int, rows: tuple[int, int], first: int, views: Views, held: Floats, number: Ints) -> None:
    """Give a bud the free markers that it sees and no nearer bud has.

    Without a branch, as it could be foretold for none of them: what is not lost by anybody is taken from the
    last place of `number`, which means nothing.
    """
    got, mine, nobody = 0, float(first + bud), len(number) - 1
    for m in range(rows[0], rows[0] + rows[1]):
        marker, square = views.marker[m], views.square[m]
        had, near = held[marker, 0], held[marker, 1]
        free = had < first
        wins = free | (square < near)
        number[int(had) - first if wins & (not free) else nobody] -= 1
        held[marker, 0] = mine if wins else had
        held[marker, 1] = square if wins else near
        got += int(wins)
    number[bud] += got


@compiled
def middles(
    which: tuple[Ints, Mask], buds: BudPlaces, space: Space, first: int, views: Views, met: Met
) -> Floats:
    """(K, 3) unit vectors to the middle of the markers that some buds have; 0 where they have none."""
    metamer, is_lateral = which
    out = np.zeros((len(metamer), 3))
    for b in range(len(metamer)):
        i = metamer[b]
        bud, ahead = (2 * i + 1, buds[2][i]) if is_lateral[b] else (2 * i, buds[1][i])
        begin, size = views.start[bud], views.size[bud]
        if begin < 0:
            views, met, size = look((buds[0][i], ahead), space, views, met)
            begin = views.used
        for m in range(begin, begin + size):
            marker = views.marker[m]
            if met.held[marker, 0] == first + bud:
                far = np.sqrt(met.held[marker, 1])
                for c in range(3):
                    out[b, c] += (met.place[marker, c] - buds[0][i, c]) / far
        length = np.sqrt((out[b] * out[b]).sum())
        if length > 1e-9:
            out[b] /= length
    return out
