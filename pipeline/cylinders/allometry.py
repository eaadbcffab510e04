"""The stem diameter that height and crown width suggest, where no bark was seen."""

from __future__ import annotations

import math
from typing import NamedTuple

LOG_ERROR = 0.35  # standard deviation of the logarithm over trees of all kinds
WITHIN_90 = 1.645  # standard deviations to either side that hold nine of ten


class Allometry(NamedTuple):
    """One row of the table: ``D = scale (H CD)^exponent exp(sigma^2 / 2)``, D in cm, H and CD in metres."""

    scale: float
    exponent: float
    sigma: float = 0.0


GLOBAL = Allometry(0.557, 0.809, 0.056)


def allometric_diameter(height_m: float, crown_m: float, row: Allometry = GLOBAL) -> float:
    """Diameter at breast height in metres, from height and crown diameter in metres.

    Parameters
    ----------
    height_m, crown_m : float
        Below 0.1 m they count as 0.1 m.
    row : Allometry

    References
    ----------
    Jucker et al. (2017), Global Change Biology 23, "Allometric equations for integrating remote
    sensing imagery into forest monitoring programmes": ``D = 0.557 (H CD)^0.809 exp(0.056^2 / 2)``.

    Examples
    --------
    >>> round(allometric_diameter(15.0, 8.0), 3)
    0.268
    """
    size = max(height_m, 0.1) * max(crown_m, 0.1)
    return float(row.scale * size**row.exponent * math.exp(row.sigma**2 / 2) / 100)


def allometric_interval(diameter_m: float) -> tuple[float, float]:
    """90 % interval of such a diameter, in metres: a factor to either side.

    Examples
    --------
    >>> [round(value, 3) for value in allometric_interval(0.268)]
    [0.151, 0.477]
    """
    factor = math.exp(WITHIN_90 * LOG_ERROR)
    return diameter_m / factor, diameter_m * factor
