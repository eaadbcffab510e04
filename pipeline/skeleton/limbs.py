"""The thick limbs, found first: where cylinders hold, slices of the surface are not asked."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.geometry.axes import Axes, axes_of_paths
from pipeline.geometry.branching import continue_branches
from pipeline.geometry.estimates import CYLINDER
from pipeline.geometry.noise import range_noise
from pipeline.geometry.numbering import number_by_paths
from pipeline.geometry.smoothing import falling, whittaker
from pipeline.geometry.voxels import cell_means, first_in_cell
from pipeline.geometry.windows import Windows, measure, share_out
from pipeline.skeleton.chains import keep_chains
from pipeline.skeleton.levels import distances, joined_neighbours, slice_points
from pipeline.skeleton.rooted import Rooted

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

COARSE_M = 0.04  # points of the coarse pass
SLICE_M = 0.12  # its slices
STEP_M = 0.10  # nodes of a limb
POINTS_M = 0.015  # points that cylinders are fitted to
ROUNDS = 3
FIRST_NOISE_M = 0.003
BEARS = 3  # nodes up to a limb's foot: the wood that bears it
STOUTER = (1.2, 1.0)  # radii of that wood which no limb has, and which any may have


@dataclass(frozen=True, eq=False)
class Limbs:
    """The thick part of a tree.

    Parameters
    ----------
    axes : Axes or None
        Accepted limbs with radii; None where there are none.
    noise : float
        Range noise, metres.
    root : (3,) array
        Foot of the stem, as well as the coarse pass knows it.
    """

    axes: Axes | None
    noise: float
    root: Floats


def find_base(xyz: Floats, reach_m: float) -> int:
    """Return the point at the foot of the stem.

    Every low point is asked how many levels of the next metres above it hold points nearby; the
    lowest point of the place with the most levels is the base. A lone low point has none.

    Parameters
    ----------
    xyz : (P, 3) array
        Thinned points.
    reach_m : float
        How far from a point's column others count, metres.
    """
    z = xyz[:, 2]
    height = float(np.ptp(z))
    low = np.flatnonzero(z <= z.min() + max(0.06 * height, 0.3))
    rise = max(0.15 * height, 0.5)
    column = np.flatnonzero(z <= z[low].max() + rise)
    tree = cKDTree(xyz[column, :2])
    level = np.floor((z[column] - z.min()) / (rise / 12)).astype(np.int64)
    asked = low[first_in_cell(xyz[low], reach_m / 3)]
    votes = np.zeros(len(asked))
    for number, near in enumerate(tree.query_ball_point(xyz[asked, :2], reach_m)):
        votes[number] = np.count_nonzero(np.bincount(level[near])) + 0.5 * len(near) / len(column)
    best = asked[np.argmax(votes)]
    near = low[np.linalg.norm(xyz[low, :2] - xyz[best, :2], axis=1) <= reach_m]
    return int(near[np.lexsort((near, z[near]))[0]])


def find_limbs(xyz: Floats, *, neighbours: int, window_m: float) -> Limbs:
    """Fit cylinders to a coarse skeleton and keep the starts of branches where they hold.

    Parameters
    ----------
    xyz : (P, 3) array
        Points in canonical order, metres.
    neighbours : int
        Of the coarse graph.
    window_m : float
        Length over which directions are taken at forks, metres.
    """
    coarse = cell_means(xyz, COARSE_M)
    base = find_base(coarse, 0.3)
    tree = _coarse_tree(coarse, base, neighbours)
    if len(tree.parent) < 3:
        return Limbs(None, FIRST_NOISE_M, coarse[base])
    thickness = np.maximum(tree.thickness, 0.005)
    ahead = continue_branches(tree.xyz, tree.parent, thickness, max(window_m, 0.3))
    order = number_by_paths(tree.parent, ahead)
    axes = axes_of_paths(tree.xyz, tree.parent, order, np.zeros(len(order)), STEP_M)
    points, noise = xyz[first_in_cell(xyz, POINTS_M)], FIRST_NOISE_M
    for number in range(ROUNDS):
        windows = measure(axes, share_out(points, axes), noise, STEP_M)
        noise = range_noise(windows, range_noise(windows, noise), among=axes.branch == 0)
        axes = _adjust(axes, windows, noise)
        if number < ROUNDS - 1:
            axes = Axes(axes.xyz, axes.first, axes.foot, np.maximum(axes.square, 0.0))
    return Limbs(_accept(axes, windows, noise), noise, coarse[base])


def _coarse_tree(xyz: Floats, base: int, neighbours: int) -> Rooted:
    _, pairs = joined_neighbours(xyz, neighbours)
    way = distances(xyz, pairs, np.array([base]), np.zeros(1))
    slices = slice_points(xyz, pairs, way, SLICE_M, np.zeros(len(xyz), dtype=bool))
    tree = Rooted(slices.xyz, slices.parent, slices.thickness, slices.support)
    none = np.zeros(len(slices.xyz), dtype=bool)
    return keep_chains(tree, none, np.full(len(none), np.inf), 2 * COARSE_M, (0.3, 3))


def _adjust(axes: Axes, windows: Windows, noise: float) -> Axes:
    """Move the nodes to the fitted centres and smooth the squared radii along every branch."""
    score = _score(windows, axes.square, noise, axes.branch == 0)
    weight = np.maximum(score, 0.02)
    goal = axes.xyz + windows.shift * (score > 0)[:, None]
    xyz, square = axes.xyz.copy(), np.zeros(len(axes.xyz))
    for b in range(len(axes.foot)):
        run = slice(int(axes.first[b]), int(axes.first[b + 1]))
        xyz[run] = whittaker(goal[run], weight[run], 1.0)
        value = np.where(score[run] > 0, windows.square[run], 0.0)
        if (score[run] > 0).any():
            mean = float(np.average(value, weights=score[run] + 1e-12))
            square[run] = falling(np.where(score[run] > 0, value, mean), score[run] + 1e-3)
    return Axes(xyz, axes.first, axes.foot, square)


def _score(windows: Windows, smooth: Floats, noise: float, stem: NDArray[np.bool_]) -> Floats:
    """0 to 1: how well a cylinder holds in every window, softly; a stem may be noisier than a limb."""
    r = np.sqrt(np.maximum(windows.square, 1e-12))
    limit = np.minimum(np.maximum(2.4 * noise, 0.12 * r), np.where(stem, 0.28, 0.22) * r)
    score = _ramp(windows.arc / (2 * np.pi), 0.22, 0.44) * _ramp(windows.spread / limit, 1.3, 0.8)
    score *= _ramp(np.where(stem, 1.3, 1.0) * r / noise, 3.0, 5.0)
    score *= _ramp(r, 0.03, 0.05) * _ramp(windows.count, 8, 16)
    expected = np.sqrt(np.maximum(smooth, 0.0))
    agrees = np.where(expected > 0, _ramp(np.abs(r - expected) / np.maximum(expected, 1e-9), 0.5, 0.2), 1.0)
    return np.asarray(score * agrees * (windows.kind == CYLINDER))


def _borne(axes: Axes, windows: Windows) -> Floats:
    """(M,) 0 to 1: whether the wood below a limb's foot is as stout as the limb's windows are."""
    bearing, parent = np.full(len(axes.foot), np.inf), axes.parent_branch
    for b in range(1, len(axes.foot)):
        low = max(int(axes.first[parent[b]]), int(axes.foot[b]) - BEARS)
        bearing[b] = axes.square[low : int(axes.foot[b]) + 1].max()
    share = np.maximum(windows.square, 0.0) / np.maximum(bearing[axes.branch], 1e-9)
    return _ramp(np.sqrt(share), *STOUTER)


def _ramp(value: NDArray[Any], zero: float, one: float) -> Floats:
    """0 up to `zero`, 1 from `one` on, straight between (either may be the larger)."""
    return np.asarray(np.clip((value - zero) / (one - zero), 0.0, 1.0))


def _accept(axes: Axes, windows: Windows, noise: float) -> Axes | None:
    """Keep of every branch the start that is best explained by cylinders, if it is long enough.

    No limb is stouter than the wood that bears it: a cylinder that is holds two limbs side by side.
    """
    gain = _score(windows, axes.square, noise, axes.branch == 0) * _borne(axes, windows) - 0.5
    kept = np.zeros(len(axes.foot), dtype=np.int64)
    parent = axes.parent_branch
    for b in range(len(axes.foot)):
        on_limb = b == 0 or axes.foot[b] - axes.first[parent[b]] < kept[parent[b]]
        total = np.cumsum(gain[int(axes.first[b]) : int(axes.first[b + 1])])
        best = int(np.argmax(total))
        if on_limb and best >= 3 and total[best] > 1.0:
            kept[b] = best + 1
    if not kept.any():
        return None
    nodes = np.concatenate([np.arange(f, f + k) for f, k in zip(axes.first[:-1], kept, strict=True)])
    number = np.full(len(axes.xyz), -1, dtype=np.int64)
    number[nodes] = np.arange(len(nodes))
    limbs = np.flatnonzero(kept)
    first = np.concatenate([[0], np.cumsum(kept[limbs])])
    foot = np.where(axes.foot[limbs] >= 0, number[np.maximum(axes.foot[limbs], 0)], -1)
    return Axes(axes.xyz[nodes], first, foot, axes.square[nodes])
