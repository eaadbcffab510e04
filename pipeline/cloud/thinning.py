"""Fewer points where there are more than the geometry needs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.cloud.order import from_corner
from pipeline.geometry.voxels import first_in_cell

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def thin(xyz: Floats, *, voxel_m: float) -> Ints:
    """Positions of the first point in every cell of `voxel_m` metres; `xyz` is in canonical order."""
    return first_in_cell(from_corner(xyz), voxel_m)


def cap(xyz: Floats, *, voxel_m: float, max_points: int) -> Ints:
    """Positions that remain when the cells double in size until at most `max_points` are left.

    Parameters
    ----------
    xyz : (P, 3) array
        Metres, in canonical order, thinned to `voxel_m` already.
    voxel_m : float
        Side of the cells that were used last.
    max_points : int
        The most points that may remain, at least 1.
    """
    kept = np.arange(len(xyz))
    while len(kept) > max_points:
        voxel_m *= 2
        kept = kept[thin(xyz[kept], voxel_m=voxel_m)]
    return kept
