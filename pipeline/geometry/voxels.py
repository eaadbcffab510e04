"""Cells of a regular grid: which points share one, and sums over the neighbours within a ball."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


# Coordinates come in steps of 1e-7 m: cell faces between the steps leave no point to chance.
OFF_GRID_M = 3.7e-8


def cell_keys(xyz: Floats, size: Floats | float) -> Ints:
    """One integer per point, equal for the points of one grid cell (of side `size`, metres)."""
    side = size[:, None] if isinstance(size, np.ndarray) else size
    cell = np.floor((xyz + OFF_GRID_M) / side).astype(np.int64)
    cell -= cell.min(axis=0)
    return np.asarray((cell[:, 0] << 42) | (cell[:, 1] << 21) | cell[:, 2])


def first_in_cell(xyz: Floats, size_m: float) -> Ints:
    """Positions of the first point of every cell, in the order of the points.

    Parameters
    ----------
    xyz : (P, 3) array
        Points in metres, in canonical order (so that "first" means something).
    size_m : float
        Side of a cell.
    """
    _, first = np.unique(cell_keys(xyz, size_m), return_index=True)
    return np.sort(first)


def cell_means(xyz: Floats, size_m: float) -> Floats:
    """(C, 3) mean of the points of every cell, in the order of the cells.

    Unlike the first of them it hardly moves when the points do.

    Parameters
    ----------
    xyz : (P, 3) array
        Metres.
    size_m : float
        Side of a cell.
    """
    return cells_with_means(xyz, size_m)[1]


def cells_with_means(xyz: Floats, size_m: float) -> tuple[Ints, Floats]:
    """Number the cells that hold points.

    Parameters
    ----------
    xyz : (P, 3) array
        Metres.
    size_m : float
        Side of a cell.

    Returns
    -------
    cell : (P,) array of int
        The cell of every point.
    mean : (C, 3) array
        The mean of the points of every cell.
    """
    keys = cell_keys(xyz, size_m)
    order = np.argsort(keys, kind="stable")
    is_next = np.diff(keys[order], prepend=keys[order[:1]]) > 0
    cell = np.empty(len(xyz), dtype=np.int64)
    cell[order] = np.cumsum(is_next)
    count = np.bincount(cell)
    return cell, np.column_stack([np.bincount(cell, column) / count for column in xyz.T])


def ball_moments(xyz: Floats, radius_m: float) -> tuple[Ints, Floats, Floats]:
    """Count, mean and covariance of all points within a ball around every point.

    Parameters
    ----------
    xyz : (P, 3) array
    radius_m : float
        Radius of the ball.

    Returns
    -------
    count : (P,) array of int
        Points in the ball, the centre included.
    mean : (P, 3) array
    covariance : (P, 3, 3) array
        Population covariance in square metres.
    """
    keys = cell_keys(xyz, radius_m)
    order = np.argsort(keys, kind="stable")
    cells, first = np.unique(keys[order], return_index=True)
    last = np.append(first[1:], len(xyz))
    count, mean, cov = _ball_moments(np.ascontiguousarray(xyz[order]), cells, first, last, radius_m)
    back = np.empty_like(order)
    back[order] = np.arange(len(order))
    return count[back], mean[back], cov[back]


@compiled
def _ball_moments(
    xyz: Floats, cells: Ints, first: Ints, last: Ints, radius: float
) -> tuple[Ints, Floats, Floats]:
    total = len(xyz)
    count = np.zeros(total, dtype=np.int64)
    mean = np.zeros((total, 3))
    cov = np.zeros((total, 3, 3))
    near = np.empty(27, dtype=np.int64)
    for c in range(len(cells)):
        found = 0
        for dx in range(-1, 2):
            for dy in range(-1, 2):
                for dz in range(-1, 2):
                    key = cells[c] + (dx << 42) + (dy << 21) + dz
                    at = np.searchsorted(cells, key)
                    if at < len(cells) and cells[at] == key:
                        near[found] = at
                        found += 1
        for i in range(first[c], last[c]):
            _add_ball(i, xyz, near[:found], (first, last), radius, (count, mean, cov))
    return count, mean, cov


@compiled
def _add_ball(
    i: int,
    xyz: Floats,
    near: Ints,
    runs: tuple[Ints, Ints],
    radius: float,
    out: tuple[Ints, Floats, Floats],
) -> None:
    """Moments of the ball around point `i`, whose neighbours lie in the cells `near`."""
    count, mean, cov = out
    n, s0, s1, s2 = 0, 0.0, 0.0, 0.0
    q00, q01, q02, q11, q12, q22 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    limit = radius * radius
    for at in near:
        for j in range(runs[0][at], runs[1][at]):
            a, b, c = xyz[j, 0] - xyz[i, 0], xyz[j, 1] - xyz[i, 1], xyz[j, 2] - xyz[i, 2]
            if a * a + b * b + c * c > limit:
                continue
            n += 1
            s0, s1, s2 = s0 + a, s1 + b, s2 + c
            q00, q01, q02 = q00 + a * a, q01 + a * b, q02 + a * c
            q11, q12, q22 = q11 + b * b, q12 + b * c, q22 + c * c
    count[i] = n
    m0, m1, m2 = s0 / n, s1 / n, s2 / n
    mean[i, 0], mean[i, 1], mean[i, 2] = xyz[i, 0] + m0, xyz[i, 1] + m1, xyz[i, 2] + m2
    cov[i, 0, 0], cov[i, 1, 1], cov[i, 2, 2] = q00 / n - m0 * m0, q11 / n - m1 * m1, q22 / n - m2 * m2
    cov[i, 0, 1] = cov[i, 1, 0] = q01 / n - m0 * m1
    cov[i, 0, 2] = cov[i, 2, 0] = q02 / n - m0 * m2
    cov[i, 1, 2] = cov[i, 2, 1] = q12 / n - m1 * m2
