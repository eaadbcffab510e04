"""The sensor's range noise, read off the bark of the thick limbs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.estimates import CYLINDER
from pipeline.geometry.windows import Windows

ROBUST = 1.4826  # standard deviation of normal noise over the median of its sizes
MOST_M = 0.02  # rough bark is not noise: beyond this, circle fits would be switched off
LEAST_M = 0.0005
FEWEST = 5  # windows that are fitted, below which nothing is known of the noise
NOISE, BARK = 1.6, 2.4  # upper by lower quartile of the misfits: from noise alone to rough bark


Floats = NDArray[np.float64]


def range_noise(windows: Windows, fallback_m: float, among: NDArray[np.bool_] | None = None) -> float:
    """Standard deviation of the range noise in metres.

    The median misfit of the fitted windows, each with the weight of its cross-section; the more these
    differ (bark), the nearer to their lower quartile; between half a millimetre and 20 mm.

    Parameters
    ----------
    windows : Windows
    fallback_m : float
        Returned when fewer than five windows are fitted.
    among : (M,) array of bool, optional
        The windows that may be asked.
    """
    weight = _cross_sections(windows)
    if among is not None:
        weight = np.where(among, weight, 0.0)
    if np.count_nonzero(weight) < FEWEST:
        return fallback_m
    low, middle, high = _quantiles(windows.spread, weight, (0.25, 0.5, 0.75))
    rough = float(np.clip((high / max(low, 1e-9) - NOISE) / (BARK - NOISE), 0.0, 1.0))
    return float(np.clip(middle + rough * (low - middle), LEAST_M, MOST_M))


def shows_noise(windows: Windows) -> bool:
    """Whether enough windows are fitted for the noise to be read off them."""
    return int(np.count_nonzero(_cross_sections(windows))) >= FEWEST


def _cross_sections(windows: Windows) -> Floats:
    """(M,) squared radius of what is surely bark, else 0."""
    bark = (windows.kind == CYLINDER) & (windows.count >= 15) & (windows.arc > 2.0)
    return np.where(bark, windows.evidence * np.maximum(windows.square, 0.0), 0.0)


def _quantiles(values: Floats, weight: Floats, shares: tuple[float, ...]) -> Floats:
    """Weighted quantiles, straight between the values so that no small change makes a jump."""
    order = np.argsort(values, kind="stable")
    below = np.cumsum(weight[order]) - 0.5 * weight[order]
    return np.asarray(np.interp(np.multiply(shares, weight.sum()), below, values[order]))
