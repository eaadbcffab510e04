"""The canopy height model: how high the vegetation reaches in every cell, without pits, smoothed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from pipeline.airborne.raster import Grid
from pipeline.geometry.compiled import compiled
from pipeline.model import Floats

PIT_M, PIT_SHARE = 1.0, 0.1  # a pit is deeper than this, and this share of the canopy's height
TRUNCATE = 2.0  # a smoothing kernel ends at so many standard deviations


def canopy(height: Floats, cells: NDArray[np.int32], grid: Grid, sigma_cells: float) -> Floats:
    """(rows, cols) canopy height in metres, 0 where there is no vegetation.

    Laser pulses pass through crowns and leave pits: where a closing by 3 x 3 cells would fill a pit by more
    than 1 m and a tenth of the height, it does. The shallow ones part one crown from the next.

    Parameters
    ----------
    height : (N,) array
        Height of the vegetation's points above the ground, in metres.
    cells : (N,) array of int32
        Their cells in `grid`.
    grid : Grid
    sigma_cells : float
        Standard deviation of the Gaussian that smooths, in cells; 0 for none.
    """
    top = _highest(height, cells, grid.shape[0] * grid.shape[1]).reshape(grid.shape)
    closed = ndimage.grey_closing(top, size=3, mode="constant", cval=0.0)
    full = np.where(closed - top > PIT_M + PIT_SHARE * closed, closed, top)
    if sigma_cells <= 0:
        return np.asarray(full)
    smooth = ndimage.gaussian_filter(full, sigma_cells, mode="constant", truncate=TRUNCATE)
    return np.asarray(np.where(full > 0, smooth, 0.0))


@compiled
def _highest(height: Floats, cells: NDArray[np.int32], size: int) -> Floats:
    top = np.zeros(size)
    for p in range(len(height)):
        top[cells[p]] = max(top[cells[p]], height[p])
    return top
