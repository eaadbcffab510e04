"""Cylinders along every branch of a skeleton: centres, radii, and the diameter at breast height."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from pipeline.cylinders.anchors import anchor, extend_tips, inside_parent, set_foot
from pipeline.cylinders.assembly import Tolerance, assemble, chosen_nodes, looseness
from pipeline.cylinders.bark import bark_only
from pipeline.cylinders.breast import around_breast_height, breast_height, through_breast_height
from pipeline.cylinders.circles import with_circles
from pipeline.cylinders.crown import crown_of
from pipeline.cylinders.intervals import intervals
from pipeline.cylinders.measured import Measured, flags
from pipeline.cylinders.radii import smooth
from pipeline.cylinders.restructure import continue_anew, drop_hidden
from pipeline.geometry.axes import Axes, axes_of
from pipeline.geometry.azimuth import Frame
from pipeline.geometry.estimates import NONE
from pipeline.geometry.noise import range_noise, shows_noise
from pipeline.geometry.sides import complete, seen_from
from pipeline.geometry.smoothing import whittaker
from pipeline.geometry.surface import Tubes, nearest_tube
from pipeline.geometry.windows import Shared, Windows, measure, share_out
from pipeline.model import PointCloud, Skeleton, TreeModel
from pipeline.options import Options

Floats = NDArray[np.float64]

FIRST_NOISE_M = 0.002
CENTRE_M = 0.01  # a centre known to this has half the weight of a perfect one
LOOSE_RADII = 0.8  # scattered points loosen the tolerance to this share of the radius at most
UNSEEN = 0.05  # weight of a node that no window moves: it holds its place unless its neighbours insist


class CylinderOptions(Options):
    """Options of the cylinder fits."""

    step_m: float = Field(0.04, gt=0, le=1, description="spacing of the nodes that are measured, metres")
    window_m: float = Field(0.04, gt=0, le=1, description="least length of a measuring window, metres")
    rounds: int = Field(2, ge=1, le=10, description="times that points are shared out and measured again")
    stiffness: float = Field(1.0, ge=0, le=1000, description="how much the axes resist bending")
    min_arc_deg: float = Field(
        90.0, ge=0, le=360, description="least arc of bark for a radius to count as measured, degrees"
    )
    protrusion_m: float = Field(
        0.03, ge=0, le=1, description="least length of a branch outside its parent's wood, metres"
    )
    direction_window_m: float = Field(
        0.2, gt=0, le=5, description="length over which a branch's direction is taken at a fork, metres"
    )
    tip_m: float = Field(0.08, ge=0, le=1, description="most that a tip moves on to its last point, metres")
    tolerance_share: float = Field(
        0.15, ge=0, le=2, description="tolerance of node positions as a share of the radius"
    )
    radius_share: float = Field(0.08, ge=0, le=2, description="tolerance of radii as a share of the radius")
    tolerance_cap_m: float = Field(0.007, gt=0, le=1, description="largest tolerance of nodes, metres")
    cap_noises: float = Field(2.5, ge=0, le=20, description="the same cap in noises, where that is more")
    noise_share: float = Field(0.65, ge=0, le=5, description="least tolerance as a share of the range noise")
    excess_share: float = Field(
        4.0, ge=0, le=10, description="and as a share of what the points scatter beyond the noise"
    )
    radius_cap_m: float = Field(0.0012, gt=0, le=1, description="largest tolerance of radii, metres")
    min_radius_m: float = Field(0.003, gt=0, le=0.1, description="least radius in the model, metres")


def fit(cloud: PointCloud, skeleton: Skeleton, *, options: CylinderOptions | None = None) -> TreeModel:
    """Measure a tree: cylinders wherever the points support them, tapered radii elsewhere.

    Parameters
    ----------
    cloud : PointCloud
        The cleaned cloud.
    skeleton : Skeleton
        Its skeleton.
    options : CylinderOptions, optional

    Returns
    -------
    TreeModel
        Nodes on the fitted axes; every radius says whether it is measured.

    References
    ----------
    Du et al. (2019), "AdTree", section 2.4, fits the trunk alone; here every branch is fitted.
    """
    frame = Frame.of(cloud.xyz, cloud.metadata)
    turned = frame.skeleton(skeleton, cloud.origin)
    return frame.tree_back(_fit(frame.cloud(cloud), turned, options or CylinderOptions()))


def _fit(cloud: PointCloud, skeleton: Skeleton, options: CylinderOptions) -> TreeModel:
    """Fit a tree in the frame of its cloud."""
    xyz = cloud.xyz
    crown, circles = crown_of(cloud, xyz), skeleton.metadata.get("stem_circles", ())
    axes = axes_of(skeleton, options.step_m)
    noise = float(skeleton.metadata.get("noise_m", FIRST_NOISE_M))
    for number in range(options.rounds + 1):
        shared = share_out(xyz, axes)
        windows = _outside(axes, measure(axes, shared, noise, options.window_m))
        if not number and not shows_noise(windows):
            windows = _look_finer(windows, axes, shared, options.window_m)
        if crown.in_leaf:
            windows = bark_only(windows, axes)
        noise = range_noise(windows, noise)
        windows = complete(windows, axes, seen_from(windows, noise))
        windows = with_circles(windows, axes, circles)
        if number:
            axes = _recentre(axes, windows, options.stiffness)
        radii = smooth(axes, windows, noise=noise, min_arc=np.radians(options.min_arc_deg), crown=crown)
        axes = set_foot(axes.with_square(radii.square), shared)
        if number < options.rounds:
            axes = drop_hidden(axes, protrusion_m=options.protrusion_m + 2.0 * noise)
            if number == options.rounds - 1:
                axes = continue_anew(axes, window_m=options.direction_window_m, step_m=options.step_m)
            axes = anchor(axes, step_m=options.step_m)
    axes = extend_tips(axes, shared, most_m=options.tip_m)
    return _model(skeleton, axes, Measured(shared, windows, radii, crown), noise, options)


def _outside(axes: Axes, windows: Windows) -> Windows:
    """Windows in the parent's wood say nothing of the branch."""
    return replace(windows, kind=np.where(inside_parent(axes), NONE, windows.kind))


def _recentre(axes: Axes, windows: Windows, stiffness: float) -> Axes:
    """Move every branch's nodes to their estimated centres, smoothly."""
    known = windows.kind != NONE
    weight = np.where(known, CENTRE_M**2 / (CENTRE_M**2 + windows.centre_variance), UNSEEN)
    goal = axes.xyz + windows.shift * known[:, None]
    xyz = axes.xyz.copy()
    for b in range(len(axes.foot)):
        run = slice(int(axes.first[b]) + (b > 0), int(axes.first[b + 1]))
        xyz[run] = whittaker(goal[run], weight[run], stiffness)
    xyz[axes.first[1:-1]] = xyz[axes.foot[1:]]
    return axes.at(xyz)


def _look_finer(windows: Windows, axes: Axes, shared: Shared, window_m: float) -> Windows:
    """Measure again, by less noise, a tree that is too thin throughout for the noise it was measured by.

    That noise is read off limbs as rough as the skeleton has them. Where nothing is thick against it nothing
    is fitted that shows how small it is.
    """
    finer = _outside(axes, measure(axes, shared, FIRST_NOISE_M, window_m))
    return finer if shows_noise(finer) else windows


def _model(
    skeleton: Skeleton,
    axes: Axes,
    measured: Measured,
    noise: float,
    options: CylinderOptions,
) -> TreeModel:
    """Simplify the fitted axes and put the tree model together."""
    radii = measured.radii
    tolerance = Tolerance(
        share=options.tolerance_share,
        radius_share=options.radius_share,
        cap_m=max(options.tolerance_cap_m, options.cap_noises * noise),
        radius_cap_m=options.radius_cap_m,
    )
    known = {**skeleton.metadata, "noise_mm": 1000.0 * noise}
    ground = float(known.get("ground_z", axes.xyz[0, 2]))
    trunk = breast_height(axes, measured, noise, ground)
    axes = through_breast_height(axes, trunk)
    loose = options.excess_share * looseness(axes, measured.shared, noise)
    least = options.noise_share * noise + np.minimum(loose, LOOSE_RADII * axes.radius)
    chosen = chosen_nodes(axes, tolerance, least, around_breast_height(axes, ground))
    body, parent = assemble(axes, chosen)
    warnings = flags(axes, measured, ground)
    known["flags"] = tuple(sorted({*known.get("flags", ()), *warnings}))
    graph = Skeleton(axes.xyz[body], parent.astype(np.int32), skeleton.origin, skeleton.crs)
    radius = np.maximum(axes.radius[body], options.min_radius_m)
    tree = TreeModel(graph, radius, radii.source[body], radii.error[body], trunk)
    known["surface_mm"] = surface_distance(measured.shared.xyz, tree)
    leaves = dict(known.get("dropped") or {}).get("leaf") or 0
    known |= intervals(tree, axes, measured, noise, leaves_dropped=leaves)
    return TreeModel(graph, radius, radii.source[body], radii.error[body], trunk, known)


def surface_distance(xyz: Floats, tree: TreeModel) -> dict[str, Any]:
    """Mean, median and 95th percentile distance of points to the model's surface, millimetres.

    Parameters
    ----------
    xyz : (P, 3) array
        Points relative to the tree's origin, metres.
    tree : TreeModel
    """
    graph = tree.skeleton
    end = np.arange(1, len(graph))
    tubes = Tubes(graph.xyz[graph.parent[1:]], graph.xyz[end], tree.start_radius[1:], tree.radius[1:])
    gap = 1000.0 * np.abs(nearest_tube(xyz, tubes).surface)
    return {
        "mean": float(gap.mean()),
        "median": float(np.median(gap)),
        "p95": float(np.percentile(gap, 95)),
    }
