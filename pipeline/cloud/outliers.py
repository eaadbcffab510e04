"""Points that stand alone: far from their neighbours, compared with what is usual in this cloud."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

ROBUST = 1.4826  # median absolute deviation of a normal distribution -> its standard deviation
MIN_RATIO = 5.0  # a point nearer than this many usual distances is never an outlier
STRAY_M = 1000.0  # twice this at the finest cell (1 mm) is what the 21 bits of a cell number hold
SAMPLE = 20_000  # points that are enough for a median spacing


def outliers(xyz: Floats, *, neighbours: int, limit_sd: float) -> Mask:
    """Mask of the points whose neighbours are unusually far.

    The mean distance to the nearest points is compared twice, in logarithms because point spacing
    is skewed: with the whole cloud (median + `limit_sd` robust standard deviations), and with the
    same figure of the point's own neighbours. The first finds what floats about a sparse cloud,
    the second the lone point just below a dense stem, which the sparse twigs of the same cloud
    would excuse.

    Parameters
    ----------
    xyz : (P, 3) array
        Metres.
    neighbours : int
        How many nearest points.
    limit_sd : float
        Robust standard deviations.

    Returns
    -------
    (P,) array of bool

    References
    ----------
    Rusu et al. (2008), Towards 3D point cloud based object maps: the statistical filter; changed:
    logarithms, median and MAD instead of mean and deviation, and the second, local comparison
    after Breunig et al. (2000), LOF.
    """
    if len(xyz) <= neighbours:
        return np.zeros(len(xyz), dtype=bool)
    distance, near = cKDTree(xyz).query(xyz, k=neighbours + 1)
    log = np.log(np.maximum(distance[:, 1:].mean(axis=1), 1e-6))
    del distance
    local = log - np.median(log[near[:, 1:]], axis=1)
    return np.asarray(_far(log, limit_sd) | (_far(local, limit_sd) & (log > np.median(log))))


def strays(xyz: Floats) -> Mask:
    """Mask of the points no tile could hold, such as (0, 0, 0) among national coordinates.

    They go before anything is put on a grid, whose cells are numbered for a few kilometres.
    """
    if not len(xyz):
        return np.zeros(0, dtype=bool)
    return np.asarray((np.abs(xyz - np.median(xyz, axis=0)) > STRAY_M).any(axis=1))


def spacing(xyz: Floats) -> float:
    """Median distance to the nearest other point in metres, from an even sample; 0 for one point."""
    if len(xyz) < 2:
        return 0.0
    sample = xyz[:: max(1, len(xyz) // SAMPLE)]
    return float(np.median(cKDTree(xyz).query(sample, k=2)[0][:, 1]))


def _far(log: Floats, limit_sd: float) -> Mask:
    middle = np.median(log)
    spread = ROBUST * np.median(np.abs(log - middle))
    return np.asarray(log > middle + max(limit_sd * spread, np.log(MIN_RATIO)))
