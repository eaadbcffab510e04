"""Where the leaves of a colonization tree are, how they are turned and how large: data, no triangles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from pipeline.geometry.voxels import cell_keys
from pipeline.model import Floats, TreeModel
from pipeline.synthetic.colonization.options import ColonizationOptions, LeafType

MOST_LEAVES = 10  # drawn for every node, so that another number of them shows the same leaves
SPREAD = 0.2  # standard deviation of the leaves' size, as a share of its mean
SHADE_CELL_M = 0.5  # leaves in one column of this width shade each other
DEEP_SHADE = 8  # leaves above that make the deepest shade
LEAVES_STREAM = 2


class Leaves(NamedTuple):
    """Leaves on a tree.

    Attributes
    ----------
    at : (L, 3) array
        Where each is fastened, metres relative to the tree's origin.
    rib, normal : (L, 3) arrays
        Unit vectors along the leaf and square to its face; the second foil of a cross stands in the plane of
        these two.
    size_m : (L,) array
        Edge, metres.
    node : (L,) array of int
        The node whose segment bears it.
    kind : str
        Shape of them all.
    """

    at: Floats
    rib: Floats
    normal: Floats
    size_m: Floats
    node: NDArray[np.int64]
    kind: LeafType


def leaves_of(tree: TreeModel, options: ColonizationOptions) -> Leaves:
    """Hang leaves on the thin segments of a tree.

    Parameters
    ----------
    tree : TreeModel
    options : ColonizationOptions
        The same seed gives a node the same leaves, however many of them are shown.

    Returns
    -------
    Leaves
        Turned at random, each somewhere on its segment.
    """
    random = np.random.default_rng([options.seed, LEAVES_STREAM])
    skeleton = tree.skeleton
    thin = np.flatnonzero((tree.radius < options.leaf_radius_m) & (skeleton.parent >= 0))
    share, chance, luck = random.random((3, len(thin), MOST_LEAVES))
    rib, normal = _frames(len(thin) * MOST_LEAVES, random)
    spread = random.normal(0.0, SPREAD, (len(thin), MOST_LEAVES))
    node = np.repeat(thin, MOST_LEAVES)
    foot, tip = skeleton.xyz[skeleton.parent[node]], skeleton.xyz[node]
    at = foot + share.reshape(-1, 1) * (tip - foot)
    shown = (np.arange(MOST_LEAVES) + chance < options.leaves_per_node).ravel()
    bright = luck.ravel() >= options.leaf_shade * _shade(at, shown)
    shown &= bright
    length = np.maximum(options.leaf_size_m * (1.0 + spread.ravel()), 0.0)
    return Leaves(at[shown], rib[shown], normal[shown], length[shown], node[shown], options.leaf_type)


def _frames(count: int, random: Generator) -> tuple[Floats, Floats]:
    """Two unit vectors square to each other, turned at random."""
    rib, other = random.normal(size=(2, count, 3))
    rib /= np.linalg.norm(rib, axis=1, keepdims=True)
    normal = np.cross(rib, other)
    return rib, normal / np.linalg.norm(normal, axis=1, keepdims=True)


def _shade(at: Floats, shown: NDArray[np.bool_]) -> Floats:
    """(L,) from 0 in the sun to 1 below `DEEP_SHADE` leaves of the same column."""
    shade = np.zeros(len(at))
    if not shown.any():
        return shade
    which = np.flatnonzero(shown)
    flat = at[which] * [1.0, 1.0, 0.0]
    column = np.unique(cell_keys(flat, SHADE_CELL_M), return_inverse=True)[1].ravel()
    order = np.lexsort((-at[which, 2], column))
    first = np.concatenate([[True], np.diff(column[order]) > 0])
    above = np.arange(len(which)) - np.maximum.accumulate(np.where(first, np.arange(len(which)), 0))
    shade[which[order]] = np.minimum(above / DEEP_SHADE, 1.0)
    return shade
