"""The diameter at breast height: a cylinder through the bark around 1.3 m above the ground."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.cylinders.allometry import WITHIN_90, allometric_interval
from pipeline.cylinders.measured import Measured
from pipeline.cylinders.radii import GUESS
from pipeline.geometry.axes import Axes
from pipeline.geometry.estimates import CYLINDER
from pipeline.geometry.noise import ROBUST
from pipeline.geometry.windows import estimate_window
from pipeline.model import ALLOMETRIC, MEASURED, PROPAGATED, RADIUS_SOURCES, Trunk

Floats = NDArray[np.float64]

BREAST_M = 1.3
SLICES_M = (0.10, 0.15, 0.20)  # heights of the slice; as short as the points allow
NEIGHBOURS_M = (-0.45, -0.30, -0.15, 0.0, 0.15, 0.30, 0.45)  # slices that show how even the stem is,
NEIGHBOUR_M = 0.15  # and how tall they are
SHARP = 0.005  # standard error, as a share of the radius, with which a slice is long enough
LEAST_POINTS = 12
STRANGE = 0.4  # a slice whose radius differs from the stem's by this share is something else
LEAST_TRUST = 0.05
LEAST_SEEN = 0.5  # share of the stem around breast height that is measured where a slice of it is
BESIDE = 0.15  # least standard error, as a share, of a diameter that is measured beside breast height only
POOLED_M = 1.0  # below and above breast height, whose windows tell of the diameter where the slice cannot;
WINDOWS_POOLED = 4.0  # so many of them share no points
STRAY = 2.0  # as much less sure is a diameter where most of those windows do not show the bark
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

    Measured from the points of the slice where they support a cylinder; else read off the model.
    Where next to no point shows the bark at that height, it is propagated from what is measured
    above and below.

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
    source, error = int(measured.radii.source[at]), float(measured.radii.error[at])
    shared = measured.shared
    points = shared.xyz[shared.first[0] : shared.first[1]]
    points = points[np.abs(points[:, 2] - ground_z - BREAST_M) <= SLICES_M[-1] / 2]
    off = np.abs(points[:, 2] - ground_z - BREAST_M)
    best = _Slice(0.0, 0.0, 0.0)
    bark = _bark_shows(axes, measured, ground_z)
    for tall in SLICES_M if bark else ():
        best = _slice(points[off <= tall / 2], centre, axes.frames()[at], radius, noise)
        if 0.0 < best.error <= SHARP * best.radius:
            break
    if best.error == 0.0:
        if source == MEASURED and (len(points) < LEAST_POINTS or not bark):
            error = _pooled_error(axes, measured, ground_z) * (1.0 if bark else STRAY)
            source, error = PROPAGATED, max(error, BESIDE * radius)
        elif source == PROPAGATED:
            error = max(error, GUESS * radius)
        arc = float(np.degrees(measured.windows.arc[at])) if source == MEASURED else 0.0
        lo, hi = _interval(radius, error, source)
        if source == PROPAGATED:
            hi = max(hi, 2.0 * _foot(axes, measured, ground_z))
        return Trunk(2 * radius, lo, hi, arc, RADIUS_SOURCES[source], ground_z)
    # the slice says most where it is sharp, the stem as a whole where it is not
    if source != MEASURED:
        error = max(error, GUESS * radius)
    weight = np.array([best.error**-2.0, max(error, 0.01 * radius) ** -2.0])
    radius = float(weight @ [best.radius, radius] / weight.sum())
    uneven = max(OUT_OF_ROUND, _unevenness(axes, measured, noise, ground_z))
    within = WITHIN_90 * float(np.sqrt(1.0 / weight.sum() + (uneven * radius) ** 2))
    lo, hi = 2 * max(radius - within, 0.0), 2 * (radius + within)
    return Trunk(2 * radius, lo, hi, best.arc_deg, "measured", ground_z)


def _bark_shows(axes: Axes, measured: Measured, ground_z: float) -> bool:
    """Whether a slice may be asked: a ring is bark where half of the stem around it is measured."""
    stem = slice(int(axes.first[0]), int(axes.first[1]))
    near = np.abs(axes.xyz[stem, 2] - ground_z - BREAST_M) <= NEIGHBOURS_M[-1]
    seen = measured.radii.source[stem] == MEASURED
    return bool(near.any() and seen[near].mean() >= LEAST_SEEN)


def _pooled_error(axes: Axes, measured: Measured, ground_z: float) -> float:
    """Standard error of a radius that is pooled over the stem below and above breast height, metres."""
    stem = slice(int(axes.first[0]), int(axes.first[1]))
    near = np.abs(axes.xyz[stem, 2] - ground_z - BREAST_M) <= POOLED_M
    return float(np.sqrt(np.mean(measured.radii.error[stem][near] ** 2) / WINDOWS_POOLED))


def _foot(axes: Axes, measured: Measured, ground_z: float) -> float:
    """Radius of the bark that shows between ground and breast height, 0 where none does; metres.

    Where nothing tells how fast the stem tapers from there, it may not have done so at all.
    """
    stem, windows = slice(int(axes.first[0]), int(axes.first[1])), measured.windows
    shown = (windows.kind[stem] == CYLINDER) & (windows.evidence[stem] > 0.5)
    shown &= axes.xyz[stem, 2] - ground_z < BREAST_M
    square = windows.square[stem][shown]
    return float(np.sqrt(max(np.quantile(square, 0.75), 0.0))) if len(square) >= 3 else 0.0


def _unevenness(axes: Axes, measured: Measured, noise: float, ground_z: float) -> float:
    """Robust spread of the radii of slices near breast height about the stem's own, as a share."""
    stem, shared = slice(int(axes.first[0]), int(axes.first[1])), measured.shared
    height, ways = axes.xyz[stem, 2] - ground_z - BREAST_M, axes.frames()
    points = shared.xyz[shared.first[0] : shared.first[1]]
    off = points[:, 2] - ground_z - BREAST_M
    ratios = []
    for away in NEIGHBOURS_M:
        node = stem.start + int(np.argmin(np.abs(height - away)))
        near = points[np.abs(off - away) <= NEIGHBOUR_M / 2]
        if len(near) < LEAST_POINTS:
            continue
        radius = float(axes.radius[node])
        found = estimate_window(near, axes.xyz[node], ways[node], radius, noise)
        if found[0] == CYLINDER:
            ratios.append(np.sqrt(max(found[3], 0.0)) / max(radius, 1e-3))
    if len(ratios) < 3:
        return 0.0
    return ROBUST * float(np.median(np.abs(ratios - np.median(ratios))))


class _Slice(NamedTuple):
    """A circle through the slice at breast height; error 0 where the points support none."""

    radius: float
    error: float
    arc_deg: float


def _slice(points: Floats, centre: Floats, way: Floats, radius: float, noise: float) -> _Slice:
    """Fit a slice; what disagrees with the stem around it counts for less."""
    if len(points) < LEAST_POINTS:
        return _Slice(0.0, 0.0, 0.0)
    found = estimate_window(points, centre, way, radius, noise)
    kind, _, _, square, variance, _, spread, arc, sure, _, _ = found
    r = float(np.sqrt(max(square, 0.0)))
    strange = abs(r - radius) / max(radius, 0.02)
    trust = sure * float(np.clip((STRANGE - strange) / (STRANGE / 2), 0.0, 1.0))
    if kind != CYLINDER or trust <= LEAST_TRUST:
        return _Slice(0.0, 0.0, 0.0)
    square_error = variance / (4.0 * r * r) + (0.1 * spread) ** 2 / len(points) ** 0.5
    return _Slice(r, float(np.sqrt(square_error / trust)), float(np.degrees(arc)))


def _interval(radius: float, error: float, source: int) -> tuple[float, float]:
    """90 % interval of the diameter; on a logarithmic scale where only allometry knows it."""
    if source == ALLOMETRIC:
        return allometric_interval(2 * radius)
    return 2 * max(radius - WITHIN_90 * error, 0.0), 2 * (radius + WITHIN_90 * error)
