"""Mean-shift centring: bark points move to the axis, with a bandwidth that follows the thickness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.geometry.voxels import ball_moments, first_in_cell

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SUPPORT_SPACING = 5.0  # a ball's own points are thinned to its radius over this
SLENDER = 0.40  # thickness / ball radius: a flat patch gives 0.5, a solid ball 0.63, a line 0
CHANCE = 1.0  # few points look slender by chance: the limit falls by this over the root of their count


@dataclass(frozen=True, eq=False)
class Centred:
    """Points moved to their axes.

    Parameters
    ----------
    xyz : (P, 3) array
        Position on the local axis, in metres.
    thickness : (P,) array
        Root mean square distance from the local axis: the radius, for points on bark all round.
    """

    xyz: Floats
    thickness: Floats


@dataclass(frozen=True, eq=False)
class _Level:
    """Local axes at one ball radius, at the points thinned for it."""

    radius: float
    support: Floats
    mean: Floats
    axis: Floats
    thickness: Floats
    count: Ints


def centre(xyz: Floats, *, spacing_m: float, rounds: int) -> Centred:
    """Move every point across its branch to the branch's local axis.

    For a growing series of balls the points inside are split into a mean, a direction and a
    thickness across it. The first ball that is slender (long against its thickness) shows how
    thick the branch is at that point; a flat-kernel mean-shift step with that bandwidth follows,
    across the axis only, so that branches do not shrink at their ends.

    Parameters
    ----------
    xyz : (P, 3) array
        Points in metres.
    spacing_m : float
        Typical distance between neighbouring points; the smallest ball is four times as large.
    rounds : int
        Mean-shift steps; each starts from the points that the last one moved.

    Returns
    -------
    Centred

    References
    ----------
    Du, Lindenbergh, Ledoux, Stoter & Nan (2019), "AdTree", section 2.2 (one step, one bandwidth
    for the whole tree); here the bandwidth is local and the shift leaves the axial part alone.
    """
    moved, thickness = xyz, np.zeros(len(xyz))
    for number in range(rounds):
        levels = _levels(moved, spacing_m)
        bandwidth = _steady(xyz, _thickness(moved, levels), spacing_m)
        moved = _shift(moved, bandwidth, levels)
        thickness = bandwidth if number == 0 else thickness
    return Centred(moved, thickness)


def _levels(xyz: Floats, spacing_m: float) -> list[_Level]:
    """Local axes in balls of doubling radius, up to a twelfth of the tree."""
    reach = float(np.ptp(xyz, axis=0).max())
    radius, levels = 4.0 * spacing_m, list[_Level]()
    while not levels or radius <= reach / 12:
        support = xyz[first_in_cell(xyz, radius / SUPPORT_SPACING)]
        count, mean, cov = ball_moments(support, radius)
        spread, vectors = np.linalg.eigh(cov)
        across = np.sqrt(np.maximum(spread[:, 0] + spread[:, 1], 0.0))
        levels.append(_Level(radius, support, mean, vectors[:, :, 2], across, count))
        radius *= 2.0
    return levels


def _thickness(xyz: Floats, levels: list[_Level]) -> Floats:
    """Thickness at every point from the smallest slender ball, else from the most slender one."""
    found = np.zeros(len(xyz))
    best = np.full(len(xyz), np.inf)
    for level in levels:
        near = cKDTree(level.support).query(xyz)[1]
        sure = 1.0 - CHANCE / np.sqrt(level.count[near])
        ratio = level.thickness[near] / level.radius / np.maximum(sure, 0.1)
        take = (best >= SLENDER) & (ratio < best)
        found[take] = level.thickness[near[take]]
        best[take] = ratio[take]
    return found


def _steady(xyz: Floats, thickness: Floats, spacing_m: float) -> Floats:
    """Replace each thickness by the median of its neighbours': a chance alignment is outvoted."""
    near = cKDTree(xyz).query(xyz, k=min(24, len(xyz)))[1]
    median = np.median(thickness[near.reshape(len(xyz), -1)], axis=1)
    return np.asarray(np.maximum(median, spacing_m / 4))


def _shift(xyz: Floats, thickness: Floats, levels: list[_Level]) -> Floats:
    """One mean-shift step across the axis, in the ball that suits each point's thickness."""
    radii = np.array([level.radius for level in levels])
    which = np.minimum(np.searchsorted(radii, thickness / SLENDER), len(levels) - 1)
    moved = xyz.copy()
    for number, level in enumerate(levels):
        mine = np.flatnonzero(which == number)
        if not len(mine):
            continue
        near = cKDTree(level.support).query(xyz[mine])[1]
        off = level.mean[near] - xyz[mine]
        axis = level.axis[near]
        across = off - axis * np.einsum("ij,ij->i", off, axis)[:, None]
        far = np.linalg.norm(across, axis=1) > 2.0 * np.maximum(thickness[mine], level.radius / 8)
        moved[mine] += np.where(far[:, None], 0.0, across)
    return moved
