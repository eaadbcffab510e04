"""One tree of a segmented cloud becomes a model: by its bark where it shows a trunk, else by fallback."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.spatial import cKDTree

from pipeline.airborne.fallback import BREAST_M, FallbackOptions, fallback, stem_line
from pipeline.airborne.raster import Raster
from pipeline.airborne.tree import AirborneTree
from pipeline.cloud import CleanOptions, clean
from pipeline.cylinders import CylinderOptions, fit
from pipeline.errors import PipelineError
from pipeline.geometry.voxels import first_in_cell
from pipeline.model import PointCloud, TreeModel
from pipeline.skeleton import SkeletonOptions, extract
from pipeline.skeleton.stem import LEAST_POINTS, SLAB_M, Stem, find_stem

Ints = NDArray[np.int64]

PATCH_M = np.arange(-2.0, 2.5, 1.0)  # where the terrain about the stem's foot is asked for
DECIMALS = 6  # of terrain heights: what is nearer than this is float rounding
MIN_POINTS = 10  # of which more than a stem is made
LITTER_M = 0.3  # what is lower says nothing of a crown
BESIDE_M = 0.3  # from the bark up to which points are the trunk's
UNDER_CROWNS_M = 4.0  # what is higher is some crown's
ABOUT_FOOT_M = 1.5  # from the foot, as far as it is known, to the trunk's points
OTHER_CLASSES = (2, 6, 7, 9, 14, 18, 26)  # ground, buildings, noise, water, wires, structures
THINNEST_M = 0.02  # points closer than this say the same
SLICE_M = 0.2  # of the stem that the diameter is measured in, at most
WIDE = 1.25  # radii from the axis within which points are on the bark
WIDER = 1.25  # step by which cells grow until few enough points are left

FEWEST_CIRCLES = 4  # that tell where a trunk stands

SEEN = ("measured", "propagated")
"""Sources of a diameter that points of the trunk speak for."""

BROKEN = (PipelineError, ValueError, ArithmeticError, LookupError, RuntimeError, MemoryError)
"""What can go wrong with one tree. LinAlgError is a ValueError, QhullError a RuntimeError."""


class ModelOptions(FallbackOptions):
    """How single airborne trees are modelled."""

    least_circles: int = Field(
        6, ge=4, description="circles of bark one above the other that tell how thick a trunk is"
    )
    lowest_share: float = Field(
        0.15, ge=0, le=1, description="share of the height below which the lowest of them must lie"
    )
    most_points: int = Field(
        10_000, ge=100, description="points of a tree above which it is thinned, which bounds its work"
    )


class Stages(NamedTuple):
    """Options of all that is done to one tree."""

    clean: CleanOptions
    skeleton: SkeletonOptions
    cylinders: CylinderOptions
    model: ModelOptions = ModelOptions()


class Modelled(NamedTuple):
    """A tree, what went wrong with it, if anything did, and the points that its diameter is measured from."""

    tree: TreeModel
    error: str | None = None
    bark_points: int = 0


def near_stems(cloud: PointCloud, trees: Sequence[AirborneTree], terrain: Raster) -> list[Ints]:
    """Return for every tree the points about its foot that are no tree's: its trunk may be among them.

    Parameters
    ----------
    cloud : PointCloud
        The cloud that was segmented.
    trees : sequence of AirborneTree
        All of them.
    terrain : Raster
    """
    free = np.ones(len(cloud), dtype=bool)
    for tree in trees:
        free[tree.points] = False
    if "classification" in cloud.attributes:
        free &= ~np.isin(cloud.attributes["classification"], OTHER_CLASSES)
    at = np.flatnonzero(free)
    height = cloud.xyz[at, 2] - terrain.at(cloud.xyz[at, :2])
    at = at[(height > LITTER_M) & (height < UNDER_CROWNS_M)]
    if not len(at) or not trees:
        return [np.zeros(0, dtype=np.int64) for _ in trees]
    bases = np.array([tree.base for tree in trees])
    found = cKDTree(cloud.xyz[at, :2]).query_ball_point(bases, ABOUT_FOOT_M)
    return [at[np.sort(np.asarray(near, dtype=np.int64))] for near in found]


def model_tree(
    cloud: PointCloud,
    tree: AirborneTree,
    terrain: Raster | None,
    *,
    stages: Stages,
    beside: Ints | None = None,
) -> Modelled:
    """Model one tree; whatever happens, there is a model.

    Parameters
    ----------
    cloud : PointCloud
        The cloud that was segmented; its origin has whole metres.
    tree : AirborneTree
    terrain : Raster or None
        None where no ground is known.
    stages : Stages
    beside : (K,) array of int, optional
        Points of `cloud` among which the trunk may be, beside those of the tree (`near_stems`).

    Returns
    -------
    Modelled
        The model from an origin of its own, whole metres near the apex, so that it does not depend on
        what else is in `cloud`. Its flags tell why it is a fallback: `few_points` (too few, or in one
        plane), `no_trunk` (no bark that is sure) or `failed` (no model could be fitted).
    """
    own, alone = by_itself(cloud, tree)
    tidy = _tidied(own, alone, stages.model.most_points)
    if len(tidy) < MIN_POINTS:
        return Modelled(_fallback(tidy, alone, stages, "few_points"))
    try:
        seen = tidy
        if beside is not None and len(beside):
            more = replace(tree, points=np.union1d(tree.points, beside))
            seen = _tidied(by_itself(cloud, more)[0], alone, stages.model.most_points)
        trunk = find_trunk(seen, alone, stages)
        if trunk is not None:
            alone = replace(alone, base=np.round(trunk.xyz[0, :2], DECIMALS))
        if trunk is not None and len(trunk.circles) >= stages.model.least_circles:
            points = _thinned(seen, trunk, stages.model.crown_spacing_m)
            whole = clean(points, _patch(terrain, tree, cloud, own), options=stages.clean)
            fitted = _fitted(whole, alone, stages)
            if fitted.trunk is not None and fitted.trunk.source in SEEN:
                return Modelled(fitted, None, bark_points(fitted, whole))
    except BROKEN as error:
        return Modelled(_fallback(tidy, alone, stages, "failed"), str(error))
    return Modelled(_fallback(tidy, alone, stages, "no_trunk"))


def by_itself(cloud: PointCloud, tree: AirborneTree) -> tuple[PointCloud, AirborneTree]:
    """Return a tree's points and outline from an origin of its own; whole metres shift exactly."""
    shift = np.floor(np.asarray(tree.apex, dtype=np.float64))
    xyz = cloud.xyz[tree.points] - shift
    own = PointCloud(xyz, cloud.origin + shift, cloud.crs, {}, dict(cloud.metadata))
    alone = replace(
        tree,
        points=np.arange(len(xyz)),
        apex=np.asarray(tree.apex) - shift,
        ground_z=round(float(tree.ground_z - shift[2]), DECIMALS),
        base=np.round(np.asarray(tree.base) - shift[:2], DECIMALS),
        crown=np.asarray(tree.crown) - shift[:2],
    )
    return own, alone


def find_trunk(cloud: PointCloud, tree: AirborneTree, stages: Stages) -> Stem | None:
    """Return the trunk where circles of bark stand one above the other, from near the ground upwards.

    Parameters
    ----------
    cloud : PointCloud
        The tree's own points, in canonical order.
    tree : AirborneTree
        From the same origin.
    stages : Stages

    Notes
    -----
    A few circles tell where the trunk stands (on nine surveyed stems to 0.3 m, the apex to 0.8 m), but
    not how thick it is: of simulated scans, three and four gave half the diameter or one and a half
    times as much, and intervals that missed it. Hence `ModelOptions.least_circles`.
    """
    ground, top = float(stem_line(tree)[0][2]), float(cloud.xyz[-1, 2])
    highest = ground + stages.model.lowest_share * (top - ground)
    if np.count_nonzero(cloud.xyz[:, 2] <= highest + SLAB_M[1] / 2) < LEAST_POINTS:
        return None  # no circle can lie so low
    stem = find_stem(cloud.xyz, min(ground, float(cloud.xyz[0, 2])), stages.skeleton.range_noise_m)
    if stem is None or len(stem.circles) < FEWEST_CIRCLES or stem.circles[0][0] > highest:
        return None
    return stem


def _thinned(cloud: PointCloud, trunk: Stem, spacing_m: float) -> PointCloud:
    """Thin the crown, and keep all points of the trunk."""
    past, off, _ = trunk.off_bark(cloud.xyz)
    crown = np.flatnonzero(past | (off > BESIDE_M))
    few = crown[first_in_cell(cloud.xyz[crown], spacing_m)] if len(crown) else crown
    return cloud.take(np.union1d(np.setdiff1d(np.arange(len(cloud)), crown), few))


def _fitted(cloud: PointCloud, tree: AirborneTree, stages: Stages) -> TreeModel:
    """Reconstruct a tree that shows its trunk as single trees are."""
    model = fit(cloud, extract(cloud, options=stages.skeleton), options=stages.cylinders)
    flags = tuple(sorted({*model.metadata.get("flags", ()), *tree.flags}))
    return replace(model, metadata={**model.metadata, "flags": flags})


def bark_points(tree: TreeModel, cloud: PointCloud) -> int:
    """Count the points on the bark about breast height; 0 unless the diameter is measured.

    Parameters
    ----------
    tree : TreeModel
    cloud : PointCloud
        The cleaned cloud that it was made from.
    """
    trunk = tree.trunk
    if trunk is None or trunk.source != "measured" or trunk.dbh_m is None:
        return 0
    axis = tree.skeleton.xyz[tree.skeleton.paths[0]]
    height = cloud.xyz[:, 2] - trunk.ground_z - BREAST_M
    points = cloud.xyz[np.abs(height) <= SLICE_M / 2]
    centre = np.column_stack([np.interp(points[:, 2], axis[:, 2], axis[:, k]) for k in (0, 1)])
    away = np.linalg.norm(points[:, :2] - centre, axis=1)
    return int((away <= WIDE * trunk.dbh_m / 2).sum())


def _fallback(cloud: PointCloud, tree: AirborneTree, stages: Stages, reason: str) -> TreeModel:
    """Make the fallback model; of the stem alone if even that fails."""
    try:
        return fallback(cloud, tree, options=stages.model, skeleton=stages.skeleton, reasons=(reason,))
    except BROKEN:
        nothing = PointCloud(np.empty((0, 3)), cloud.origin, cloud.crs, {}, cloud.metadata)
        return fallback(nothing, tree, options=stages.model, reasons=(reason, "failed"))


def _patch(
    terrain: Raster | None, tree: AirborneTree, cloud: PointCloud, own: PointCloud
) -> PointCloud | None:
    """Return the terrain about the stem's foot as ground points; None where there is none."""
    if terrain is None:
        return None
    east, north = np.meshgrid(PATCH_M, PATCH_M)
    xy = np.round(np.asarray(tree.base), DECIMALS) + np.column_stack([east.ravel(), north.ravel()])
    height = np.round(terrain.at(xy), DECIMALS)
    known = np.isfinite(height)
    if not known.any():
        return None
    xyz = np.column_stack([xy, height])[known] + (cloud.origin - own.origin)
    return PointCloud(np.round(xyz, DECIMALS), own.origin)


def _tidied(cloud: PointCloud, tree: AirborneTree, most: int) -> PointCloud:
    """Sort a tree's points, without those that say the same or lie on the ground."""
    xyz = cloud.xyz[np.isfinite(cloud.xyz).all(axis=1)]
    xyz = xyz[np.lexsort(xyz.T)]
    side, kept = THINNEST_M, first_in_cell(xyz, THINNEST_M) if len(xyz) else np.zeros(0, dtype=np.int64)
    while len(kept) > most:
        side *= WIDER
        kept = kept[first_in_cell(xyz[kept], side)]
    xyz = xyz[kept]
    above = xyz[:, 2] > tree.ground_z + LITTER_M if math.isfinite(tree.ground_z) else np.ones(len(xyz), bool)
    return PointCloud(xyz[above], cloud.origin, cloud.crs, {}, cloud.metadata)
