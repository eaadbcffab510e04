"""A tree as triangles: `tubes` draws every branch, with what `axes_of` and `drawn` do for others too."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.mesh.options import TubeOptions
from pipeline.mesh.rings import Rings
from pipeline.mesh.triangles import Flags, Mesh, empty
from pipeline.mesh.tube import Rules, tube
from pipeline.mesh.wrapping import wrapped
from pipeline.model import Floats, Skeleton, TreeModel

SIDES = np.array([3, 4, 6, 8, 12, 16, 24, 32, 48, 64])
"""Side counts of a ring. Few steps, so that a noisy radius does not change them at every ring."""

MITRE = float(np.sqrt(2.0))
"""A ring at a bend is drawn out to the ellipse of a mitre joint, up to that of a bend of 90 degrees."""


class Axis(NamedTuple):
    """What a tube is drawn around.

    Attributes
    ----------
    branch : int
        Branch number.
    points : (K, 3) array of float64
        From foot to tip.
    radius : (K,) array of float64
        As drawn, metres.
    spare : (K,) array of bool
        Points between the nodes, which may be left out.
    """

    branch: int
    points: Floats
    radius: Floats
    spare: Flags


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


def axes_of(tree: TreeModel, options: TubeOptions, wanted: Flags | None = None) -> list[Axis]:
    """Return the axis of every branch that has a length in nodes, with the radii to draw.

    Parameters
    ----------
    tree : TreeModel
    options : TubeOptions
    wanted : (B,) array of bool, optional
        Which branches; all if not given.

    Returns
    -------
    list of Axis
        By branch number.
    """
    axes = []
    for branch, path in enumerate(tree.skeleton.paths):
        if len(path) > 1 and (wanted is None or wanted[branch]):
            radius = tree.radius[path]
            radius[0] = tree.start_radius[path[1]]
            radius = np.maximum(radius, options.min_radius_m)
            axes.append(Axis(branch, tree.skeleton.xyz[path], radius, np.zeros(len(path), dtype=bool)))
    return axes


def drawn(
    axes: Sequence[Axis], skeleton: Skeleton, options: TubeOptions, tile_m: float | None = None
) -> tuple[Mesh, Flags]:
    """Draw a tube around every axis.

    Parameters
    ----------
    axes : sequence of Axis
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
    if not axes:
        none = empty(skeleton.origin, skeleton.crs)
        return replace(none, uv=None if tile_m is None else np.zeros((0, 3, 2))), np.zeros(0, dtype=bool)
    rules = Rules(options.ring_gap_m, MITRE)
    around = rings_of(axes, options)
    made = [tube(rings, rules) for rings in around]
    placed = np.cumsum([0, *(len(one.vertices) for one in made)])
    mesh = Mesh(
        np.concatenate([one.vertices for one in made]),
        np.concatenate([one.faces + start for one, start in zip(made, placed[:-1], strict=True)]),
        np.repeat([axis.branch for axis in axes], [len(one.faces) for one in made]),
        skeleton.origin,
        skeleton.crs,
        uv=None if tile_m is None else wrapped(made, around, tile_m),
    )
    flat = np.concatenate([np.arange(len(one.faces)) >= len(one.faces) - one.ends for one in made])
    return mesh, flat


def rings_of(axes: Sequence[Axis], options: TubeOptions) -> list[Rings]:
    """Return the rings around every axis: how many-sided they are, and how far their corners stand off."""
    radius = np.concatenate([axis.radius for axis in axes])
    sides = side_counts(radius, options)
    corner = radius * corner_share(sides)
    cuts = np.cumsum([len(axis.radius) for axis in axes])[:-1]
    columns = zip(axes, np.split(corner, cuts), np.split(sides, cuts), strict=True)
    return [Rings(np.ascontiguousarray(axis.points), wide, many, axis.spare) for axis, wide, many in columns]


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
