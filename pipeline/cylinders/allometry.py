"""The stem diameter that height and crown width suggest, where no bark was seen."""

from __future__ import annotations

# Jucker et al. (2017), Global Change Biology 23, "Allometric equations for integrating remote
# sensing imagery into forest monitoring programmes": global row; diameter in cm.
SCALE, EXPONENT, SIGMA = 0.557, 0.809, 0.056
LOG_ERROR = 0.35  # standard deviation of the logarithm over trees of all kinds


def allometric_diameter(height_m: float, crown_m: float) -> float:
    """Diameter at breast height in metres, from height and crown diameter in metres.

    References
    ----------
    Jucker et al. (2017): ``D = 0.557 (H CD)^0.809 exp(0.056^2 / 2)``.

    Examples
    --------
    >>> round(allometric_diameter(15.0, 8.0), 3)
    0.268
    """
    size = max(height_m, 0.1) * max(crown_m, 0.1)
    return float(SCALE * size**EXPONENT * 2.718281828459045 ** (SIGMA**2 / 2) / 100)
