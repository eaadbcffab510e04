"""The diameter at breast height: a cylinder through the bark around 1.3 m above the ground."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.cylinders.allometry import LOG_ERROR
from pipeline.cylinders.measured import Measured
from pipeline.cylinders.radii import GUESS
from pipeline.geometry.axes import Axes
from pipeline.geometry.estimates import CYLINDER
from pipeline.geometry.windows import estimate_window
from pipeline.model import ALLOMETRIC, MEASURED, PROPAGATED, RADIUS_SOURCES, Trunk

Floats = NDArray[np.float64]

BREAST_M = 1.3
SLICES_M = (0.10, 0.15, 0.20)  # heights of the slice; as short as the points allow
SHARP = 0.003  # standard error, as a share of the radius, with which a slice is long enough
LEAST_POINTS = 12
LEAST_EVIDENCE = 0.2
WITHIN_90 = 1.645
# Trunks are not round: a share of the diameter that even a perfect scan leaves open.
OUT_OF_ROUND = 0.004


def around_breast_height(axes: Axes, ground_z: float) -> NDArray[np.int64]:
    """The stem's nodes just below and above breast height, so that the model shows its diameter."""
    height = axes.xyz[int(axes.first[0]) : int(axes.first[1]), 2] - ground_z
    above = np.flatnonzero(height >= BREAST_M)
    return np.unique(np.maximum(above[:1] - [[1], [0]], 0)).astype(np.int64)


def through_breast_height(axes: Axes, trunk: Trunk) -> Axes:
    """The stem with the measured diameter at breast height: nothing thinner below, nothing thicker above.

    Parameters
    ----------
    axes : Axes
        With radii; branch 0 is the stem.
    trunk : Trunk
    """
    if trunk.dbh_m is None or trunk.source != "measured":
        return axes
    square, at = axes.square.copy(), (trunk.dbh_m / 2.0) ** 2
    around = around_breast_height(axes, trunk.ground_z)
    stem = square[int(axes.first[0]) : int(axes.first[1])]
    stem[: around[0] + 1] = np.maximum(stem[: around[0] + 1], at)
    stem[around[-1] :] = np.minimum(stem[around[-1] :], at)
    stem[around] = at
    return axes.with_square(square)


def breast_height(axes: Axes, measured: Measured, noise: float, ground_z: float) -> Trunk:
    """Diameter of the stem 1.3 m above the ground, with its 90 % interval and arc.

    Measured from the points of the slice where they support a cylinder; else read off the model
    there, as propagated.

    Parameters
    ----------
    axes : Axes
        With the final radii; branch 0 is the stem.
    measured : Measured
        Points by branch, windows and radii.
    noise : float
        Range noise, metres.
    ground_z : float
        Height of the ground, relative to the origin.
    """
    stem = slice(int(axes.first[0]), int(axes.first[1]))
    height = axes.xyz[stem, 2] - ground_z
    above = np.flatnonzero(height >= BREAST_M)
    if not len(above):
        return Trunk(None, None, None, 0.0, None, ground_z)
    at = int(above[0])
    low = max(at - 1, 0)
    run = height[at] - height[low]
    share = float(np.clip((BREAST_M - height[low]) / run, 0, 1)) if run > 0 else 1.0
    centre = axes.xyz[low] + share * (axes.xyz[at] - axes.xyz[low])
    radius = float(axes.radius[low] + share * (axes.radius[at] - axes.radius[low]))
    shared, radii = measured.shared, measured.radii
    points = shared.xyz[shared.first[0] : shared.first[1]]
    off = np.abs(points[:, 2] - ground_z - BREAST_M)
    for tall in SLICES_M:
        slab = points[off <= tall / 2]
        if len(slab) < LEAST_POINTS:
            continue
        found = estimate_window(slab, centre, axes.frames()[at], radius, noise)
        kind, _, _, square, variance, _, spread, arc, sure, _, _ = found
        agrees = abs(np.sqrt(max(square, 0.0)) - radius) < 0.3 * max(radius, 0.02)
        sound = kind == CYLINDER and sure > LEAST_EVIDENCE and agrees
        if sound and (variance <= (2.0 * SHARP * square) ** 2 or tall == SLICES_M[-1]):
            return _measured(float(np.sqrt(square)), float(variance), float(spread), float(arc), ground_z)
    arc = float(np.degrees(measured.windows.arc[at])) if radii.source[at] == MEASURED else 0.0
    lo, hi = _interval(radius, float(radii.error[at]), int(radii.source[at]))
    return Trunk(2 * radius, lo, hi, arc, RADIUS_SOURCES[int(radii.source[at])], ground_z)


def _interval(radius: float, error: float, source: int) -> tuple[float, float]:
    """90 % interval of the diameter; on a logarithmic scale where only allometry knows it."""
    if source == ALLOMETRIC:
        factor = float(np.exp(WITHIN_90 * LOG_ERROR))
        return 2 * radius / factor, 2 * radius * factor
    error = max(error, GUESS * radius if source == PROPAGATED else 0.0)
    return 2 * max(radius - WITHIN_90 * error, 0.0), 2 * (radius + WITHIN_90 * error)


def _measured(radius: float, variance: float, spread: float, arc: float, ground_z: float) -> Trunk:
    """A trunk from a fitted slice; the error holds the fit's, the bark's and the stem's roundness."""
    fit = variance / (4.0 * radius * radius)
    error = np.sqrt(fit + (OUT_OF_ROUND * radius) ** 2 + (0.1 * spread) ** 2)
    low, high = 2 * (radius - WITHIN_90 * error), 2 * (radius + WITHIN_90 * error)
    return Trunk(2 * radius, float(low), float(high), float(np.degrees(arc)), "measured", ground_z)
