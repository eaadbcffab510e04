"""How much wood there is: volumes, lengths, diameter, height, branches, and how far two trees differ."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.accuracy.wood import Wood

Floats = NDArray[np.float64]

BREAST_M = 1.3
STOUT_RADIUS_M, STOUT_LENGTH_M = 0.01, 0.10
"""Branches count from here on: what a scan can be expected to show."""


@dataclass(frozen=True)
class Amounts:
    """Figures of one tree; None where radii are not known, or the stem ends below breast height.

    Parameters
    ----------
    nodes, branches : int
    branches_ge_1cm : int or None
        Branches of 1 cm of radius and 10 cm of length at least.
    height_m, length_m : float
        From the lowest to the highest point of the axes, and along all axes.
    volume_l, stem_volume_l, branch_volume_l : float or None
    dbh_cm : float or None
        Of the model 1.3 m above the foot of its stem: what is drawn, not what was measured there.
    """

    nodes: int
    branches: int
    branches_ge_1cm: int | None
    height_m: float
    length_m: float
    volume_l: float | None
    stem_volume_l: float | None
    branch_volume_l: float | None
    dbh_cm: float | None


@dataclass(frozen=True)
class Differences:
    """How far one tree differs from another; None where a figure is not known.

    Parameters
    ----------
    volume_error_pct, stem_volume_error_pct, branch_volume_error_pct, length_error_pct, dbh_error_pct : float
        100 (a / b - 1).
    height_error_m : float
        a - b.
    branches_ratio : float
        a / b, of the branches of 1 cm of radius and more.
    """

    volume_error_pct: float | None
    stem_volume_error_pct: float | None
    branch_volume_error_pct: float | None
    length_error_pct: float | None
    dbh_error_pct: float | None
    height_error_m: float
    branches_ratio: float | None


def amounts_of(wood: Wood) -> Amounts:
    """Return how much wood a tree has."""
    low, high = wood.box
    known: tuple[float | None, float | None, float | None] = (None, None, None)
    tubes, stout, breast = wood.tubes(), None, None
    if tubes is not None:
        a, b = tubes.start_radius, tubes.end_radius
        litres = 1000.0 * np.pi / 3 * (a**2 + a * b + b**2) * wood.length
        stem = wood.order == 0
        known = (float(litres.sum()), float(litres[stem].sum()), float(litres[~stem].sum()))
        stout, breast = _stout(wood, np.maximum(a, b)), _breast_diameter_cm(wood, a, b)
    return Amounts(
        len(wood) + 1,
        len(np.unique(wood.branch)),
        stout,
        float(high[2] - low[2]),
        float(wood.length.sum()),
        *known,
        breast,
    )


def differences(a: Amounts, b: Amounts) -> Differences:
    """Return how far A is from B."""
    return Differences(
        _percent(a.volume_l, b.volume_l),
        _percent(a.stem_volume_l, b.stem_volume_l),
        _percent(a.branch_volume_l, b.branch_volume_l),
        _percent(a.length_m, b.length_m),
        _percent(a.dbh_cm, b.dbh_cm),
        a.height_m - b.height_m,
        _ratio(a.branches_ge_1cm, b.branches_ge_1cm),
    )


def _stout(wood: Wood, thickest: Floats) -> int:
    """Count the branches that are thick and long enough."""
    length = np.bincount(wood.branch, wood.length)
    radius = np.zeros(len(length))
    np.maximum.at(radius, wood.branch, thickest)
    return int(((radius >= STOUT_RADIUS_M) & (length >= STOUT_LENGTH_M)).sum())


def _breast_diameter_cm(wood: Wood, a: Floats, b: Floats) -> float | None:
    """Return the diameter of the stem at breast height.

    Where it crosses that height more than once, the mean of all that are at least half as thick as the
    thickest: the end of a stem that hangs down to there is no trunk.
    """
    stem = wood.order == 0
    if not stem.any():
        return None
    begin, end = wood.start[stem, 2], wood.end[stem, 2]
    height = begin.min() + BREAST_M
    hit = (np.minimum(begin, end) <= height) & (np.maximum(begin, end) > height)
    if not hit.any():
        return None
    share = (height - begin[hit]) / (end[hit] - begin[hit])
    radius = a[stem][hit] + share * (b - a)[stem][hit]
    return float(200.0 * radius[2 * radius >= radius.max()].mean())


def _ratio(a: float | None, b: float | None) -> float | None:
    return None if a is None or not b or not math.isfinite(a / b) else a / b


def _percent(a: float | None, b: float | None) -> float | None:
    ratio = _ratio(a, b)
    return None if ratio is None else 100.0 * (ratio - 1.0)
