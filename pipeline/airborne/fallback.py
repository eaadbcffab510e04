"""The model of a tree whose trunk no point shows: a straight stem of allometric girth, and a crown.

The stem leads from the ground under the crown to the highest point. Its diameter at breast height comes
from height and crown width, with its interval; all other radii follow the pipe model [1]_, a cross-section
in proportion to the length of wood beyond. Nothing of it is measured, and every radius says so.

References
----------
.. [1] Shinozaki et al. (1964), "A quantitative analysis of plant form: the pipe model theory".
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from pipeline.airborne.allometry import AllometryOptions, Diameter, breast_height_diameter
from pipeline.airborne.tree import AirborneTree
from pipeline.cylinders.allometry import LOG_ERROR, WITHIN_90
from pipeline.errors import NotATreeError
from pipeline.geometry.azimuth import MICROMETRE, STEM
from pipeline.geometry.compiled import compiled
from pipeline.geometry.polyline import douglas_peucker
from pipeline.geometry.voxels import first_in_cell
from pipeline.model import ALLOMETRIC, Floats, PointCloud, Skeleton, TreeModel, Trunk
from pipeline.skeleton import SkeletonOptions, extract

BREAST_M = 1.3
STRAIGHT = "straight_stem"
"""The method of a model that is a stem alone."""

STEP_M = 0.5  # nodes of a stem that stands alone
LEAST_M = 0.5  # no stem is shorter
ENDS_M = 0.05  # a tip carries something too
SLIMMEST_M = 0.003
ERROR = 0.3  # standard error of a radius that no points support, as a share
RADIUS_SHARE = 0.1  # how far radii between two nodes may be off

Mask = NDArray[np.bool_]


class FallbackOptions(AllometryOptions):
    """How a tree is drawn whose trunk no point shows."""

    crown_spacing_m: float = Field(
        0.35, gt=0, le=5, description="points of the crown are thinned to this spacing, metres"
    )
    tolerance_m: float = Field(
        0.1, gt=0, le=1, description="how far a crown's branches may leave the points they join, metres"
    )


def fallback(
    cloud: PointCloud,
    tree: AirborneTree,
    *,
    options: FallbackOptions | None = None,
    skeleton: SkeletonOptions | None = None,
    reasons: tuple[str, ...] = ("no_trunk",),
) -> TreeModel:
    """Model a tree without a trunk; any tree will do, be it one point.

    Parameters
    ----------
    cloud : PointCloud
        The tree's own points, cleaned or not, from the same origin as `tree`.
    tree : AirborneTree
    options : FallbackOptions, optional
    skeleton : SkeletonOptions, optional
        How the crown is made of its points; where nothing can be made of them the stem stands alone.
    reasons : tuple of str
        Flags that say why, beside `fallback`.

    Returns
    -------
    TreeModel
        With `ground_z`, `top_z`, `crown_area_m2`, `method` and `flags` in its metadata.
    """
    options = options or FallbackOptions()
    foot, top = stem_line(tree)
    girth = breast_height_diameter(float(top[2] - foot[2]), tree.crown_diameter_m, options=options)
    graph = _with_crown(cloud, foot, top, options, skeleton or SkeletonOptions())
    graph = _stem_alone(cloud, foot, top) if graph is None else graph
    return _piped(graph, girth, options, _told(graph, tree, foot, top, reasons))


def stem_line(tree: AirborneTree) -> tuple[Floats, Floats]:
    """Foot and top of a straight stem, metres; where no ground is known it stands at the apex' own foot."""
    top = np.array(tree.apex, dtype=np.float64)
    ground = tree.ground_z if math.isfinite(tree.ground_z) else float(top[2])
    foot = np.array([*np.asarray(tree.base, dtype=np.float64), min(ground, float(top[2]) - LEAST_M)])
    return foot, top


def _with_crown(
    cloud: PointCloud, foot: Floats, top: Floats, options: FallbackOptions, skeleton: SkeletonOptions
) -> Skeleton | None:
    """Let the crown's points join the stem; None where they make no skeleton."""
    xyz = cloud.xyz[first_in_cell(cloud.xyz - foot, options.crown_spacing_m)] if len(cloud) else cloud.xyz
    if len(xyz) < 2:
        return None
    spacing = max(float(cloud.metadata.get("spacing_m", 0.0)), options.crown_spacing_m)
    known = {**cloud.metadata, "spacing_m": spacing, STEM: (foot.tolist(), top.tolist())}
    try:
        graph = extract(PointCloud(xyz, cloud.origin, cloud.crs, {}, known), options=skeleton)
    except NotATreeError:
        return None
    return graph


def _stem_alone(cloud: PointCloud, foot: Floats, top: Floats) -> Skeleton:
    count = max(math.ceil(float(np.linalg.norm(top - foot)) / STEP_M), 1) + 1
    line = np.round(np.linspace(foot, top, count), MICROMETRE)
    known = {key: value for key, value in cloud.metadata.items() if key != STEM}
    reason = "too few points for a crown"
    return Skeleton(
        line,
        np.arange(count, dtype=np.int32) - 1,
        cloud.origin,
        cloud.crs,
        {**known, "method": STRAIGHT, "method_reason": reason},
    )


def _told(
    graph: Skeleton, tree: AirborneTree, foot: Floats, top: Floats, reasons: tuple[str, ...]
) -> dict[str, Any]:
    """Metadata of the model."""
    known = {key: value for key, value in graph.metadata.items() if key not in ("stem_circles", "noise_m")}
    flags = {*known.get("flags", ()), *tree.flags, *reasons, "fallback"}
    return known | {
        "ground_z": float(foot[2]),
        "top_z": float(top[2]),
        "crown_area_m2": tree.crown_area_m2,
        "flags": tuple(sorted(flags)),
    }


def _piped(graph: Skeleton, girth: Diameter, options: FallbackOptions, known: dict[str, Any]) -> TreeModel:
    """Give every node its radius by the pipe model, and keep the nodes that are needed."""
    ground = float(known["ground_z"])
    stem = graph.order == 0
    height = graph.xyz[:, 2] - ground
    breast = min(BREAST_M, 0.5 * float(height[stem].max()))
    own = np.where(graph.branch_start, 0.5 * graph.length, 0.0)
    carried = graph.subtree_length + own + ENDS_M
    at_breast = float(np.interp(breast, height[stem], carried[stem]))
    radius = np.maximum(0.5 * girth.dbh_m * np.sqrt(carried / at_breast), SLIMMEST_M)
    fixed = _fixed(graph, height, breast)
    kept = _kept(
        np.column_stack([graph.xyz, radius]), graph.parent, (fixed, graph.branch_start), options.tolerance_m
    )
    number = np.cumsum(kept) - 1
    above = _kept_above(graph.parent, kept)[kept]
    parent = np.where(above >= 0, number[above], -1).astype(np.int32)
    body = Skeleton(np.round(graph.xyz[kept], MICROMETRE), parent, graph.origin, graph.crs)
    count = len(body)
    trunk = Trunk(girth.dbh_m, girth.lo_m, girth.hi_m, 0.0, "allometric", ground)
    if float(height[stem].max()) <= BREAST_M:
        trunk = Trunk(None, None, None, 0.0, None, ground)
    tree = TreeModel(
        body, radius[kept], np.full(count, ALLOMETRIC, dtype=np.uint8), ERROR * radius[kept], trunk
    )
    litres, factor = 1000.0 * float(tree.volume.sum()), math.exp(WITHIN_90 * 2.0 * LOG_ERROR)
    told = known | {"volume_interval_l": (litres / factor, litres * factor)}
    return TreeModel(body, tree.radius, tree.radius_source, tree.radius_rmse, trunk, told)


def _fixed(graph: Skeleton, height: Floats, breast: float) -> Mask:
    """Nodes that stay: root, forks, tips, and those of the stem about breast height."""
    fixed = np.bincount(graph.parent[1:], minlength=len(graph)) != 1
    fixed[0] = True
    stem = graph.paths[0]
    above = int(np.argmax(height[stem] >= breast))
    fixed[stem[max(above - 1, 0) : above + 1]] = True
    return np.asarray(fixed)


@compiled
def _kept(values: Floats, parent: NDArray[np.int32], known: tuple[Mask, Mask], tolerance: float) -> Mask:
    """(N,) nodes that Douglas-Peucker on position and radius keeps between the fixed ones."""
    fixed, starts = known
    keep = fixed.copy()
    for end in range(1, len(parent)):
        if not fixed[end]:
            continue
        count, at = 2, parent[end]
        while not fixed[at]:
            at, count = parent[at], count + 1
        chain = np.empty(count, dtype=np.int64)
        at = end
        for k in range(count - 1, -1, -1):
            chain[k], at = at, parent[at]
        run = values[chain]
        if starts[chain[1]]:
            run[0, 3] = run[1, 3]  # a branch starts with its own radius
        run[:, 3] /= RADIUS_SHARE * run[0, 3]
        chosen = douglas_peucker(run, np.full(count, tolerance))
        for k in range(count):
            keep[chain[k]] |= chosen[k]
    return keep


@compiled
def _kept_above(parent: NDArray[np.int32], kept: Mask) -> NDArray[np.int32]:
    """(N,) the nearest kept node towards the root."""
    above = parent.copy()
    for i in range(1, len(parent)):
        if not kept[parent[i]]:
            above[i] = above[parent[i]]
    return above
