"""With radii known, ask again which limbs are real and which way each branch goes on at a fork."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.cylinders.anchors import clearance
from pipeline.cylinders.assembly import assemble
from pipeline.geometry.axes import Axes, axes_of_paths
from pipeline.geometry.branching import continue_branches
from pipeline.geometry.numbering import number_by_paths

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SLIGHT_M = 0.005  # radii below this say little of which branch goes on: twigs come out as they are measured


def drop_hidden(axes: Axes, *, protrusion_m: float) -> Axes:
    """Drop the branches that do not stand out of the wood of the branch that they stand on.

    What stood on a dropped branch stands on its parent afterwards.

    Parameters
    ----------
    axes : Axes
        With radii.
    protrusion_m : float
        Least distance of a branch's farthest node from 1.25 parent radii, metres.
    """
    out = clearance(axes)
    farthest = np.maximum.reduceat(out, axes.first[:-1])
    keep = farthest > protrusion_m
    keep[0] = True
    if keep.all():
        return axes
    foot, parent, first = axes.foot.copy(), axes.parent_branch, axes.first
    for b in range(1, len(foot)):
        on = parent[b]
        while not keep[on]:
            on = parent[on]
        if on != parent[b]:
            run = slice(int(first[on]), int(first[on + 1]))
            gap = ((axes.xyz[run] - axes.xyz[first[b]]) ** 2).sum(axis=1)
            foot[b] = run.start + int(np.argmin(gap))
    return _take(axes, foot, keep)


def _take(axes: Axes, foot: Ints, keep: NDArray[np.bool_]) -> Axes:
    """Keep some branches; the feet of kept ones lie on kept ones."""
    nodes = keep[axes.branch]
    number = np.cumsum(nodes) - 1
    first = np.concatenate([[0], np.cumsum(np.diff(axes.first)[keep])])
    feet = np.where(foot >= 0, number[np.maximum(foot, 0)], -1)[keep]
    return Axes(axes.xyz[nodes], first, feet, axes.square[nodes])


def continue_anew(axes: Axes, *, window_m: float, step_m: float) -> Axes:
    """Choose at every fork which branch goes on, now by fitted radii, and lay the axes anew.

    Parameters
    ----------
    axes : Axes
        With radii.
    window_m : float
        Least length over which directions are taken, metres.
    step_m : float
        Spacing of the nodes of the result, metres.
    """
    body, parent = assemble(axes, np.arange(len(axes.xyz)))
    order = np.argsort(_depth(parent), kind="stable")  # a re-footed branch may follow its children
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    parent = np.where(parent >= 0, number[np.maximum(parent, 0)], -1)[order]
    xyz, square = axes.xyz[body][order], axes.square[body][order]
    ahead = continue_branches(xyz, parent, np.sqrt(np.maximum(square, 0.0) + SLIGHT_M**2), window_m)
    return axes_of_paths(xyz, parent, number_by_paths(parent, ahead), square, step_m)


def _depth(parent: Ints) -> Ints:
    depth = np.zeros(len(parent), dtype=np.int64)
    for i in range(1, len(parent)):
        depth[i] = depth[parent[i]] + 1
    return depth
