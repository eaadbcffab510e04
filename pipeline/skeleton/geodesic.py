"""Limbs first, then slices of equal distance along the surface: the method for dense clouds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from pipeline.geometry.axes import Axes
from pipeline.geometry.surface import nearest_tube
from pipeline.geometry.voxels import cell_means
from pipeline.model import PointCloud, Skeleton
from pipeline.options import Options
from pipeline.skeleton.chains import INSIDE, keep_chains
from pipeline.skeleton.levels import Slices, distances, gabriel, joined_neighbours, slice_points
from pipeline.skeleton.limbs import Limbs, find_base, find_limbs
from pipeline.skeleton.rooted import Rooted, skeleton_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class GeodesicOptions(Options):
    """Options of the geodesic skeleton."""

    fine_m: float = Field(0.012, gt=0, le=1, description="points are thinned to this spacing, metres")
    fine_neighbours: int = Field(6, ge=3, le=64, description="neighbours per point")
    slice_m: float = Field(0.03, gt=0, le=1, description="least thickness of a slice, metres")
    entry_share: float = Field(
        0.5, ge=0, le=1, description="cost of a way along a limb, against one along the surface"
    )
    margin_m: float = Field(0.01, ge=0, le=1, description="how far a chain reaches out of kept wood, metres")
    min_chain_m: float = Field(0.04, ge=0, le=10, description="least length of a chain, metres")
    min_chain_points: int = Field(2, ge=1, description="least points of a chain outside kept wood")
    direction_window_m: float = Field(
        0.2, gt=0, le=5, description="length over which a branch's direction is taken at a fork, metres"
    )


def by_geodesic(cloud: PointCloud, options: GeodesicOptions) -> Skeleton:
    """Extract a skeleton by limbs and level sets.

    Parameters
    ----------
    cloud : PointCloud
        A cleaned cloud of one tree, in canonical order.
    options : GeodesicOptions

    Returns
    -------
    Skeleton
        Numbered path by path.
    """
    limbs = find_limbs(cloud.xyz, neighbours=options.fine_neighbours, window_m=options.direction_window_m)
    points = cell_means(cloud.xyz, options.fine_m)
    slices, entry, limb_nodes = _slices(points, limbs, options)
    tree, is_limb = _join(slices.less_noise(limbs.noise), entry, limb_nodes)
    clear = _clear_of_limbs(tree.xyz, limbs.axes)
    margin = options.margin_m + 2.0 * limbs.noise
    tree = keep_chains(tree, is_limb, clear, margin, (options.min_chain_m, options.min_chain_points))
    skeleton = skeleton_of(tree, cloud, options.direction_window_m)
    known = {**skeleton.metadata, "noise_m": limbs.noise}
    return Skeleton(skeleton.xyz, skeleton.parent, skeleton.origin, skeleton.crs, known)


def _slices(points: Floats, limbs: Limbs, options: GeodesicOptions) -> tuple[Slices, Ints, Rooted | None]:
    """Slices of all that no limb claims; where each chain enters a limb; the limbs' own nodes."""
    near, pairs = joined_neighbours(points, options.fine_neighbours)
    spacing = float(np.median(np.linalg.norm(points - points[near[:, 0]], axis=1)))
    lean = gabriel(points, near, pairs)
    claimed, node, cost = _claim(points, limbs, options.entry_share)
    sources = np.flatnonzero(claimed)
    if not len(sources):
        sources, cost = np.array([find_base(points, 0.3)]), np.zeros(len(points))
    way = distances(points, lean, sources, cost[sources])
    slices = slice_points(points, pairs, way, max(options.slice_m, 2.0 * spacing), claimed)
    entry = np.where(slices.source >= 0, node[np.maximum(slices.source, 0)], -1)
    return slices, entry, None if limbs.axes is None else _limb_tree(limbs.axes)


def _claim(points: Floats, limbs: Limbs, share: float) -> tuple[NDArray[np.bool_], Ints, Floats]:
    """Points on or in a limb, the limb node nearest to each, and their cost to start from."""
    count = len(points)
    if limbs.axes is None:
        return np.zeros(count, dtype=bool), np.full(count, -1, dtype=np.int64), np.zeros(count)
    tubes, end = limbs.axes.tubes()
    near = nearest_tube(points, tubes)
    radius = near.axial - near.surface
    claimed = near.surface <= np.maximum(4.0 * limbs.noise, 0.15 * radius) + 0.002
    at = end[near.segment]
    node = np.where(near.share < 0.5, at - 1, at)
    length = np.linalg.norm(tubes.end - tubes.start, axis=1)
    arc = _arc_from_root(limbs.axes)
    cost = arc[at] - (1.0 - near.share) * length[near.segment]
    return claimed, node, share * np.maximum(cost, 0.0)


def _arc_from_root(axes: Axes) -> Floats:
    """(M,) length of the way from the root to every node, along the axes."""
    arc = np.zeros(len(axes.xyz))
    for b in range(len(axes.foot)):
        low, high = int(axes.first[b]), int(axes.first[b + 1])
        step = np.linalg.norm(np.diff(axes.xyz[low:high], axis=0), axis=1)
        begin = arc[axes.foot[b]] if b else 0.0
        arc[low:high] = begin + np.concatenate([[0.0], np.cumsum(step)])
    return arc


def _limb_tree(axes: Axes) -> Rooted:
    """Limb nodes with their parents (feet are their parents' nodes said twice, and stay)."""
    parent = np.arange(len(axes.xyz)) - 1
    parent[axes.first[:-1]] = axes.foot
    return Rooted(axes.xyz, parent, axes.radius, np.full(len(axes.xyz), 100.0))


def _join(slices: Slices, entry: Ints, limbs: Rooted | None) -> tuple[Rooted, NDArray[np.bool_]]:
    """Put limb nodes and slices into one tree."""
    if limbs is None:
        tree = Rooted(slices.xyz, slices.parent, slices.thickness, slices.support)
        return tree, np.zeros(len(slices.xyz), dtype=bool)
    shift = len(limbs.parent)
    parent = np.where(slices.parent >= 0, slices.parent + shift, np.maximum(entry, 0))
    tree = Rooted(
        np.vstack([limbs.xyz, slices.xyz]),
        np.concatenate([limbs.parent, parent]),
        np.concatenate([limbs.thickness, slices.thickness]),
        np.concatenate([limbs.support, slices.support]),
    )
    return tree, np.arange(len(tree.parent)) < shift


def _clear_of_limbs(xyz: Floats, axes: Axes | None) -> Floats:
    """Distance of every node from 1.25 radii around the nearest limb."""
    if axes is None:
        return np.full(len(xyz), np.inf)
    near = nearest_tube(xyz, axes.tubes()[0])
    return np.asarray(near.axial - INSIDE * (near.axial - near.surface))
