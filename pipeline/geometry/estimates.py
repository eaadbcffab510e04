"""The estimate of one window: a cylinder where the branch is thick against the noise, else moments."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.geometry.levenberg import fit_cylinder

Floats = NDArray[np.float64]

FEW = 5  # points below which a window says nothing
WIDE = 2.4  # radius / width of the points: an arc of 90 degrees gives 2.3; beyond it the circle is a guess
CLEAR = 2.5  # radii above this many noises are fitted as cylinders, below by moments
SECTORS = 16  # the arc is counted in sectors of 22.5 degrees
NONE, CYLINDER, MOMENTS = 0, 1, 2

# kind, centre (two), square, its variance, the centre's variance, spread, arc, evidence, facing (two)
Estimate = tuple[int, float, float, float, float, float, float, float, float, float, float]


@compiled
def estimate(local: Floats, radius: float, noise: float) -> Estimate:
    """One window: a cylinder where the branch is thick against the noise, else moments."""
    a, b, r, cost = _circle_guess(local, radius)
    if _typical_distance(local) > CLEAR * noise:
        theta = np.array([a, b, 0.0, 0.0, r])
        prior = np.array([1.0 / r, 1.0 / r, 8.0, 8.0, 1.0 / r])
        theta, covariance, scale, good = fit_cylinder(local, theta, prior, noise)
        width = _width(local)
        off = np.sqrt((theta[0] - local[:, 0].mean()) ** 2 + (theta[1] - local[:, 1].mean()) ** 2)
        if good and noise < theta[4] < WIDE * width and off < 2.0 * width:
            misfit, arc, sure, p, q = _shell(local, theta)
            blur = max(noise, min(misfit, 0.5 * theta[4]))  # a circle through noise is too wide by its square
            square = theta[4] * theta[4] - blur * blur
            variance = 4.0 * square * noise * noise * covariance[4, 4]
            if scale > CLEAR * noise + 0.003:
                variance += scale**4
            middle = 0.5 * (covariance[0, 0] + covariance[1, 1]) * scale * scale
            return CYLINDER, theta[0], theta[1], square, variance, middle, misfit, arc, sure, p, q
    return _moments(local, radius, noise, cost)


@compiled
def _typical_distance(local: Floats) -> float:
    """Median distance of the points from their own middle line, in metres."""
    x, y = local[:, 0] - np.median(local[:, 0]), local[:, 1] - np.median(local[:, 1])
    return float(np.median(np.sqrt(x * x + y * y)))


@compiled
def _width(local: Floats) -> float:
    """Root mean square distance from the points' own mean line, in metres."""
    return float(np.sqrt(np.var(local[:, 0]) + np.var(local[:, 1])))


@compiled
def _ramp(value: float, zero: float, one: float) -> float:
    return min(max((value - zero) / (one - zero), 0.0), 1.0)


@compiled
def _shell(local: Floats, theta: Floats) -> tuple[float, float, float, float, float]:
    """Misfit, covered arc, evidence and facing of a fitted cylinder.

    Bark lies on the surface, all round or on one side, and leaves the inside empty; leaves and
    bundles of twigs fill it.
    """
    x = local[:, 0] - theta[0] - theta[2] * local[:, 2]
    y = local[:, 1] - theta[1] - theta[3] * local[:, 2]
    away = np.sqrt(x * x + y * y)
    spread = np.median(np.abs(away - theta[4]))
    # five unknowns are fitted, of which a dozen points leave little
    misfit = 1.4826 * spread * np.sqrt(len(local) / max(len(local) - 5.0, 0.75 * len(local)))
    arc = _arc(local, theta)
    inner = (away < 0.5 * theta[4]).sum() / len(local)
    sure = _ramp(spread / theta[4], 0.28, 0.15) * _ramp(arc / (2.0 * np.pi), 0.2, 0.4)
    sure *= _ramp(float(len(local)), 8.0, 20.0) * _ramp(inner, 0.20, 0.08)
    away = np.maximum(away, 1e-9)
    return misfit, arc, sure, (x / away).mean(), (y / away).mean()


@compiled
def _circle_guess(local: Floats, radius: float) -> tuple[float, float, float, float]:
    """Pick the better of the present circle and an algebraic one: centre, radius, cost.

    References
    ----------
    Kasa (1976) for the algebraic circle; the better one has the smaller median misfit.
    """
    x, y = local[:, 0], local[:, 1]
    away = np.sqrt(x * x + y * y)
    r = radius if radius > 0.0 else np.median(away)
    best = np.median(np.abs(away - r))
    a, b = 0.0, 0.0
    mx, my = x.mean(), y.mean()
    u, v = x - mx, y - my
    suu, svv, suv = (u * u).sum(), (v * v).sum(), (u * v).sum()
    det = suu * svv - suv * suv
    if det > 1e-9 * (suu + svv) ** 2 and det > 0.0:
        p, q = 0.5 * (u * (u * u + v * v)).sum(), 0.5 * (v * (u * u + v * v)).sum()
        cu, cv = (p * svv - q * suv) / det, (q * suu - p * suv) / det
        radius_now = np.sqrt(cu * cu + cv * cv + (suu + svv) / len(local))
        misfit = np.median(np.abs(np.sqrt((u - cu) ** 2 + (v - cv) ** 2) - radius_now))
        limit = 2.0 * max(np.sqrt((suu + svv) / len(local)), r)
        if misfit < best and radius_now < limit:
            a, b, r, best = mx + cu, my + cv, radius_now, misfit
    return a, b, r, best


@compiled
def _arc(local: Floats, theta: Floats) -> float:
    """Part of the circle, in radians, that holds points near the surface."""
    seen = np.zeros(SECTORS)
    for i in range(len(local)):
        x = local[i, 0] - theta[0] - theta[2] * local[i, 2]
        y = local[i, 1] - theta[1] - theta[3] * local[i, 2]
        if abs(np.sqrt(x * x + y * y) - theta[4]) < 0.4 * theta[4]:
            seen[int((np.arctan2(y, x) + np.pi) / (2.0 * np.pi) * SECTORS) % SECTORS] = 1.0
    return float(seen.sum() * 2.0 * np.pi / SECTORS)


@compiled
def _moments(local: Floats, radius: float, noise: float, guess: float) -> Estimate:
    """Mean line and mean square distance of a thin branch's points, far ones left out.

    Points that spread less than the branch is thick are a patch of it: its middle lies a radius off,
    on a side that they do not tell.
    """
    line = np.array([np.median(local[:, 0]), np.median(local[:, 1]), 0.0, 0.0])
    total, kept = 0.0, len(local)
    for number in range(4):
        x = local[:, 0] - line[0] - line[2] * local[:, 2]
        y = local[:, 1] - line[1] - line[3] * local[:, 2]
        away = np.sqrt(x * x + y * y)
        near = away <= 3.0 * max(np.median(away), noise)
        kept = int(near.sum())
        if kept < FEW:
            return NONE, 0.0, 0.0, 0.0, np.inf, np.inf, guess, 0.0, 0.0, 0.0, 0.0
        if number < 3:
            line = _mean_line(local, near)
        else:
            total = (away[near] ** 2).sum()
    mean_square = total / (kept - 2)  # a line in space takes two points' worth of each direction
    square = mean_square - 2.0 * noise * noise
    likely = max(square, noise * noise)
    variance = (4.0 * likely * noise * noise + 4.0 * noise**4) / kept + (0.1 * likely) ** 2
    theta = np.array([line[0], line[1], line[2], line[3], np.sqrt(max(mean_square, 1e-12))])
    # a spread that noise explains is wood; a wider one may be anything
    sure = _ramp(float(kept), 8.0, 20.0) * _ramp(np.sqrt(mean_square), 5.0 * noise, 3.5 * noise)
    spread = np.sqrt(mean_square)
    centre = mean_square / kept + max(radius - spread, 0.0) ** 2
    return MOMENTS, line[0], line[1], square, variance, centre, spread, _arc(local, theta), sure, 0.0, 0.0


@compiled
def _mean_line(local: Floats, near: NDArray[np.bool_]) -> Floats:
    """Least-squares line through the chosen points: offset and slope across the third axis."""
    n, st, stt = 0.0, 0.0, 0.0
    sx, sy, sxt, syt = 0.0, 0.0, 0.0, 0.0
    for i in range(len(local)):
        if near[i]:
            x, y, t = local[i, 0], local[i, 1], local[i, 2]
            n, st, stt = n + 1.0, st + t, stt + t * t
            sx, sy, sxt, syt = sx + x, sy + y, sxt + x * t, syt + y * t
    spread = stt - st * st / n
    p = (sxt - sx * st / n) / spread if spread > 1e-9 else 0.0
    q = (syt - sy * st / n) / spread if spread > 1e-9 else 0.0
    return np.array([(sx - p * st) / n, (sy - q * st) / n, p, q])
