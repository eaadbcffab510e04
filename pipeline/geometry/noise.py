"""The sensor's range noise, read off the bark of the thick limbs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.estimates import CYLINDER
from pipeline.geometry.windows import Windows

MOST_M = 0.02  # rough bark is not noise: beyond this, circle fits would be switched off
LEAST_M = 0.0005


def range_noise(windows: Windows, fallback_m: float, among: NDArray[np.bool_] | None = None) -> float:
    """Standard deviation of the range noise in metres.

    The median misfit of the thickest third of the fitted windows; when these differ widely (bark),
    their lower quartile; between half a millimetre and 20 mm.

    Parameters
    ----------
    windows : Windows
    fallback_m : float
        Returned when fewer than five windows are fitted.
    among : (M,) array of bool, optional
        The windows that may be asked.
    """
    bark = (windows.kind == CYLINDER) & (windows.evidence > 0.5)
    if among is not None:
        bark &= among
    fitted = np.flatnonzero(bark & (windows.count >= 15) & (windows.arc > 2.0))
    if len(fitted) < 5:
        return fallback_m
    thick = fitted[windows.square[fitted] >= np.quantile(windows.square[fitted], 2 / 3)]
    low, middle, high = np.quantile(windows.spread[thick], (0.25, 0.5, 0.75))
    chosen = low if high > 2.0 * low else middle
    return float(np.clip(chosen, LEAST_M, MOST_M))
