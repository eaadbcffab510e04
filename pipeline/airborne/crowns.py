"""Crowns in a canopy height model: which cells belong to which treetop.

| method | what | for |
|---|---|---|
| `prominence` | treetops with a valley between them and any higher one nearby | streets, parks, forests |
| `maxima` | treetops are highest in a window of 2 m + 0.05 h | the usual method, to set beside |
| `peaks` | the same with half the window | conifers with narrow crowns; splits broad crowns |

Cells go to treetops by steepest ascent: a cell belongs with its highest neighbour, and a lesser peak
with the highest cell of its window. On a surface without plateaus that is the watershed, but every
answer hangs on the cells of one path alone, never on the order of a flood from far away: a cell of
the batch and the whole country give the same crowns.

References
----------
Popescu, S. C. & Wynne, R. H. (2004). Seeing the trees in the forest. Photogramm. Eng. Remote Sens.
70 (5), 589-604: a window that grows with height. Changed: slope and foot of the window.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from pipeline.geometry.compiled import compiled
from pipeline.model import Floats
from pipeline.options import Options

Cells = NDArray[np.int64]

NEARBY_M = 5.0  # ways from treetop to treetop are looked for within this distance


class CrownOptions(Options):
    """How treetops and crowns are told apart."""

    window_m: float = Field(
        default=2.0, ge=0.5, le=20, description="width of the treetop window at the ground in metres"
    )
    window_per_m: float = Field(
        default=0.05, ge=0, le=1, description="growth of that width per metre of height"
    )
    prominence_m: float = Field(
        default=0.15,
        ge=0,
        le=10,
        description="least rise of a treetop above the way to a higher one, in metres of smoothed canopy",
    )
    valley_share: float = Field(
        default=0.15,
        ge=0,
        le=1,
        description="least depth of the valley between two treetops below the straight line that joins them, "
        "as a share of their distance",
    )
    max_crown_radius_m: float = Field(
        default=10.0, ge=1, le=15, description="farthest that a crown reaches from its treetop in metres"
    )
    min_crown_share: float = Field(
        default=0.2,
        ge=0,
        le=0.95,
        description="share of the treetop's height below which canopy is not its crown",
    )


def by_maxima(chm: Floats, cell_m: float, options: CrownOptions) -> Cells:
    """(rows, cols) flat position of every cell's treetop, -1 where there is none."""
    return crowns_of(chm, cell_m, options, 1.0)


def by_peaks(chm: Floats, cell_m: float, options: CrownOptions) -> Cells:
    """(rows, cols) flat position of every cell's treetop, -1 where there is none; narrower windows."""
    return crowns_of(chm, cell_m, options, 0.5)


def by_prominence(chm: Floats, cell_m: float, options: CrownOptions) -> Cells:
    """(rows, cols) flat position of every cell's treetop, -1 where there is none; by their prominence.

    The mantle of one crown bulges: it does not sink far below the straight line between two of its points,
    and the farther apart they are, the less a hollow of some depth says. So a valley parts two trees where
    the lower top rises by `prominence_m` above it, and the valley lies below the line from top to top by
    `valley_share` of their distance. A small tree at the flank of a tall one rises little, but its valley
    is deep below that line; two clumps of one flat crown have neither.
    """
    upward = _upward(chm, 0.0, 0.0)
    limits = (NEARBY_M / cell_m, options.prominence_m, options.valley_share * cell_m)
    joined = _joined(chm, upward, limits)
    reach = options.max_crown_radius_m / cell_m
    return _climbed(chm, joined, reach, options.min_crown_share).reshape(chm.shape)


METHODS: MappingProxyType[str, Callable[[Floats, float, CrownOptions], Cells]] = MappingProxyType(
    {"prominence": by_prominence, "maxima": by_maxima, "peaks": by_peaks}
)


def crowns_of(chm: Floats, cell_m: float, options: CrownOptions, narrowing: float) -> Cells:
    """(rows, cols) flat position of every cell's treetop, -1 where there is none.

    Parameters
    ----------
    chm : (rows, cols) array
        Canopy height in metres, 0 where there is none.
    cell_m : float
    options : CrownOptions
    narrowing : float
        Factor of the width of the window.
    """
    window = (options.window_m * narrowing / 2 / cell_m, options.window_per_m * narrowing / 2 / cell_m)
    upward = _upward(chm, window[0], window[1])
    reach = options.max_crown_radius_m / cell_m
    return _climbed(chm, upward, reach, options.min_crown_share).reshape(chm.shape)


@compiled
def _upward(chm: Floats, window: float, window_per_m: float) -> Cells:
    """Flat position of the cell that every cell climbs to, itself at a treetop, -1 without canopy."""
    rows, cols = chm.shape
    up = np.full(rows * cols, -1, dtype=np.int64)
    for i in range(rows):
        for j in range(cols):
            if chm[i, j] <= 0.0:
                continue
            best = _highest_near(chm, i, j, 1.5)
            if best == i * cols + j:
                best = _highest_near(chm, i, j, max(window + window_per_m * chm[i, j], 1.5))
            up[i * cols + j] = best
    return up


@compiled
def _joined(chm: Floats, up: Cells, limits: tuple[float, float, float]) -> Cells:
    """Let every treetop climb on to the higher one that no valley parts it from."""
    flat, out = chm.ravel(), up.copy()
    seen = np.full(len(up), -1, dtype=np.int64)
    for top in range(len(up)):
        if up[top] == top:
            low, higher = _valley(flat, chm.shape[1], top, limits, seen)
            if higher != top and not _parted(flat, up, (top, low, higher), limits, chm.shape[1]):
                out[top] = higher
    return out


@compiled
def _valley(
    flat: Floats, cols: int, top: int, limits: tuple[float, float, float], seen: Cells
) -> tuple[int, int]:
    """Lowest cell of the highest way from a treetop to higher canopy, and the first higher cell on it.

    The flood takes the highest of its banks first, and of equals the one that comes first. The higher cell
    is the treetop itself where there is none in reach, or where the valley is deep enough at any distance.
    """
    reach, least, share = limits
    deep = max(least, share * reach)
    low, banks = top, [(-flat[top], top)]
    seen[top] = top
    while len(banks) > 0:
        level, cell = heapq.heappop(banks)
        if -level < flat[low]:
            low = cell
        if flat[low] <= 0.0 or flat[top] - flat[low] >= deep:
            return low, top
        if -level > flat[top] or (-level == flat[top] and cell > top):
            return low, int(cell)
        for step in range(9):
            i, j = cell // cols + step // 3 - 1, cell % cols + step % 3 - 1
            if i < 0 or j < 0 or j >= cols or i * cols >= len(flat):
                continue
            at = i * cols + j
            if seen[at] != top and _apart(top, at, cols) <= reach:
                seen[at] = top
                heapq.heappush(banks, (-flat[at], at))
    return low, top


@compiled
def _parted(
    flat: Floats, up: Cells, way: tuple[int, int, int], limits: tuple[float, float, float], cols: int
) -> bool:
    """Whether a valley is deep enough for two trees: below the lower top and below the line to the other."""
    top, low, summit = way
    reach, least, share = limits
    while up[summit] != summit and _apart(top, up[summit], cols) <= reach:
        summit = up[summit]
    here, there = _apart(top, low, cols), _apart(low, summit, cols)
    line = flat[top] + (flat[summit] - flat[top]) * here / max(here + there, 1.0)
    return bool(flat[top] - flat[low] >= least and line - flat[low] >= share * _apart(top, summit, cols))


@compiled
def _apart(a: int, b: int, cols: int) -> float:
    """Distance of two cells, in cells."""
    return float(np.hypot(a // cols - b // cols, a % cols - b % cols))


@compiled
def _highest_near(chm: Floats, i: int, j: int, radius: float) -> int:
    """Flat position of the highest cell within `radius` cells; of equals the one that comes last."""
    rows, cols = chm.shape
    reach = int(radius)
    best_i, best_j = i, j
    for a in range(max(i - reach, 0), min(i + reach + 1, rows)):
        for b in range(max(j - reach, 0), min(j + reach + 1, cols)):
            if (a - i) ** 2 + (b - j) ** 2 > radius * radius:
                continue
            if chm[a, b] > chm[best_i, best_j] or (
                chm[a, b] == chm[best_i, best_j] and (a, b) > (best_i, best_j)
            ):
                best_i, best_j = a, b
    return int(best_i * cols + best_j)


@compiled
def _climbed(chm: Floats, up: Cells, reach: float, least_share: float) -> Cells:
    """Follow every path to its treetop; paths that leave the treetop's reach belong to no tree."""
    cols = chm.shape[1]
    flat = chm.ravel()
    top = np.full(len(up), -1, dtype=np.int64)
    for cell in range(len(up)):
        if up[cell] < 0:
            continue
        at = cell
        while up[at] != at:
            at = up[at]
        peak, at = at, cell
        inside = flat[cell] >= least_share * flat[peak]
        while inside:
            rise, run = at // cols - peak // cols, at % cols - peak % cols
            inside = rise * rise + run * run <= reach * reach
            if at == peak:
                break
            at = up[at]
        if inside:
            top[cell] = peak
    return top
