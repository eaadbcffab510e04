"""From the points of a file to the points of one tree: sorted, clean, thinned, standing on its ground."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.spatial import ConvexHull

from pipeline.cloud.clumps import parts
from pipeline.cloud.foliage import stands_in_foliage
from pipeline.cloud.ground import Ground, below, foot, lowest
from pipeline.cloud.groundsearch import find_ground
from pipeline.cloud.leaves import LeafOptions, find_leaves
from pipeline.cloud.local import usable
from pipeline.cloud.order import canonical, repeats
from pipeline.cloud.outliers import outliers, spacing, strays
from pipeline.cloud.thinning import cap, thin
from pipeline.cloud.usable import require_one_tree, require_points, require_volume
from pipeline.errors import InputFormatError
from pipeline.geometry.azimuth import Frame
from pipeline.geometry.linearity import DENSE_M, is_leafy
from pipeline.model import PointCloud

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

NOISE_CLASSES = (7, 18)  # low and high noise; LAS 1.4, table 17
GROUND_CLASS = 2
OTHER_CLASSES = (6, 9)  # building and water
MAX_GROUND_DISTANCE_M = 20.0  # ground further from the foot says nothing about it
LONE_M = 0.25  # a point this far below the others is not the tree's, unless the cloud is sparser:
LONE_SPACINGS = 3.0  # then it is this many times the usual distance between neighbours
STAND_M = 20.0
DROPPED = ("duplicate", "invalid", "outlier", "clump", "ground", "leaf", "voxel")


class CleanOptions(LeafOptions):
    """How a cloud is cleaned."""

    voxel_m: float = Field(
        0.005, ge=1e-3, le=1.0, description="one point is kept per cell of this side (metres)"
    )
    max_points: int = Field(
        1_000_000, ge=1000, description="cells double in size until at most this many points are left"
    )
    outlier_neighbours: int = Field(8, ge=2, le=100, description="nearest points an outlier is judged by")
    outlier_limit_sd: float = Field(
        12.0,
        gt=0,
        description="an outlier's distance to them, in robust standard deviations over the median",
    )
    clump_share: float = Field(
        0.02,
        ge=0,
        le=0.5,
        description="share of the points below which a part that hangs apart is debris (0-1)",
    )
    find_ground: bool = Field(
        True, description="look for a patch of ground where the points carry no classes"
    )
    ground_layer_m: float = Field(
        0.04, ge=0, le=0.5, description="least height above the ground surface that still is ground (metres)"
    )
    leaves: Literal["auto", "keep", "drop"] = Field(
        "auto", description="leaf points of dense clouds; auto drops them where leaves are found"
    )
    canonical_azimuth: bool = Field(
        True, description="work in a frame that turns with the cloud, so that north makes no difference"
    )
    max_extent_m: float = Field(100.0, gt=0, description="a cloud larger than this is not one tree (metres)")


def clean(
    cloud: PointCloud, ground: PointCloud | None = None, *, options: CleanOptions | None = None
) -> PointCloud:
    """Keep the points of one tree, in an order that does not depend on that of the file.

    Parameters
    ----------
    cloud : PointCloud
        All points of a file. The attributes `classification` and `withheld`, where there are any,
        are used as LAS defines them.
    ground : PointCloud or None
        Ground points around the tree, in the same reference system. They are the ground that counts,
        also where the cloud has points of class 2 itself.
    options : CleanOptions or None

    Returns
    -------
    PointCloud
        The same origin, reference system and attributes, fewer points. The metadata gain
        `points_in`, `points_used`, `dropped`, `ground_z`, `ground_source`, `crown_area_m2`,
        `top_z`, `spacing_m` and `flags`.

    Raises
    ------
    InputFormatError
        If `ground` holds no ground near the tree.
    NotATreeError
        If fewer than ten points are left, they have no volume, or they reach too far for one tree.
    """
    options = options or CleanOptions()
    tally = _Tally(len(cloud), cloud.metadata)
    tree = tally.drop("invalid", cloud, ~usable(cloud.xyz))
    tree, classified = _by_class(tree, tally)
    tree = canonical(tally.drop("outlier", tree, strays(tree.xyz)))
    tree = tally.drop("duplicate", tree, repeats(tree.xyz))
    if len(tree):
        tree = canonical(_frame(tree, options).snapped(tree))
    require_points(tree, tally.points_in, tally.dropped)
    require_volume(tree)  # before the ground is looked for: a flat cloud would be all ground
    tree = _thinned(tree, options, tally)
    surface, source = _surface(tree, classified, ground, options)
    if surface is not None:  # before the outliers: a dense ground would make a sparse tree look like them
        tree = tally.drop("ground", tree, surface.layer(tree.xyz))
    tree = _without_outliers(tree, surface, options, tally)
    require_points(tree, tally.points_in, tally.dropped)
    require_one_tree(tree, options.max_extent_m)
    tree = _in_one_piece(tree, surface, options, tally)
    kept = cap(tree.xyz, voxel_m=options.voxel_m, max_points=options.max_points)
    tree = tally.keep("voxel", tree, kept)
    require_points(tree, tally.points_in, tally.dropped)
    require_volume(tree)
    whole = _described(tree, surface, source, tally)
    return _wood_of(whole, options, tally)


class _Tally:
    """What was dropped and noticed on the way."""

    def __init__(self, points_in: int, metadata: Mapping[str, Any]) -> None:
        self.points_in = points_in
        self.dropped = dict.fromkeys(DROPPED, 0)
        self.flags = set(metadata.get("flags", ()))
        if metadata.get("crs_assumed"):
            self.flags.add("crs_assumed")

    def drop(self, kind: str, cloud: PointCloud, mask: Mask) -> PointCloud:
        """Return the cloud without the points of `mask`, counted as `kind`."""
        self.dropped[kind] += int(mask.sum())
        return cloud.take(~mask) if mask.any() else cloud

    def keep(self, kind: str, cloud: PointCloud, index: NDArray[np.int64]) -> PointCloud:
        """Return the points at `index` alone; the others are counted as `kind`."""
        self.dropped[kind] += len(cloud) - len(index)
        return cloud.take(index) if len(index) < len(cloud) else cloud


def _thinned(cloud: PointCloud, options: CleanOptions, tally: _Tally) -> PointCloud:
    """Keep one point a cell; the cells stand as the cloud itself does, not as the map."""
    frame = Frame.of(cloud.xyz, cloud.metadata)
    turned = frame.turn(cloud.xyz)
    order = frame.order(turned)
    kept = np.sort(order[thin(turned[order], voxel_m=options.voxel_m)])
    return tally.keep("voxel", cloud, kept)


def _frame(cloud: PointCloud, options: CleanOptions) -> Frame:
    """Return the frame in which the tree is measured."""
    return Frame.of(cloud.xyz, cloud.metadata) if options.canonical_azimuth else Frame(0.0, (0.0, 0.0))


def _by_class(cloud: PointCloud, tally: _Tally) -> tuple[PointCloud, Floats]:
    """Drop what the classes or the withheld flag exclude; return the rest and the ground points."""
    withheld = cloud.attributes.get("withheld", np.zeros(len(cloud), dtype=bool)).astype(bool)
    classes = cloud.attributes.get("classification", np.zeros(len(cloud), dtype=np.uint8))
    noise = np.isin(classes, NOISE_CLASSES) | withheld
    other = np.isin(classes, OTHER_CLASSES) & ~noise
    soil = (classes == GROUND_CLASS) & ~noise
    for kind, mask in (("outlier", noise), ("clump", other), ("ground", soil)):
        tally.dropped[kind] += int(mask.sum())
    if noise.any():
        tally.flags.add("noise_class")
    gone = noise | other | soil
    return (cloud.take(~gone) if gone.any() else cloud), cloud.xyz[soil]


def _surface(
    tree: PointCloud, classified: Floats, ground: PointCloud | None, options: CleanOptions
) -> tuple[Ground | None, str]:
    """Return the ground surface and where it comes from: "class", "file", "found" or "lowest"."""
    least = options.ground_layer_m
    if ground is not None:  # whoever gives one means it
        surface = Ground.through(_of_file(ground, tree), least_layer_m=least)
        _require_near(surface, tree, ground)
        return surface, "file"
    if len(classified):
        return Ground.through(classified, least_layer_m=least), "class"
    found = find_ground(tree.xyz) if options.find_ground else None
    return (None, "lowest") if found is None else (Ground.through(found, least_layer_m=least), "found")


def _of_file(ground: PointCloud, tree: PointCloud) -> Floats:
    """Return the ground points of a ground cloud (class 2 where it has any) from the tree's origin."""
    xyz = ground.xyz + (ground.origin - tree.origin)
    good = usable(xyz)
    soil = good & (ground.attributes.get("classification", np.zeros(len(xyz))) == GROUND_CLASS)
    kept = xyz[soil if soil.any() else good]
    if not len(kept):
        msg = f"{_name(ground)}: holds no usable ground points; give another ground file or none"
        raise InputFormatError(msg)
    return kept


def _require_near(surface: Ground, tree: PointCloud, ground: PointCloud) -> None:
    """Raise `InputFormatError` if the ground of a file is not the ground of this tree."""
    away = surface.distance(foot(tree.xyz))
    if away > MAX_GROUND_DISTANCE_M:
        msg = (
            f"{_name(ground)}: the nearest ground point is {away:.0f} m from the tree; "
            "give the ground around it, in the same reference system"
        )
        raise InputFormatError(msg)


def _name(ground: PointCloud) -> str:
    return str(ground.metadata.get("source", {}).get("path", "the ground cloud"))


def _without_outliers(
    tree: PointCloud, surface: Ground | None, options: CleanOptions, tally: _Tally
) -> PointCloud:
    """Drop the points that stand alone, and those that hang below the tree where no ground is known."""
    lone = outliers(tree.xyz, neighbours=options.outlier_neighbours, limit_sd=options.outlier_limit_sd)
    tree = tally.drop("outlier", tree, lone)
    if surface is not None or not len(tree):
        return tree
    tally.flags.add("no_ground")
    within = max(LONE_M, LONE_SPACINGS * spacing(tree.xyz))
    return tally.drop("outlier", tree, below(tree.xyz, within))


def _in_one_piece(
    tree: PointCloud, surface: Ground | None, options: CleanOptions, tally: _Tally
) -> PointCloud:
    """Drop the parts that are not this tree's, and note what the others tell."""
    base = None if surface is None else float(surface.height(foot(tree.xyz)[None])[0])
    found = parts(tree.xyz, small_share=options.clump_share, base_z=base)
    if found.several_stems or _wider_than_a_tree(tree.xyz):
        tally.flags.add("several_stems")
    if found.floating:
        tally.flags.add("floating_parts")
    return tally.drop("clump", tree, found.clump)


def _wider_than_a_tree(xyz: Floats) -> bool:
    """Whether the points are wider than high, and wider than single trees are: a stand, not a tree."""
    return bool(len(xyz)) and np.ptp(xyz[:, :2], axis=0).min() > max(STAND_M, np.ptp(xyz[:, 2]))


def _described(tree: PointCloud, surface: Ground | None, source: str, tally: _Tally) -> PointCloud:
    """Return the tree with what is known of it in its metadata."""
    base = lowest(tree.xyz) if surface is None else float(surface.height(foot(tree.xyz)[None])[0])
    known = {
        "points_in": tally.points_in,
        "points_used": len(tree),
        "dropped": tally.dropped,
        "ground_z": base,
        "ground_source": source,
        "crown_area_m2": float(ConvexHull(tree.xyz[:, :2]).volume),  # the volume of a plane hull is its area
        "top_z": float(tree.xyz[-1, 2]),
        "spacing_m": spacing(tree.xyz),
        "flags": tuple(sorted(tally.flags)),
    }
    return PointCloud(tree.xyz, tree.origin, tree.crs, tree.attributes, {**tree.metadata, **known})


def _wood_of(tree: PointCloud, options: CleanOptions, tally: _Tally) -> PointCloud:
    """Return the wood of a dense cloud in leaf; height, crown and ground are still the whole tree's.

    Whether the points that remain are leaves goes into the metadata.
    """
    frame = Frame.of(tree.xyz, tree.metadata)
    turned = frame.turn(tree.xyz)
    order = frame.order(turned)
    seen = is_leafy(tree.xyz) or stands_in_foliage(turned[order], options=options)
    wanted = options.leaves == "drop" or (options.leaves == "auto" and seen)
    if not wanted or tree.metadata["spacing_m"] > DENSE_M:
        return tree.take(np.ones(len(tree), dtype=bool), leafy_points=seen)
    leaves = np.empty(len(tree), dtype=bool)
    leaves[order] = find_leaves(turned[order], options=options)
    wood = tally.drop("leaf", tree, leaves)
    require_points(wood, tally.points_in, tally.dropped)
    known = {
        "points_used": len(wood),
        "dropped": tally.dropped,
        "spacing_m": spacing(wood.xyz),
        "leafy_points": False,
        "flags": tuple(sorted({*tally.flags, "leafy"})),
    }
    return PointCloud(wood.xyz, wood.origin, wood.crs, wood.attributes, {**wood.metadata, **known})
