"""Levenberg-Marquardt fits of one cylinder a window, all windows of a tree in one compiled batch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled

Floats = NDArray[np.float64]

TUKEY = 4.685  # 95 % efficient for normal residuals
STEPS = 25
SETTLED = 1e-6  # a step that lowers the cost by a smaller share of it is the last


@compiled
def frame(direction: Floats) -> Floats:
    """Three unit vectors as rows: two across `direction` and `direction` itself."""
    basis = np.zeros((3, 3))
    least = np.argmin(np.abs(direction))
    basis[0, least] = 1.0
    basis[0] -= (basis[0] * direction).sum() * direction
    basis[0] /= np.sqrt((basis[0] * basis[0]).sum())
    basis[1, 0] = direction[1] * basis[0, 2] - direction[2] * basis[0, 1]
    basis[1, 1] = direction[2] * basis[0, 0] - direction[0] * basis[0, 2]
    basis[1, 2] = direction[0] * basis[0, 1] - direction[1] * basis[0, 0]
    basis[2] = direction
    return basis


@compiled
def fit_cylinder(
    local: Floats, theta: Floats, prior: Floats, noise: float
) -> tuple[Floats, Floats, float, bool]:
    """Fit a cylinder to points in the frame of a first guess.

    Minimises ``sum rho(d_i / s) + sum (theta prior)^2 / 2`` over the axis' offset (a, b), its
    tilt (p, q) and the radius r, where d_i is the distance of a point to the cylinder's surface
    and rho Tukey's biweight.

    Parameters
    ----------
    local : (n, 3) array
        Points; the third axis runs along the guessed direction. Metres.
    theta : (5,) array
        First guess of (a, b, p, q, r).
    prior : (5,) array
        Inverse standard deviation of each unknown about zero (of r: about its guess).
    noise : float
        Range noise in metres; the robust scale is not taken below it.

    Returns
    -------
    theta : (5,) array
    covariance : (5, 5) array
        Of the unknowns, for residuals of unit variance.
    spread : float
        Robust standard deviation of the residuals, metres.
    good : bool
        False when the normal equations fail.

    References
    ----------
    Levenberg (1944), Marquardt (1963); Lukacs, Martin & Marshall (1998) for the distance's
    derivatives, which are exact here.
    """
    theta = theta.copy()
    start_radius = theta[4]
    residual = np.empty(len(local))
    jacobian = np.empty((len(local), 5))
    normal = np.zeros((5, 5))
    damping = 1e-3
    _distances(local, theta, residual, jacobian)
    scale = _scale(residual, noise)
    cost = _cost(residual, theta, prior, start_radius, scale)
    for _ in range(STEPS):
        gradient = _normal_equations((residual, jacobian), theta, prior, start_radius, scale, normal)
        damped = normal.copy()
        for k in range(5):
            damped[k, k] *= 1.0 + damping
        step, good = solve(damped, gradient)
        if not good:
            return theta, normal, scale, False
        trial = theta - step
        trial[4] = abs(trial[4])
        _distances(local, trial, residual, jacobian)
        lower = _cost(residual, trial, prior, start_radius, scale)
        if lower <= cost:
            done = cost - lower < SETTLED * cost + 1e-300
            theta, cost, damping = trial, lower, damping * 0.2
            if done and damping < 1e-2:
                break
            scale = _scale(residual, noise)
            cost = _cost(residual, theta, prior, start_radius, scale)
        else:
            damping *= 8.0
            _distances(local, theta, residual, jacobian)
            if damping > 1e8:
                break
    scale = _scale(residual, noise)
    _normal_equations((residual, jacobian), theta, prior, start_radius, scale, normal)
    covariance = np.zeros((5, 5))
    for k in range(5):
        unit = np.zeros(5)
        unit[k] = 1.0
        column, good = solve(normal, unit)
        if not good:
            return theta, normal, scale, False
        covariance[:, k] = column
    return theta, covariance / (scale * scale), scale, True


@compiled
def _distances(local: Floats, theta: Floats, residual: Floats, jacobian: Floats) -> None:
    """Signed distances to the surface, and their derivatives by (a, b, p, q, r)."""
    a, b, p, q, r = theta
    norm = np.sqrt(1.0 + p * p + q * q)
    ux, uy, uz = p / norm, q / norm, 1.0 / norm
    for i in range(len(local)):
        x, y, z = local[i, 0] - a, local[i, 1] - b, local[i, 2]
        t = x * ux + y * uy + z * uz
        dx, dy, dz = x - t * ux, y - t * uy, z - t * uz
        away = np.sqrt(dx * dx + dy * dy + dz * dz)
        residual[i] = away - r
        if away < 1e-12:
            jacobian[i] = 0.0
        else:
            jacobian[i, 0], jacobian[i, 1] = -dx / away, -dy / away
            jacobian[i, 2], jacobian[i, 3] = -t * dx / (away * norm), -t * dy / (away * norm)
        jacobian[i, 4] = -1.0


@compiled
def _scale(residual: Floats, noise: float) -> float:
    """Robust standard deviation of the residuals (median of their sizes), at least the noise."""
    return float(max(1.4826 * np.median(np.abs(residual)), noise))


@compiled
def _cost(residual: Floats, theta: Floats, prior: Floats, start_radius: float, scale: float) -> float:
    limit = TUKEY * scale
    total = 0.0
    for d in residual:
        u = min(abs(d) / limit, 1.0)
        total += 1.0 - (1.0 - u * u) ** 3
    total *= TUKEY * TUKEY / 6.0
    for k in range(4):
        total += 0.5 * (theta[k] * prior[k]) ** 2
    return float(total + 0.5 * ((theta[4] - start_radius) * prior[4]) ** 2)


@compiled
def _normal_equations(
    misfit: tuple[Floats, Floats],
    theta: Floats,
    prior: Floats,
    start_radius: float,
    scale: float,
    normal: Floats,
) -> Floats:
    """Fill `normal` with the weighted J'J and return J'r, both in units of the scale."""
    residual, jacobian = misfit
    normal[:] = 0.0
    gradient = np.zeros(5)
    limit = TUKEY * scale
    for i in range(len(residual)):
        u = abs(residual[i]) / limit
        if u >= 1.0:
            continue
        weight = (1.0 - u * u) ** 2 / (scale * scale)
        for k in range(5):
            gradient[k] += weight * jacobian[i, k] * residual[i]
            for m in range(k + 1):
                normal[k, m] += weight * jacobian[i, k] * jacobian[i, m]
    for k in range(5):
        off = theta[k] - (start_radius if k == 4 else 0.0)
        gradient[k] += off * prior[k] ** 2
        normal[k, k] += prior[k] ** 2
        for m in range(k):
            normal[m, k] = normal[k, m]
    return gradient


@compiled
def solve(matrix: Floats, right: Floats) -> tuple[Floats, bool]:
    """Solve a small symmetric positive definite system by Cholesky's factors."""
    size = len(right)
    low = np.zeros((size, size))
    for i in range(size):
        for j in range(i + 1):
            rest = matrix[i, j]
            for k in range(j):
                rest -= low[i, k] * low[j, k]
            if i == j:
                if not rest > 0.0:
                    return right * 0.0, False
                low[i, i] = np.sqrt(rest)
            else:
                low[i, j] = rest / low[j, j]
    out = np.zeros(size)
    for i in range(size):
        rest = right[i]
        for k in range(i):
            rest -= low[i, k] * out[k]
        out[i] = rest / low[i, i]
    for i in range(size - 1, -1, -1):
        rest = out[i]
        for k in range(i + 1, size):
            rest -= low[k, i] * out[k]
        out[i] = rest / low[i, i]
    return out, True
