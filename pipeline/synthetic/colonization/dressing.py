"""Triangles of a colonization tree: bark with as many sides as asked for, and its leaves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pipeline.mesh import Mesh, TubeOptions, tubes
from pipeline.mesh.triangles import empty, together
from pipeline.model import Floats, TreeModel
from pipeline.synthetic.colonization.leaves import Leaves, leaves_of
from pipeline.synthetic.colonization.options import ColonizationOptions

TRIANGLE = np.array([[-0.5, 0.0], [0.5, 0.0], [0.0, 1.0]])
SQUARE = np.array([[-0.5, 0.0], [0.5, 0.0], [0.5, 1.0], [-0.5, 1.0]])
"""Corners across and along a leaf, in edges."""
TILE_M = 0.5  # side of a picture of bark


def dressed(tree: TreeModel, options: ColonizationOptions, *, leaves: bool = True) -> Mesh:
    """Draw a tree and its leaves.

    Parameters
    ----------
    tree : TreeModel
        Of `grow_colonization`.
    options : ColonizationOptions
        Those it has grown by; only what shapes bark and leaves is read.
    leaves : bool, optional
        Whether it bears any.

    Returns
    -------
    Mesh
        Bark first, then the leaves, open and to be seen from both sides; with uv.
    """
    sides = TubeOptions(min_sides=options.ring_sides, max_sides=options.ring_sides)
    bark = tubes(tree, options=sides, tile_m=TILE_M)
    return together(bark, leaf_mesh(leaves_of(tree, options), tree)) if leaves else bark


def leaf_mesh(leaves: Leaves, tree: TreeModel) -> Mesh:
    """Draw leaves: a triangle or a square each, or two squares that cross at the midrib."""
    skeleton = tree.skeleton
    if not len(leaves.at):
        return replace(empty(skeleton.origin, skeleton.crs), uv=np.zeros((0, 3, 2)))
    shape = TRIANGLE if leaves.kind == "triangle" else SQUARE
    sides = [np.cross(leaves.rib, leaves.normal)]
    if leaves.kind.endswith("cross-foil"):
        sides.append(leaves.normal)
    foils = np.stack([_foil(leaves, side, shape) for side in sides], axis=1)
    corners = len(shape)
    fan = np.array([[0, k, k + 1] for k in range(1, corners - 1)])
    first = corners * np.arange(len(leaves.at) * len(sides))
    faces = (first[:, None, None] + fan).reshape(-1, 3).astype(np.int32)
    branch = np.repeat(skeleton.branch[leaves.node], len(sides) * len(fan)).astype(np.int32)
    is_leaf = np.ones(len(faces), dtype=bool)
    uv = np.tile((shape + [0.5, 0.0])[fan], (len(first), 1, 1))
    return Mesh(foils.reshape(-1, 3), faces, branch, skeleton.origin, skeleton.crs, is_leaf, uv=uv)


def _foil(leaves: Leaves, side: Floats, shape: Floats) -> Floats:
    """(L, corners, 3) corners of one foil of every leaf."""
    across, along = shape[:, 0, None], shape[:, 1, None]
    edge = leaves.size_m[:, None, None]
    return np.asarray(leaves.at[:, None] + edge * (across * side[:, None] + along * leaves.rib[:, None]))
