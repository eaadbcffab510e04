"""Dry mass above the ground, and its carbon, from the height and the crown of a tree.

No stem is needed, which is what airborne points seldom show. The figures of one tree are rough: the
90 % interval goes from half to twice the estimate; sums over many trees are better than their parts,
as far as their errors are independent.

References
----------
Jucker, T. et al. (2017). Allometric equations for integrating remote sensing imagery into forest monitoring
programmes. Global Change Biology 23, 177-190: mass in kg = (0.016 + a) (H CD)^(2.013 + b) exp(0.204^2 / 2),
with a = b = 0 for angiosperms, a = 0.093 and b = -0.223 for gymnosperms, from 2,395 felled trees.

IPCC (2006). Guidelines for National Greenhouse Gas Inventories, volume 4, chapter 4, table 4.3: default
share of carbon in dry mass 0.47.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.model import Floats

LeafType = Literal["angiosperm", "gymnosperm"]

ROWS: dict[str, tuple[float, float]] = {
    "angiosperm": (0.016, 2.013),
    "gymnosperm": (0.016 + 0.093, 2.013 - 0.223),
}
"""Scale and exponent of H times CD."""

CORRECTION = float(np.exp(0.204**2 / 2))
"""From the mean of the logarithm to the mean, as the paper prints it."""

LOG_ERROR = 0.204**0.5
"""Standard deviation of the logarithm of a tree's mass.

The paper's 0.204 is read as a variance here, for an equation that knows neither the stem nor the wood
cannot do better than one that knows both (0.357: Chave et al. 2014, Global Change Biology 20, 3177-3190).
"""

HALF_WIDTH_90 = 1.6448536269514722
"""Half of the 90 % interval in standard deviations."""

CARBON_SHARE = 0.47
"""Carbon in dry mass: IPCC (2006). Older tables take 0.50, which is 6 % more."""


class Biomass(NamedTuple):
    """Dry mass above the ground in kg, its 90 % interval, and its carbon in kg; NaN where unknown."""

    agb_kg: Floats
    lo_kg: Floats
    hi_kg: Floats
    carbon_kg: Floats


def biomass(height_m: ArrayLike, crown_diameter_m: ArrayLike, leaf_type: ArrayLike | None = None) -> Biomass:
    """Estimate the dry mass of trees above the ground.

    Parameters
    ----------
    height_m, crown_diameter_m : (N,) array
        NaN where unknown.
    leaf_type : (N,) array of str, optional
        ``"angiosperm"`` or ``"gymnosperm"``. Anything else is unknown: the estimate is then the geometric
        mean of both equations, and the interval spans those of both.

    Returns
    -------
    Biomass
        Arrays (N,).

    Examples
    --------
    >>> one = biomass([15.0], [8.0], ["angiosperm"])
    >>> [round(float(figure[0])) for figure in one]
    [250, 119, 526, 118]
    """
    size = np.asarray(height_m, dtype=np.float64) * np.asarray(crown_diameter_m, dtype=np.float64)
    size = np.where(size > 0, size, np.nan)
    broad, needle = (scale * size**power * CORRECTION for scale, power in ROWS.values())
    kind: NDArray[np.str_] = np.asarray("" if leaf_type is None else leaf_type, dtype=np.str_)
    known = [kind == name for name in ROWS]
    low = np.select(known, [broad, needle], np.minimum(broad, needle))
    high = np.select(known, [broad, needle], np.maximum(broad, needle))
    middle = np.sqrt(low * high)
    wide = float(np.exp(HALF_WIDTH_90 * LOG_ERROR))
    return Biomass(middle, low / wide, high * wide, CARBON_SHARE * middle)
