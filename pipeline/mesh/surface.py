"""A tree as triangles: `tubes` draws every branch, `Mesh` holds what it draws."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from pipeline.errors import ModelError
from pipeline.mesh.tube import tube
from pipeline.model import Floats, Ints, TreeModel
from pipeline.options import Options

SIDES = np.array([3, 4, 6, 8, 12, 16, 24, 32, 48, 64])
"""Side counts of a ring. Few steps, so that a noisy radius does not change them at every ring."""

MITRE = np.sqrt(2.0)
"""A ring at a bend is drawn out to the ellipse of a mitre joint, up to that of a bend of 90 degrees."""


class TubeOptions(Options):
    """How round and how fine the tubes are."""

    min_radius_m: float = Field(0.004, gt=0, le=0.1, description="thinnest radius that is drawn, metres")
    max_deviation_m: float = Field(
        0.002, gt=0, le=0.1, description="farthest that the middle of a side may lie inside the bark, metres"
    )
    min_edge_m: float = Field(0.003, gt=0, le=0.1, description="shortest edge around a ring, metres")
    ring_gap_m: float = Field(
        0.002, gt=0, le=0.1, description="least distance between two rings; closer ones are merged, metres"
    )
    min_sides: int = Field(4, ge=3, le=64, description="fewest sides of a ring")
    max_sides: int = Field(32, ge=3, le=64, description="most sides of a ring")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.min_sides > self.max_sides:
            msg = f"min_sides {self.min_sides} is above max_sides {self.max_sides}; lower min_sides"
            raise ValueError(msg)
        return self


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles that say which branch they belong to.

    Parameters
    ----------
    vertices : (V, 3) array of float64
        Metres relative to `origin`; no tube shares a vertex with another.
    faces : (F, 3) array of int32
        Corners of each triangle, counter-clockwise seen from outside.
    branch : (F,) array of int32
        Branch number of each face, as in `Skeleton.branch`.
    origin : (3,) array of float64
        Coordinates of the local zero.
    crs : str or None
        As in `PointCloud`.

    Raises
    ------
    ModelError
        If a face names a vertex that is not there, or the arrays differ in length.
    """

    vertices: Floats
    faces: Ints
    branch: Ints
    origin: Floats = field(default_factory=lambda: np.zeros(3))
    crs: str | None = None

    def __post_init__(self) -> None:
        vertices = np.asarray(self.vertices, dtype=np.float64).reshape(-1, 3).view()
        faces = np.asarray(self.faces, dtype=np.int32).reshape(-1, 3).view()
        branch = np.asarray(self.branch, dtype=np.int32).view()
        origin = np.asarray(self.origin, dtype=np.float64).view()
        if branch.shape != (len(faces),) or origin.shape != (3,):
            msg = f"a mesh of {len(faces)} faces has branch {branch.shape} and origin {origin.shape}"
            raise ModelError(msg)
        if len(faces) and (faces.min() < 0 or faces.max() >= len(vertices)):
            msg = f"a face names a vertex outside 0 to {len(vertices) - 1}; build the faces anew"
            raise ModelError(msg)
        for name, array in (("vertices", vertices), ("faces", faces), ("branch", branch), ("origin", origin)):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @cached_property
    def world(self) -> Floats:
        """(V, 3) coordinates in the mesh's own reference system."""
        return np.asarray(self.vertices + self.origin)

    @cached_property
    def branch_volume(self) -> Floats:
        """(B,) volume of each tube in cubic metres, by branch number; 0 where none is drawn."""
        if not len(self.faces):
            return np.zeros(0)
        a, b, c = (self.vertices[self.faces[:, k]] for k in range(3))
        six = np.einsum("ij,ij->i", a, np.cross(b, c))
        return np.asarray(np.bincount(self.branch, six) / 6, dtype=np.float64)


def tubes(tree: TreeModel, *, options: TubeOptions | None = None) -> Mesh:
    """Draw one closed, tapered tube along the path of every branch.

    Rings are many-sided with the area of the circle they stand for, lie in the plane that halves
    the bend of the axis, and follow it without twist. A branch whose rings would all coincide, and
    a tree of one node, draw nothing.

    Parameters
    ----------
    tree : TreeModel
        A branch begins at its foot on the parent's axis, with its own radius.
    options : TubeOptions, optional

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
    skeleton = tree.skeleton
    paths = [path for path in skeleton.paths if len(path) > 1]
    if not paths:
        none = np.zeros((0, 3), dtype=np.int32)
        return Mesh(np.zeros((0, 3)), none, none[:, 0], skeleton.origin, skeleton.crs)
    node = np.concatenate(paths)
    end = np.cumsum([len(path) for path in paths])
    foot = end - [len(path) for path in paths]
    radius = tree.radius[node]
    radius[foot] = tree.start_radius[node[foot + 1]]
    radius = np.maximum(radius, options.min_radius_m)
    sides = side_counts(radius, options)
    corner = radius * corner_share(sides)
    drawn = [
        tube(skeleton.xyz[node[a:b]], corner[a:b], sides[a:b], options.ring_gap_m, MITRE)
        for a, b in zip(foot.tolist(), end.tolist(), strict=True)
    ]
    placed = np.cumsum([0, *(len(vertices) for vertices, _ in drawn)])
    return Mesh(
        np.concatenate([vertices for vertices, _ in drawn]),
        np.concatenate([faces + start for (_, faces), start in zip(drawn, placed[:-1], strict=True)]),
        np.repeat(skeleton.branch[node[foot + 1]], [len(faces) for _, faces in drawn]),
        skeleton.origin,
        skeleton.crs,
    )


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
