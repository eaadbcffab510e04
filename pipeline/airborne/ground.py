"""The terrain under an airborne cloud, and how high every point stands above it.

Ground points make the mean height of every cell; an empty cell takes its height from the blocks of
2, 4, 8, 16 cells round about that hold some. Where no point is classed as ground for a block and its
neighbours, a filter looks for ground among the lowest points. Heights are whole steps, so the terrain
is the same in every window that holds a cell and what lies within its reach.

References
----------
Pingel, T. J., Clarke, K. C. & McBride, W. A. (2013). An improved simple morphological filter for the
terrain classification of airborne LIDAR data. ISPRS J. Photogramm. 77, 21-30. Changed: windows double
instead of growing by a cell, empty cells take no part instead of being filled beforehand.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pipeline.airborne.raster import LEVELS, STEPS, Grid, Ints, Mask, Raster
from pipeline.geometry.compiled import compiled
from pipeline.model import Floats

GROUND = 2
NONE = np.iinfo(np.int64).max
OPENINGS = (1, 2, 4, 8)  # half widths of the filter's windows, in cells of 1 m
SLOPE = 0.3  # rise over run that the filter lets pass as terrain
STEP_M = 0.3  # and what it lets pass besides
LAYER_M = 0.25  # points this near the filtered surface are ground
STRAY_M = 1.0  # a lowest point this far below all eight neighbours' is no ground
SETTLE = 2  # rounds of smoothing of what was filled in
FINE = 2  # levels at which that happens: the coarse ones would reach too far


@dataclass(frozen=True, eq=False)
class Terrain:
    """The ground under a cloud.

    Parameters
    ----------
    raster : Raster
        Height of the ground in metres; NaN further than a block from all points.
    found : (rows, cols) array of bool
        Cells whose ground was found by the filter because none is classed there.
    """

    raster: Raster
    found: Mask

    def above(self, xyz: Floats) -> Floats:
        """(P,) height above the ground in metres, in whole steps; NaN where there is no ground."""
        return np.asarray(np.rint((xyz[:, 2] - self.raster.at(xyz[:, :2])) * STEPS) / STEPS)


def terrain(xyz: Floats, is_ground: Mask, usable: Mask, grid: Grid) -> Terrain:
    """Make the terrain from the points classed as ground, and by a filter where there are none.

    Parameters
    ----------
    xyz : (P, 3) array
        Snapped points.
    is_ground : (P,) array of bool
        Points classed as ground.
    usable : (P,) array of bool
        Points among which the filter may look (no buildings, no noise).
    grid : Grid
    """
    cells = grid.cells(xyz)
    count, total = _sums(xyz, is_ground, cells, grid.shape[0] * grid.shape[1])
    block = 2**LEVELS
    known = _blocks(count.reshape(grid.shape), block) > 0
    lacking = ~ndimage.binary_dilation(known, np.ones((3, 3)))
    found = np.repeat(np.repeat(lacking, block, axis=0), block, axis=1)
    if lacking.any():
        extra = _filtered(xyz, usable & _taken(found.ravel(), cells), grid)
        more = _sums(xyz, extra, cells, len(count))
        count, total = count + more[0], total + more[1]
    filled = _filled(count.reshape(grid.shape), total.reshape(grid.shape))
    height = np.where(filled == NONE, np.nan, filled / STEPS)
    return Terrain(grid.raster(height), found)


@compiled
def _taken(mask: Mask, cells: NDArray[np.int32]) -> Mask:
    out = np.empty(len(cells), dtype=np.bool_)
    for p in range(len(cells)):
        out[p] = mask[cells[p]]
    return out


@compiled
def _sums(xyz: Floats, chosen: Mask, cells: NDArray[np.int32], size: int) -> tuple[Ints, Ints]:
    """Count the chosen points of every cell, and add up their heights in steps."""
    count, total = np.zeros(size, dtype=np.int64), np.zeros(size, dtype=np.int64)
    for p in range(len(xyz)):
        if chosen[p]:
            count[cells[p]] += 1
            total[cells[p]] += int(np.rint(xyz[p, 2] * STEPS))
    return count, total


def _blocks(values: Ints, side: int = 2) -> Ints:
    """Sums over blocks of `side` by `side` cells."""
    rows, cols = values.shape
    return np.asarray(values.reshape(rows // side, side, cols // side, side).sum(axis=(1, 3)))


def _filled(count: Ints, total: Ints) -> Ints:
    """Mean heights in steps; empty cells take theirs from ever larger blocks, NONE beyond them all."""
    levels = [(count, total)]
    for _ in range(LEVELS):
        levels.append((_blocks(levels[-1][0]), _blocks(levels[-1][1])))
    coarse = np.full((levels[-1][0].shape[0] // 2 + 1, levels[-1][0].shape[1] // 2 + 1), NONE)
    for level, (held, heights) in reversed(list(enumerate(levels))):
        coarse = _refined(held, heights, coarse)
        for _ in range(SETTLE if level < FINE else 0):
            coarse = _settled(held, coarse)
    return coarse


@compiled
def _refined(count: Ints, total: Ints, coarse: Ints) -> Ints:
    """Mean of every cell, or what the four nearest blocks of the level above say by their distance."""
    rows, cols = count.shape
    out = np.empty((rows, cols), dtype=np.int64)
    for i in range(rows):
        for j in range(cols):
            if count[i, j] > 0:
                out[i, j] = total[i, j] // count[i, j]
                continue
            zero, weight, rise = NONE, 0, 0
            for a in range(2):
                for b in range(2):
                    row = i // 2 + a * (2 * (i % 2) - 1)
                    col = j // 2 + b * (2 * (j % 2) - 1)
                    if not (0 <= row < coarse.shape[0] and 0 <= col < coarse.shape[1]):
                        continue
                    if coarse[row, col] == NONE:
                        continue
                    zero = coarse[row, col] if zero == NONE else zero
                    share = (1 if a else 3) * (1 if b else 3)
                    weight += share
                    rise += share * (coarse[row, col] - zero)
            out[i, j] = zero + rise // weight if weight else NONE
    return out


@compiled
def _settled(count: Ints, heights: Ints) -> Ints:
    """Give every filled-in cell the mean of its four neighbours."""
    rows, cols = count.shape
    out = heights.copy()
    for i in range(1, rows - 1):
        for j in range(1, cols - 1):
            if count[i, j] > 0 or heights[i, j] == NONE:
                continue
            number, rise = 0, 0
            for k in range(4):
                other = heights[i + (1, -1, 0, 0)[k], j + (0, 0, 1, -1)[k]]
                if other != NONE:
                    number += 1
                    rise += other - heights[i, j]
            if number:
                out[i, j] = heights[i, j] + rise // number
    return out


def _filtered(xyz: Floats, usable: Mask, grid: Grid) -> Mask:
    """Mask of the usable points that a simple morphological filter takes for ground."""
    coarse = Grid.over(xyz, np.append(grid.origin, 0).astype(np.float64), 1.0)
    cells = coarse.cells(xyz)
    low = _lowest(xyz, usable, cells, coarse.shape[0] * coarse.shape[1]).reshape(coarse.shape)
    ring = np.array([[1, 1, 1], [1, 0, 1], [1, 1, 1]], dtype=bool)
    around = ndimage.minimum_filter(low, footprint=ring, mode="nearest")
    surface = np.where(np.isfinite(around) & (low < around - STRAY_M), around, low)
    standing = np.zeros(coarse.shape, dtype=bool)
    opened = surface
    for half in OPENINGS:
        before, opened = opened, _opened(opened, 2 * half + 1)
        with np.errstate(invalid="ignore"):  # empty less empty
            standing |= before - opened > SLOPE * half + STEP_M
    ground = np.where(standing | ~np.isfinite(surface), -np.inf, surface)
    return _near(xyz, usable, cells, ground.ravel())


def _opened(surface: Floats, width: int) -> Floats:
    """Morphological opening by a square; cells without points (inf) take no part."""
    low = ndimage.minimum_filter(surface, size=width, mode="nearest")
    low[np.isinf(low)] = -np.inf
    high = ndimage.maximum_filter(low, size=width, mode="nearest")
    return np.where(np.isfinite(surface), high, np.inf)


@compiled
def _lowest(xyz: Floats, usable: Mask, cells: NDArray[np.int32], size: int) -> Floats:
    low = np.full(size, np.inf)
    for p in range(len(xyz)):
        if usable[p] and xyz[p, 2] < low[cells[p]]:
            low[cells[p]] = xyz[p, 2]
    return low


@compiled
def _near(xyz: Floats, usable: Mask, cells: NDArray[np.int32], ground: Floats) -> Mask:
    out = np.zeros(len(xyz), dtype=np.bool_)
    for p in range(len(xyz)):
        out[p] = usable[p] and abs(xyz[p, 2] - ground[cells[p]]) <= LAYER_M
    return out
