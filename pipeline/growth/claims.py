"""Markers go to the nearest bud that sees them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.growth.jitter import JITTER, Grid, marker
from pipeline.growth.state import Mask
from pipeline.model import Floats, Ints

BudPlaces = tuple[Floats, Floats, Floats]  # where buds are, the ways of terminal and of lateral ones
Claims = tuple[Ints, Floats, Ints]
"""The bud that has each marker, its squared distance (0 where none is free), and the markers of each bud."""
Place = tuple[Floats, Floats]  # where a bud is, and its way

FARTHEST = JITTER * 3.0**0.5
"""Most that a marker is off the middle of its cell, in cells."""
ROUNDING = 1e-9
"""Share of a cell by which rounding may err."""


@compiled
def claim(
    grid: Grid, buds: BudPlaces, waits: tuple[Mask, Mask], cone: tuple[float, float]
) -> tuple[Ints, Floats]:
    """Let the nearest bud that sees a free marker have it.

    Returns the number of markers and the unit vector to their middle, of the terminal and the lateral bud of
    every metamer in turn.
    """
    values = grid[0]
    owner = np.full(values.shape, -1, dtype=np.int32)
    nearest = np.where(values == 0, cone[0] * cone[0], 0.0)
    count = len(buds[0])
    number, way = np.zeros(2 * count, dtype=np.int32), np.zeros((2 * count, 3))
    for i in range(count):
        if waits[0][i]:
            look(2 * i, (buds[0][i], buds[1][i]), grid, cone, (owner, nearest, number))
        if waits[1][i]:
            look(2 * i + 1, (buds[0][i], buds[2][i]), grid, cone, (owner, nearest, number))
    for b in range(2 * count):
        if number[b] == 0:
            continue
        collect(b, (buds[0][b // 2], buds[1 + b % 2][b // 2]), grid, cone, (owner, nearest, number), way[b])
        size = np.sqrt((way[b] * way[b]).sum())
        if size > 1e-9:
            way[b] /= size
    return number, way


@compiled
def cells_ahead(
    place: Place, size: float, cone: tuple[float, float]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
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


@compiled
def look(bud: int, place: Place, grid: Grid, cone: tuple[float, float], claims: Claims) -> None:
    """Give a bud the free markers in its cone that no nearer bud has.

    Where a cell's middle is too far off for any marker of the cell, its own is not worked out.
    """
    _, low, size, seed = grid
    owner, nearest, number = claims
    (x, y, z), ahead = place
    first, last = cells_ahead(place, size, cone)
    off = (FARTHEST + ROUNDING) * size
    for i in range(first[0], last[0] + 1):
        for j in range(first[1], last[1] + 1):
            for k in range(first[2], last[2] + 1):
                a, b, c = i - low[0], j - low[1], k - low[2]
                least = nearest[a, b, c]
                if least == 0.0:
                    continue
                u, v, w = (i + 0.5) * size - x, (j + 0.5) * size - y, (k + 0.5) * size - z
                far = np.sqrt(u * u + v * v + w * w) - off
                if far > 0.0 and far * far >= least:
                    continue
                if u * ahead[0] + v * ahead[1] + w * ahead[2] + off < cone[1] * far:
                    continue
                u, v, w = marker(i, j, k, size, seed)
                u, v, w = u - x, v - y, w - z
                square = u * u + v * v + w * w
                if square >= least:
                    continue
                if u * ahead[0] + v * ahead[1] + w * ahead[2] >= cone[1] * np.sqrt(square):
                    if owner[a, b, c] >= 0:
                        number[owner[a, b, c]] -= 1
                    nearest[a, b, c], owner[a, b, c] = square, bud
                    number[bud] += 1


@compiled
def collect(
    bud: int, place: Place, grid: Grid, cone: tuple[float, float], claims: Claims, way: Floats
) -> None:
    """Add up the unit vectors to the markers that are a bud's in the end."""
    _, low, size, seed = grid
    owner, nearest, number = claims
    x, y, z = place[0]
    first, last = cells_ahead(place, size, cone)
    left = number[bud]
    for i in range(first[0], last[0] + 1):
        for j in range(first[1], last[1] + 1):
            for k in range(first[2], last[2] + 1):
                a, b, c = i - low[0], j - low[1], k - low[2]
                if owner[a, b, c] == bud:
                    u, v, w = marker(i, j, k, size, seed)
                    far = np.sqrt(nearest[a, b, c])
                    way[0] += (u - x) / far
                    way[1] += (v - y) / far
                    way[2] += (w - z) / far
                    left -= 1
                    if left == 0:
                        return
