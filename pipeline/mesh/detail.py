"""Levels of detail that keep the silhouette.

Each level has a quarter of the triangles of the one before. One length decides what goes: a node goes
when the axis without it is nearer than that, a branch when `SHORT` times its path, and those of all it
carries, is shorter. The nodes that the tree touches its bounding box and 18 slanted planes with
stay at every level, with the branches that lead to them; so height and crown do not shrink. A branch
that loses its footing to a straightened parent is moved onto it.

References
----------
Douglas & Peucker (1973) for the nodes; here with the radius as a fourth coordinate, and solved for
all tolerances at once: every node gets the tolerance below which it stays.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.mesh.options import MeshOptions
from pipeline.mesh.surface import Axis, side_counts
from pipeline.mesh.triangles import Flags, Mesh, empty
from pipeline.model import Floats, Skeleton, TreeModel

SHORT = 0.25
"""A missing branch is less of a loss than a bend of its length."""

STEM = 3.0
"""A bend of the stem counts so many times: it stands free, and all else stands on it."""

SPIKES_FROM = 2
"""From this level on, a thin straight branch is a three-sided spike of four triangles."""

SPIKE_CORNER = 1.21
"""Corners of a spike stand so far off, times both end radii, that its mean outline has a tube's area."""

SUPPORTS = np.array([d for d in product((-1.0, 0.0, 1.0), repeat=3) if any(d)])
SUPPORTS /= np.linalg.norm(SUPPORTS, axis=1, keepdims=True)
"""Directions in which the outline is kept."""


class Weights(NamedTuple):
    """The length, in metres, up to which each part stays; infinite for what holds the outline.

    Attributes
    ----------
    branch : (B,) array of float64
        By branch number; no branch has less than one it carries.
    node : (N,) array of float64
        Of every node within its branch; infinite at the ends.
    """

    branch: Floats
    node: Floats


def coarser(options: MeshOptions) -> MeshOptions:
    """Return the options with half as many sides for every level of detail."""
    level = options.lod
    fewer = {
        "max_deviation_m": options.max_deviation_m * 4**level,
        "min_sides": max(3, options.min_sides >> level),
        "max_sides": max(3, options.max_sides >> level),
    }
    return options.model_copy(update=fewer)


def reduced(
    tree: TreeModel, axes: Sequence[Axis], options: MeshOptions, most: int
) -> tuple[list[Axis], list[Axis]]:
    """Leave out nodes and branches until at most so many triangles are drawn.

    Parameters
    ----------
    tree : TreeModel
    axes : sequence of Axis
        Those of the tree, node by node.
    options : MeshOptions
        As `coarser` returns them.
    most : int
        Triangles; what holds the outline stays even if it takes more.

    Returns
    -------
    axes, spikes : list of Axis
        What to draw as tubes and, with two points each, as spikes.
    """
    weights = weigh(tree, axes)
    steps = np.unique(np.concatenate([[0.0], weights.branch, weights.node]))
    low, high = 0, len(steps) - (2 if np.isinf(steps[-1]) else 1)
    while low < high:  # the fewest left out that are enough
        middle = (low + high) // 2
        if triangles(tree, axes, weights, float(steps[middle]), options) <= most:
            high = middle
        else:
            low = middle + 1
    chosen = footed(tree, axes, weights, float(steps[high]))
    tubes = [axis for axis in chosen if not is_spike(axis, options)]
    spikes = [axis for axis in chosen if is_spike(axis, options)]
    return tubes, [axis for axis in spikes if np.ptp(axis.points, axis=0).max() >= options.ring_gap_m]


def weigh(tree: TreeModel, axes: Sequence[Axis]) -> Weights:
    """Weigh branches and nodes.

    Parameters
    ----------
    tree : TreeModel
    axes : sequence of Axis

    Returns
    -------
    Weights
    """
    skeleton = tree.skeleton
    above = skeleton.branch_parent.tolist()
    branch, node = np.zeros(len(above)), np.full(len(tree), np.inf)
    for axis in axes:
        chain = np.column_stack([axis.points, axis.radius])
        branch[axis.branch] = SHORT * np.linalg.norm(np.diff(axis.points, axis=0), axis=1).sum()
        node[skeleton.paths[axis.branch][1:-1]] = tolerances(chain)[1:-1]
    stem = skeleton.paths[0]
    node[stem] *= STEM
    held = np.unique([np.argmax(skeleton.xyz @ to + tree.radius) for to in SUPPORTS])
    node[held] = np.inf
    branch[skeleton.branch[held]] = np.inf
    for b in range(len(above) - 1, 0, -1):
        branch[above[b]] = max(branch[above[b]], branch[b])
    branch[0] = np.inf
    return Weights(branch, node)


@compiled
def tolerances(chain: Floats) -> Floats:
    """Return for every node of a chain the tolerance below which Douglas-Peucker keeps it.

    Parameters
    ----------
    chain : (K, D) array of float64

    Returns
    -------
    (K,) array of float64
        Infinite at both ends.
    """
    count = len(chain)
    out = np.full(count, np.inf)
    span = np.empty((count + 2, 2), dtype=np.int64)
    span[0, 0], span[0, 1], top = 0, count - 1, 1
    while top:
        top -= 1
        a, b = span[top, 0], span[top, 1]
        along = chain[b] - chain[a]
        square = (along * along).sum()
        worst, at = -1.0, -1
        for i in range(a + 1, b):
            off = chain[i] - chain[a]
            share = min(max((off * along).sum() / square, 0.0), 1.0) if square > 0.0 else 0.0
            off = off - share * along
            away = np.sqrt((off * off).sum())
            if away > worst:
                worst, at = away, i
        if at >= 0:
            out[at] = min(worst, out[a], out[b])
            span[top, 0], span[top, 1] = a, at
            span[top + 1, 0], span[top + 1, 1] = at, b
            top += 2
    return out


def triangles(
    tree: TreeModel, axes: Sequence[Axis], weights: Weights, limit: float, options: MeshOptions
) -> int:
    """Count the triangles that are left when all goes whose weight is not above `limit`."""
    total = 0
    paths = tree.skeleton.paths
    for axis in axes:
        if weights.branch[axis.branch] > limit:
            left = stays(paths[axis.branch], weights, limit)
            sides = side_counts(axis.radius[left], options)
            sharp = options.lod >= SPIKES_FROM and len(sides) == 2 and sides.max() == 3
            total += 4 if sharp else 2 * int(sides.sum()) - 4
    return total


def stays(path: NDArray[np.int32], weights: Weights, limit: float) -> Flags:
    """Tell which nodes of a path stay: foot, tip, and whatever weighs more than `limit`."""
    left = weights.node[path] > limit
    left[[0, -1]] = True
    return np.asarray(left)


def is_spike(axis: Axis, options: MeshOptions) -> bool:
    """Tell whether an axis is so straight and thin that a spike will do."""
    thin = side_counts(axis.radius, options).max() == 3
    return options.lod >= SPIKES_FROM and len(axis.points) == 2 and thin


def footed(tree: TreeModel, axes: Sequence[Axis], weights: Weights, limit: float) -> list[Axis]:
    """Return what is left of the axes, every branch beginning on what is left of its parent."""
    moved = tree.skeleton.xyz.copy()
    kept = []
    for axis in axes:
        if weights.branch[axis.branch] <= limit:
            continue
        path = tree.skeleton.paths[axis.branch]
        left = stays(path, weights, limit)
        points = np.concatenate([moved[path[:1]], axis.points[1:]])
        arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(axis.points, axis=0), axis=1))])
        for k in range(3):
            moved[path[1:], k] = np.interp(arc, arc[left], points[left, k])[1:]
        kept.append(Axis(axis.branch, points[left], axis.radius[left], axis.spare[left]))
    return kept


def spikes(axes: Sequence[Axis], skeleton: Skeleton) -> Mesh:
    """Draw each axis as a closed, three-sided spike from its foot to its tip.

    Parameters
    ----------
    axes : sequence of Axis
        Two points each, that do not coincide.
    skeleton : Skeleton
        Gives origin and reference system.

    Returns
    -------
    Mesh
    """
    if not axes:
        return empty(skeleton.origin, skeleton.crs)
    foot, tip = (np.array([axis.points[k] for axis in axes]) for k in (0, -1))
    along = (tip - foot) / np.linalg.norm(tip - foot, axis=1, keepdims=True)
    helper = np.eye(3)[np.argmin(np.abs(along), axis=1)]
    right = np.cross(along, helper)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    ahead = np.cross(along, right)
    wide = SPIKE_CORNER * np.array([axis.radius.sum() for axis in axes])[:, None]
    turns = 2 * np.pi * np.arange(3) / 3
    base = [foot + wide * (np.cos(turn) * right + np.sin(turn) * ahead) for turn in turns]
    vertices = np.stack([*base, tip], axis=1)
    faces = np.array([[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]])
    every = (faces + 4 * np.arange(len(axes))[:, None, None]).reshape(-1, 3).astype(np.int32)
    branch = np.repeat(np.array([axis.branch for axis in axes], dtype=np.int32), 4)
    return Mesh(vertices.reshape(-1, 3), every, branch, skeleton.origin, skeleton.crs)
