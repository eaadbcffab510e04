"""Where markers of free space stand: one in every cell of a grid, off its middle by chance."""

from __future__ import annotations

import numpy as np

from pipeline.geometry.compiled import compiled
from pipeline.growth.chance import scramble
from pipeline.growth.lattice import Counts, Voxels

Grid = tuple[Counts, Voxels, float, np.uint64]  # numbers of markers, lowest cell, size of a cell, seed

LOW_BITS, BITS, TWICE_BITS = np.uint64(0x1FFFFF), np.uint64(21), np.uint64(42)
JITTER = 0.4
"""Most that a marker stands off the middle of its cell, in cells along each axis."""
FARTHEST = JITTER * 3.0**0.5
"""Most that it is off in all, in cells."""
ROUNDING = 1e-9
"""Share of a cell by which rounding may err."""
START, SCALE = 0.5 - JITTER, 2.0 * JITTER / float(LOW_BITS)
"""Lowest place of a marker in its cell, and a step of its chances, in cells."""


@compiled
def marker(i: int, j: int, k: int, size: float, seed: np.uint64) -> tuple[float, float, float]:
    """Return where the marker of a cell is, metres."""
    return marker_in(column(i, j, seed), i, j, k, size)


@compiled
def column(i: int, j: int, seed: np.uint64) -> np.uint64:
    """Return the chances of a column of cells, which loops over its cells need but once."""
    return scramble(scramble(seed + np.uint64(i)) + np.uint64(j))


@compiled
def marker_in(chances: np.uint64, i: int, j: int, k: int, size: float) -> tuple[float, float, float]:
    """Return where the marker of a cell of a column is, metres."""
    return placed(chances + np.uint64(k), i + START, j + START, k + START, size)


@compiled
def placed(chances: np.uint64, x: float, y: float, z: float, size: float) -> tuple[float, float, float]:
    """Return where the marker with these chances is, metres; x, y, z is its lowest place, in cells."""
    bits = scramble(chances)
    a, b, c = bits & LOW_BITS, (bits >> BITS) & LOW_BITS, (bits >> TWICE_BITS) & LOW_BITS
    return (x + SCALE * float(a)) * size, (y + SCALE * float(b)) * size, (z + SCALE * float(c)) * size
