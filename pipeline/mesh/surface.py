"""A tree as triangles: `tubes` draws every branch, with what `axes_of` and `drawn` do for others too."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.mesh.axes import Axes, nodes_of
from pipeline.mesh.options import TubeOptions
from pipeline.mesh.rings import Rings
from pipeline.mesh.triangles import Flags, Mesh
from pipeline.mesh.tube import Rules, Tubes, tubes_around
from pipeline.mesh.wrapping import wrapped
from pipeline.model import Floats, Skeleton, TreeModel

SIDES = np.array([3, 4, 6, 8, 12, 16, 24, 32, 48, 64])
"""Side counts of a ring. Few steps, so that a noisy radius does not change them at every ring."""

MITRE = float(np.sqrt(2.0))
"""A ring at a bend is drawn out to the ellipse of a mitre joint, up to that of a bend of 90 degrees."""


def tubes(tree: TreeModel, *, options: TubeOptions | None = None, tile_m: float | None = None) -> Mesh:
    """Draw one closed, tapered tube along the path of every branch.

    Rings are many-sided with the area of the circle they stand for, lie in the plane that halves
    the bend of the axis, and follow it without twist. A branch whose rings would all coincide, and
    a tree of one node, draw nothing.

    Parameters
    ----------
    tree : TreeModel
        A branch begins at its foot on the parent's axis, with its own radius.
    options : TubeOptions, optional
    tile_m : float, optional
        Side of a picture of bark, metres; the mesh then says where in it every corner lies.

    Returns
    -------
    Mesh
        Every tube is closed, faces outward, and shares no vertex with another. Where a ring would
        cut through the ring before it (a thick, crooked axis with close nodes) it is left out.

    Notes
    -----
    The volume of the tubes is that of the tapered segments with ``max(radius, min_radius_m)``, to
    about 1 % on a tree that is smooth at the scale of its radii.
    """
    options = options or TubeOptions()
    mesh, _ = drawn(axes_of(tree, options), tree.skeleton, options, tile_m)
    return mesh


def axes_of(tree: TreeModel, options: TubeOptions, wanted: Flags | None = None) -> Axes:
    """Return the axis of every branch that has a length in nodes, with the radii to draw.

    Parameters
    ----------
    tree : TreeModel
    options : TubeOptions
    wanted : (B,) array of bool, optional
        Which branches; all if not given.

    Returns
    -------
    Axes
    """
    paths = tree.skeleton.paths
    size = np.array([len(path) for path in paths])
    branch = np.flatnonzero((size > 1) if wanted is None else (size > 1) & wanted)
    first = np.concatenate([[0], np.cumsum(size[branch])])
    node = nodes_of(tree, branch)
    radius = tree.radius[node]
    radius[first[:-1]] = tree.start_radius[node[first[:-1] + 1]]
    radius = np.maximum(radius, options.min_radius_m)
    return Axes(branch, first, tree.skeleton.xyz[node], radius, np.zeros(len(node), dtype=bool))


def drawn(
    axes: Axes, skeleton: Skeleton, options: TubeOptions, tile_m: float | None = None
) -> tuple[Mesh, Flags]:
    """Draw a tube around every axis.

    Parameters
    ----------
    axes : Axes
    skeleton : Skeleton
        Gives origin and reference system.
    options : TubeOptions
    tile_m : float, optional
        As in `tubes`.

    Returns
    -------
    mesh : Mesh
    flat : (F,) array of bool
        Which faces close the end of a tube.
    """
    around, made = settle(axes, options)
    count = np.diff(made.first[:, 2])
    flat = np.arange(len(made.faces)) >= np.repeat(made.first[1:, 2] - made.ends, count)
    uv = None if tile_m is None else wrapped(made, around, tile_m)
    branch = np.repeat(axes.branch, count).astype(np.int32)
    return Mesh(made.vertices, made.faces, branch, skeleton.origin, skeleton.crs, uv=uv), flat


def settle(axes: Axes, options: TubeOptions) -> tuple[Rings, Tubes]:
    """Return the rings around all points, and the tubes of those that make them proper solids."""
    around = rings_of(axes, options)
    return around, tubes_around(around, axes.first, Rules(options.ring_gap_m, MITRE))


def rings_of(axes: Axes, options: TubeOptions) -> Rings:
    """Return the rings around axes: how many-sided they are, and how far their corners stand off."""
    sides = side_counts(axes.radius, options)
    corner = axes.radius * corner_share(sides)
    edge = 2 * corner * np.sin(np.pi / sides)
    return Rings(np.ascontiguousarray(axes.points), corner, sides, edge, axes.spare)


def side_counts(radius: Floats, options: TubeOptions) -> NDArray[np.int64]:
    """Return the sides of each ring: the fewest that stay within the deviation.

    Parameters
    ----------
    radius : (K,) array of float64
        Drawn radii, metres.
    options : TubeOptions

    Returns
    -------
    (K,) array of int64
        Between `min_sides` and `max_sides`, but never so many that an edge falls below `min_edge_m`.
    """
    between = SIDES[(options.min_sides < SIDES) & (options.max_sides > SIDES)]
    allowed = np.unique([options.min_sides, *between, options.max_sides])
    deviation = 1 - np.cos(np.pi / allowed)
    edge = 2 * np.sin(np.pi / allowed) * corner_share(allowed)
    too_coarse = radius[:, None] * deviation > options.max_deviation_m
    long_enough = radius[:, None] * edge >= options.min_edge_m
    wanted = too_coarse.sum(axis=1)
    afforded = np.maximum(long_enough.sum(axis=1), 1) - 1
    return np.asarray(allowed[np.minimum(np.minimum(wanted, afforded), len(allowed) - 1)])


def corner_share(sides: NDArray[np.int64]) -> Floats:
    """Return the distance of a polygon's corners from its centre for a circle of the same area, radius 1.

    Parameters
    ----------
    sides : (K,) array of int64

    Returns
    -------
    (K,) array of float64
    """
    return np.asarray(np.sqrt(2 * np.pi / (sides * np.sin(2 * np.pi / sides))))
