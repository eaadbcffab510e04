"""How distances spread: the row of a table of deviations."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Spread:
    """What a set of distances amounts to, in millimetres.

    Parameters
    ----------
    min_mm, max_mm, mean_mm, median_mm, stdev_mm, p95_mm : float
        The deviation is that of the whole set (divided by its number).
    matched : int
        How many distances there are.
    """

    min_mm: float
    max_mm: float
    mean_mm: float
    median_mm: float
    stdev_mm: float
    p95_mm: float
    matched: int


def spread_of(distance_m: Floats, *, anchored: bool = False) -> Spread | None:
    """Return how distances spread; None of none.

    Parameters
    ----------
    distance_m : (K,) array
        Metres, >= 0.
    anchored : bool
        Whether the first is that of the root: the least is then taken of the others.

    Examples
    --------
    >>> spread_of(np.array([0.0, 0.001, 0.003])).mean_mm.__round__(6)
    1.333333
    """
    mm = 1000.0 * distance_m
    if not len(mm):
        return None
    least = mm[1:] if anchored and len(mm) > 1 else mm
    return Spread(
        float(least.min()),
        float(mm.max()),
        float(mm.mean()),
        float(np.median(mm)),
        float(mm.std()),
        float(np.percentile(mm, 95)),
        len(mm),
    )
