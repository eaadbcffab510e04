"""One estimate of centre and radius at every node, from the points in a window along its branch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.cylinders.axes import Axes
from pipeline.cylinders.levenberg import fit_cylinder, frame
from pipeline.geometry.compiled import compiled
from pipeline.geometry.surface import nearest_tube

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ENOUGH = 60  # points that a window grows for
PLENTY = 160  # points beyond which a window is thinned
FEW = 5  # points below which a window says nothing
CLEAR = 2.5  # radii above this many noises are fitted as cylinders, below by moments
SECTORS = 16  # the arc is counted in sectors of 22.5 degrees
NONE, CYLINDER, MOMENTS = 0, 1, 2


@dataclass(frozen=True, eq=False)
class Windows:
    """What the points say at every node.

    Parameters
    ----------
    kind : (M,) array of int
        NONE, CYLINDER or MOMENTS.
    shift : (M, 3) array
        From the node to the estimated centre, in metres.
    square : (M,) array
        Estimated squared radius, noise subtracted; may be negative.
    variance : (M,) array
        Predicted variance of `square` (not from the estimate itself), in m^4.
    centre_variance : (M,) array
        Predicted variance of the centre, in square metres.
    count : (M,) array of int
    spread : (M,) array
        Robust standard deviation of the residuals, in metres.
    arc : (M,) array
        Part of the circle that the points cover, in radians.
    """

    kind: Ints
    shift: Floats
    square: Floats
    variance: Floats
    centre_variance: Floats
    count: Ints
    spread: Floats
    arc: Floats


@dataclass(frozen=True, eq=False)
class Shared:
    """The points shared out to the branches, each sorted along its branch.

    Parameters
    ----------
    xyz : (P, 3) array
    arc : (P,) array
        Position along the branch, in metres from its foot.
    first : (B + 1,) array of int
        Where each branch's points begin, and the end of the last.
    node_arc : (M,) array
        Position of every node along its branch, in metres.
    """

    xyz: Floats
    arc: Floats
    first: Ints
    node_arc: Floats


def share_out(xyz: Floats, axes: Axes) -> Shared:
    """Give every point to the branch whose surface is nearest (at first, whose axis is).

    Parameters
    ----------
    xyz : (P, 3) array
    axes : Axes
    """
    tubes, end = axes.tubes()
    near = nearest_tube(xyz, tubes)
    step = np.linalg.norm(np.diff(axes.xyz, axis=0, prepend=axes.xyz[:1]), axis=1)
    step[axes.first[:-1]] = 0.0
    total = np.cumsum(step)
    node_arc = total - np.repeat(total[axes.first[:-1]], np.diff(axes.first))
    at = end[near.segment]
    arc = node_arc[at] - (1.0 - near.share) * step[at]
    branch = axes.branch[at]
    order = np.lexsort((arc, branch))
    first = np.searchsorted(branch[order], np.arange(len(axes.foot) + 1))
    return Shared(np.ascontiguousarray(xyz[order]), arc[order], first, node_arc)


def measure(axes: Axes, shared: Shared, noise: float, window_m: float) -> Windows:
    """Estimate centre and squared radius at every node.

    Where the branch is thick against the noise, a cylinder is fitted by Levenberg-Marquardt and
    the outward bias of a noisy circle, the noise squared, is taken off. Where it is thin, the mean
    square distance from the local mean line stands for the squared radius, less twice the noise
    squared.

    Parameters
    ----------
    axes : Axes
    shared : Shared
    noise : float
        Range noise (one standard deviation), metres.
    window_m : float
        Least length of a window, metres.
    """
    count = len(axes.xyz)
    out = Windows(
        np.zeros(count, dtype=np.int64),
        np.zeros((count, 3)),
        np.zeros(count),
        np.full(count, np.inf),
        np.full(count, np.inf),
        np.zeros(count, dtype=np.int64),
        np.zeros(count),
        np.zeros(count),
    )
    _measure(
        (axes.xyz, axes.frames(), axes.square, axes.first),
        (shared.xyz, shared.arc, shared.first, shared.node_arc),
        (noise, window_m),
        (out.kind, out.count),
        (out.shift, out.square, out.variance, out.centre_variance, out.spread, out.arc),
    )
    return out


@compiled
def _measure(
    axes: tuple[Floats, Floats, Floats, Ints],
    shared: tuple[Floats, Floats, Ints, Floats],
    settings: tuple[float, float],
    counts: tuple[Ints, Ints],
    out: tuple[Floats, Floats, Floats, Floats, Floats, Floats],
) -> None:
    nodes, directions, squares, first = axes
    points, arcs, begin, node_arc = shared
    noise, window = settings
    kind, count = counts
    shift, square, variance, centre_variance, spread, arc = out
    for b in range(len(first) - 1):
        run = arcs[begin[b] : begin[b + 1]]
        for i in range(first[b], first[b + 1]):
            radius = np.sqrt(max(squares[i], 0.0))
            low, high = _window(run, node_arc[i], max(window, radius), max(3.0 * window, 2.0 * radius))
            count[i] = high - low
            if high - low < FEW:
                continue
            stride = 1 + (high - low) // PLENTY
            basis = frame(directions[i])
            local = _to_frame(points[begin[b] + low : begin[b] + high : stride], nodes[i], basis)
            found = _estimate(local, radius, noise)
            kind[i] = int(found[0])
            shift[i] = found[1] * basis[0] + found[2] * basis[1]
            square[i], variance[i], centre_variance[i] = found[3], found[4], found[5]
            spread[i], arc[i] = found[6], found[7]


@compiled
def _window(run: Floats, at: float, least: float, most: float) -> tuple[int, int]:
    """Positions in `run` within a window around `at` that grows until it holds enough points."""
    half = 0.5 * least
    while True:
        low, high = np.searchsorted(run, at - half), np.searchsorted(run, at + half)
        if high - low >= ENOUGH or half >= 0.5 * most:
            return low, high
        half *= 1.3


@compiled
def _to_frame(points: Floats, centre: Floats, basis: Floats) -> Floats:
    local = np.empty((len(points), 3))
    for i in range(len(points)):
        for k in range(3):
            total = 0.0
            for d in range(3):
                total += (points[i, d] - centre[d]) * basis[k, d]
            local[i, k] = total
    return local


@compiled
def _estimate(
    local: Floats, radius: float, noise: float
) -> tuple[int, float, float, float, float, float, float, float]:
    """Kind, centre (two), square, its variance, the centre's, spread and arc of one window."""
    a, b, r, cost = _circle_guess(local, radius)
    if r > CLEAR * noise:
        theta = np.array([a, b, 0.0, 0.0, r])
        prior = np.array([1.0 / r, 1.0 / r, 8.0, 8.0, 1.0 / r])
        theta, covariance, scale, good = fit_cylinder(local, theta, prior, noise)
        r = theta[4]
        if good and r > CLEAR * noise and np.sqrt(theta[0] ** 2 + theta[1] ** 2) < 3.0 * r:
            square = r * r - noise * noise
            variance = 4.0 * square * noise * noise * covariance[4, 4]
            if scale > CLEAR * noise + 0.003:
                variance += scale**4
            middle = 0.5 * (covariance[0, 0] + covariance[1, 1]) * scale * scale
            return CYLINDER, theta[0], theta[1], square, variance, middle, _misfit(local, theta), _arc(local, theta)
    return _moments(local, noise, cost)


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
    return seen.sum() * 2.0 * np.pi / SECTORS


@compiled
def _misfit(local: Floats, theta: Floats) -> float:
    """Robust standard deviation of the distances to the fitted surface."""
    x = local[:, 0] - theta[0] - theta[2] * local[:, 2]
    y = local[:, 1] - theta[1] - theta[3] * local[:, 2]
    return 1.4826 * np.median(np.abs(np.sqrt(x * x + y * y) - theta[4]))


@compiled
def _moments(
    local: Floats, noise: float, guess: float
) -> tuple[int, float, float, float, float, float, float, float]:
    """Centre and mean square distance of a thin branch's points, far ones left out."""
    a, b = np.median(local[:, 0]), np.median(local[:, 1])
    total, kept = 0.0, len(local)
    for _ in range(4):
        away = np.sqrt((local[:, 0] - a) ** 2 + (local[:, 1] - b) ** 2)
        limit = 3.0 * max(np.median(away), noise)
        sa, sb, total, kept = 0.0, 0.0, 0.0, 0
        for i in range(len(local)):
            if away[i] <= limit:
                sa += local[i, 0]
                sb += local[i, 1]
                total += away[i] * away[i]
                kept += 1
        a, b = sa / kept, sb / kept
    if kept < FEW:
        return NONE, 0.0, 0.0, 0.0, np.inf, np.inf, guess, 0.0
    mean_square = total / (kept - 2)
    square = mean_square - 2.0 * noise * noise
    likely = max(square, noise * noise)
    variance = (4.0 * likely * noise * noise + 4.0 * noise**4) / kept + (0.1 * likely) ** 2
    theta = np.array([a, b, 0.0, 0.0, np.sqrt(max(mean_square, 1e-12))])
    return MOMENTS, a, b, square, variance, mean_square / kept, np.sqrt(mean_square), _arc(local, theta)


@compiled
def estimate_window(
    points: Floats, centre: Floats, direction: Floats, radius: float, noise: float
) -> tuple[int, float, float, float, float, float, float, float]:
    """One window on its own: points around a centre on the axis.

    Returns
    -------
    tuple
        kind, centre shift (two), square, variance of the square, variance of the centre, spread,
        arc; as in `Windows`.
    """
    return _estimate(_to_frame(points, centre, frame(direction)), radius, noise)
