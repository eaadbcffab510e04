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

from itertools import product
from typing import NamedTuple

import numpy as np

from pipeline.geometry.compiled import compiled
from pipeline.mesh.axes import Axes, Index, nodes_of
from pipeline.mesh.options import MeshOptions
from pipeline.mesh.surface import side_counts
from pipeline.mesh.triangles import Flags, Mesh, empty
from pipeline.mesh.vector import length, minus, row
from pipeline.model import Floats, Ints, Skeleton, TreeModel

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


def reduced(tree: TreeModel, axes: Axes, options: MeshOptions, most: int) -> tuple[Axes, Axes]:
    """Leave out nodes and branches until at most so many triangles are drawn.

    Parameters
    ----------
    tree : TreeModel
    axes : Axes
        Those of the tree, node by node.
    options : MeshOptions
        As `coarser` returns them.
    most : int
        Triangles; what holds the outline stays even if it takes more.

    Returns
    -------
    axes, spikes : Axes
        What to draw as tubes and, with two points each, as spikes.
    """
    node = nodes_of(tree, axes.branch)
    weights = weigh(tree, axes, node)
    steps = np.unique(np.concatenate([[0.0], weights.branch, weights.node]))
    sides = side_counts(axes.radius, options)
    low, high = 0, len(steps) - (2 if np.isinf(steps[-1]) else 1)
    while low < high:  # the fewest left out that are enough
        middle = (low + high) // 2
        left = staying(axes, node, weights, float(steps[middle]))
        if triangles(axes.only(left), sides[left], options) <= most:
            high = middle
        else:
            low = middle + 1
    left = staying(axes, node, weights, float(steps[high]))
    footed = axes._replace(points=moved(tree.skeleton.xyz, node, axes.first, axes.points, left)).only(left)
    sharp = spiky(footed, sides[left], options)
    of_spike = np.repeat(sharp, np.diff(footed.first))
    thin = footed.only(of_spike)
    ends = np.stack([thin.points[thin.foot], thin.points[thin.tip]])
    long = np.ptp(ends, axis=0).max(axis=1, initial=0.0) >= options.ring_gap_m
    return footed.only(~of_spike), thin.only(np.repeat(long, np.diff(thin.first)))


def weigh(tree: TreeModel, axes: Axes, node: Ints) -> Weights:
    """Weigh branches and nodes.

    Parameters
    ----------
    tree : TreeModel
    axes : Axes
    node : (K,) array of int32
        The nodes that the axes go through.

    Returns
    -------
    Weights
    """
    skeleton = tree.skeleton
    above = skeleton.branch_parent.tolist()
    branch, weight = np.zeros(len(above)), np.full(len(tree), np.inf)
    step = np.linalg.norm(np.diff(axes.points, axis=0), axis=1)
    for number, foot, tip in zip(axes.branch.tolist(), axes.foot.tolist(), axes.tip.tolist(), strict=True):
        branch[number] = SHORT * step[foot:tip].sum()
    inner = np.ones(len(node), dtype=bool)
    inner[axes.foot] = inner[axes.tip] = False
    weight[node[inner]] = all_tolerances(np.column_stack([axes.points, axes.radius]), axes.first)[inner]
    stem = skeleton.paths[0]
    weight[stem] *= STEM
    held = np.unique([np.argmax(skeleton.xyz @ to + tree.radius) for to in SUPPORTS])
    weight[held] = np.inf
    branch[skeleton.branch[held]] = np.inf
    for b in range(len(above) - 1, 0, -1):
        branch[above[b]] = max(branch[above[b]], branch[b])
    branch[0] = np.inf
    return Weights(branch, weight)


@compiled
def all_tolerances(chains: Floats, first: Index) -> Floats:
    """Return the `tolerances` of one chain after another.

    Parameters
    ----------
    chains : (K, D) array of float64
    first : (A + 1,) array of int64
        Where each chain begins, and where the last one ends.

    Returns
    -------
    (K,) array of float64
    """
    out = np.empty(len(chains))
    for a in range(len(first) - 1):
        out[first[a] : first[a + 1]] = tolerances(chains[first[a] : first[a + 1]])
    return out


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


def staying(axes: Axes, node: Ints, weights: Weights, limit: float) -> Flags:
    """Tell which points stay: of the branches that weigh more than `limit`, foot, tip, and nodes that do."""
    left = weights.node[node] > limit
    left[axes.foot] = left[axes.tip] = True
    return np.asarray(left & np.repeat(weights.branch[axes.branch] > limit, np.diff(axes.first)))


def triangles(axes: Axes, sides: Index, options: MeshOptions) -> int:
    """Count the triangles of axes whose points all carry a ring."""
    if not len(axes.branch):
        return 0
    each = np.where(spiky(axes, sides, options), 4, 2 * np.add.reduceat(sides, axes.foot) - 4)
    return int(each.sum())


def spiky(axes: Axes, sides: Index, options: MeshOptions) -> Flags:
    """Tell which axes are so straight and thin that a spike will do."""
    straight = np.diff(axes.first) == 2
    thin = np.maximum(sides[axes.foot], sides[axes.tip]) == 3
    return np.asarray(straight & thin & (options.lod >= SPIKES_FROM))


@compiled
def moved(xyz: Floats, node: Ints, first: Index, points: Floats, left: Flags) -> Floats:
    """Return the points of axes, every branch beginning on what is left of its parent.

    Parameters
    ----------
    xyz : (N, 3) array of float64
        Where the nodes are.
    node : (K,) array of int32
        The nodes that the axes go through, parents' before their children's.
    first : (A + 1,) array of int64
        Where each axis begins, and where the last one ends.
    points : (K, 3) array of float64
    left : (K,) array of bool
        Which points stay; the nodes between them move onto the straight line. Axes without any stay put.

    Returns
    -------
    (K, 3) array of float64
    """
    place, out = xyz.copy(), points.copy()
    for a in range(len(first) - 1):
        foot, tip = first[a], first[a + 1] - 1
        if not left[foot]:
            continue
        out[foot] = place[node[foot]]
        arc = np.zeros(tip - foot + 1)
        for i in range(1, len(arc)):
            arc[i] = arc[i - 1] + length(minus(row(points, foot + i), row(points, foot + i - 1)))
        at = np.flatnonzero(left[foot : tip + 1])
        low = 0
        for i in range(1, len(arc)):
            while low < len(at) - 1 and arc[at[low + 1]] <= arc[i]:
                low += 1
            for k in range(3):
                value = out[foot + at[low], k]
                if arc[i] != arc[at[low]]:
                    slope = (out[foot + at[low + 1], k] - value) / (arc[at[low + 1]] - arc[at[low]])
                    value = slope * (arc[i] - arc[at[low]]) + value
                place[node[foot + i], k] = value
    return out


def spikes(axes: Axes, skeleton: Skeleton) -> Mesh:
    """Draw each axis as a closed, three-sided spike from its foot to its tip.

    Parameters
    ----------
    axes : Axes
        Two points each, that do not coincide.
    skeleton : Skeleton
        Gives origin and reference system.

    Returns
    -------
    Mesh
    """
    if not len(axes.branch):
        return empty(skeleton.origin, skeleton.crs)
    foot, tip = axes.points[axes.foot], axes.points[axes.tip]
    along = (tip - foot) / np.linalg.norm(tip - foot, axis=1, keepdims=True)
    helper = np.eye(3)[np.argmin(np.abs(along), axis=1)]
    right = np.cross(along, helper)
    right /= np.linalg.norm(right, axis=1, keepdims=True)
    ahead = np.cross(along, right)
    wide = SPIKE_CORNER * (axes.radius[axes.foot] + axes.radius[axes.tip])[:, None]
    turns = 2 * np.pi * np.arange(3) / 3
    base = [foot + wide * (np.cos(turn) * right + np.sin(turn) * ahead) for turn in turns]
    vertices = np.stack([*base, tip], axis=1)
    faces = np.array([[0, 1, 3], [1, 2, 3], [2, 0, 3], [0, 2, 1]])
    every = (faces + 4 * np.arange(len(foot))[:, None, None]).reshape(-1, 3).astype(np.int32)
    return Mesh(vertices.reshape(-1, 3), every, np.repeat(axes.branch, 4), skeleton.origin, skeleton.crs)
