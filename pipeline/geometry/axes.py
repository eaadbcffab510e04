"""The working form of a tree while cylinders are fitted: dense nodes along every branch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.geometry.surface import Tubes
from pipeline.model import Skeleton

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Axes:
    """Branches as runs of evenly spaced nodes; node 0 of a branch is its foot on the parent's axis.

    Parameters
    ----------
    xyz : (M, 3) array
        Nodes of all branches, one run after the other, in metres.
    first : (B + 1,) array of int
        Where each branch's run begins, and the end of the last.
    foot : (B,) array of int
        The node of the parent branch on which each branch stands; -1 for the stem.
    square : (M,) array
        Squared radius at every node, in square metres (noise may push an estimate below zero).
    """

    xyz: Floats
    first: Ints
    foot: Ints
    square: Floats

    @property
    def branch(self) -> Ints:
        """(M,) the branch of every node."""
        return np.repeat(np.arange(len(self.foot)), np.diff(self.first))

    @property
    def radius(self) -> Floats:
        """(M,) radius at every node, 0 where the square is negative."""
        return np.sqrt(np.maximum(self.square, 0.0))

    @property
    def parent_branch(self) -> Ints:
        """(B,) the branch that each branch stands on; -1 for the stem."""
        return np.where(self.foot >= 0, self.branch[np.maximum(self.foot, 0)], -1)

    def tubes(self) -> tuple[Tubes, Ints]:
        """All segments, and the node at the end of each."""
        inner = np.ones(len(self.xyz), dtype=bool)
        inner[self.first[:-1]] = False
        end = np.flatnonzero(inner)
        r = self.radius
        begin = np.where(np.isin(end - 1, self.first[1:-1]), r[end], r[end - 1])
        return Tubes(self.xyz[end - 1], self.xyz[end], begin, r[end]), end

    def at(self, xyz: Floats) -> Axes:
        """The same branches with their nodes at `xyz`."""
        return Axes(xyz, self.first, self.foot, self.square)

    def with_square(self, square: Floats) -> Axes:
        """The same branches with other radii."""
        return Axes(self.xyz, self.first, self.foot, square)

    def frames(self) -> Floats:
        """(M, 3) unit direction of the branch at every node."""
        return _directions(self.xyz, self.first)


def axes_of(skeleton: Skeleton, step_m: float) -> Axes:
    """Lay dense nodes along every branch of a skeleton.

    Parameters
    ----------
    skeleton : Skeleton
    step_m : float
        Spacing of the nodes, in metres; a branch has three at least.
    """
    order = np.concatenate([path[number > 0 :] for number, path in enumerate(skeleton.paths)])
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.arange(len(order))
    above = skeleton.parent[order]
    parent = np.where(above >= 0, number[np.maximum(above, 0)], -1)
    return axes_of_paths(skeleton.xyz[order], parent, np.arange(len(order)), np.zeros(len(order)), step_m)


def axes_of_paths(xyz: Floats, parent: Ints, order: Ints, square: Floats, step_m: float) -> Axes:
    """Lay dense nodes along branches given as runs of nodes.

    Parameters
    ----------
    xyz : (N, 3) array
    parent : (N,) array of int
        -1 at the root.
    order : (N,) array of int
        The nodes branch by branch, from the foot outwards, a branch after the one it stands on; a
        node continues the branch of the node before it in `order` when that is its parent.
    square : (N,) array
        Squared radii.
    step_m : float
        Spacing of the dense nodes, metres.
    """
    above = parent[order]
    starts = np.flatnonzero(np.concatenate([[True], above[1:] != order[:-1]]))
    held = np.column_stack([xyz, square])
    # every branch but the stem begins at its parent's node
    runs = np.split(order, starts[1:])
    nodes = np.concatenate([runs[0], *(np.concatenate([[parent[r[0]]], r]) for r in runs[1:])])
    first = np.concatenate([[0], np.cumsum([len(r) + (k > 0) for k, r in enumerate(runs)])])
    values = held[nodes]
    body = first[1:-1]
    values[body, 3] = values[np.minimum(body + 1, len(values) - 1), 3]
    dense, begin = resample(values, first, step_m)
    branch = np.empty(len(order), dtype=np.int64)
    branch[order] = np.repeat(np.arange(len(runs)), [len(r) for r in runs])
    foot = np.full(len(runs), -1, dtype=np.int64)
    feet = np.array([0, *(parent[r[0]] for r in runs[1:])], dtype=np.int64)
    stand(dense, begin, (branch[feet], np.ascontiguousarray(xyz[feet])), foot)
    return Axes(np.ascontiguousarray(dense[:, :3]), begin, foot, np.ascontiguousarray(dense[:, 3]))


def resample(xyz: Floats, first: Ints, step_m: float) -> tuple[Floats, Ints]:
    """Lay evenly spaced nodes along runs of nodes; both ends of every run stay.

    Parameters
    ----------
    xyz : (N, 3) array
        Nodes of all runs.
    first : (B + 1,) array of int
        Where each run begins, and the end of the last.
    step_m : float
        Largest spacing; a run gets three nodes at least.

    Returns
    -------
    nodes : (M, D) array
    begin : (B + 1,) array of int
    """
    first = np.asarray(first, dtype=np.int64)
    step = np.linalg.norm(np.diff(xyz[:, :3], axis=0, prepend=xyz[:1, :3]), axis=1)
    step[first[:-1]] = 0.0
    total = np.add.reduceat(step, first[:-1])
    count = np.maximum(np.ceil(total / step_m).astype(np.int64), 2) + 1
    begin = np.concatenate([[0], np.cumsum(count)])
    return _resample(xyz, step, first, begin), begin


@compiled
def stand(dense: Floats, begin: Ints, feet: tuple[Ints, Floats], out: Ints) -> None:
    """Let every branch but the first start at the node of another that is nearest to its foot.

    Parameters
    ----------
    dense : (M, D) array
        Nodes of all branches; the first of each moves.
    begin : (B + 1,) array of int
        Where the nodes of each branch begin, and the end of the last.
    feet : tuple of (B,) array of int and (B, 3) array
        The branch that each stands on, and where.
    out : (B,) array of int
        Takes the node that each stands on.
    """
    branch, place = feet
    for b in range(1, len(begin) - 1):
        best, low = np.inf, begin[branch[b]]
        for i in range(low, begin[branch[b] + 1]):
            x, y, z = dense[i, 0] - place[b, 0], dense[i, 1] - place[b, 1], dense[i, 2] - place[b, 2]
            gap = x * x + y * y + z * z
            if gap < best:
                best, out[b] = gap, i
        dense[begin[b], :3] = dense[out[b], :3]


@compiled
def _resample(xyz: Floats, step: Floats, first: Ints, begin: Ints) -> Floats:
    out = np.empty((begin[-1], xyz.shape[1]))
    for b in range(len(first) - 1):
        low, high = first[b], first[b + 1]
        total = step[low + 1 : high].sum()
        count = begin[b + 1] - begin[b]
        at, gone = low, 0.0
        for k in range(count):
            goal = total * k / (count - 1)
            while at < high - 2 and gone + step[at + 1] < goal:
                gone += step[at + 1]
                at += 1
            ahead = min(at + 1, high - 1)
            share = (goal - gone) / step[ahead] if step[ahead] > 0.0 and ahead > at else 0.0
            share = min(max(share, 0.0), 1.0)
            out[begin[b] + k] = xyz[at] + share * (xyz[ahead] - xyz[at])
        out[begin[b + 1] - 1] = xyz[high - 1]
    return out


@compiled
def _directions(xyz: Floats, first: Ints) -> Floats:
    out = np.zeros_like(xyz)
    for b in range(len(first) - 1):
        for i in range(first[b], first[b + 1]):
            low, high = max(i - 2, first[b]), min(i + 2, first[b + 1] - 1)
            way = xyz[high] - xyz[low]
            norm = np.sqrt((way * way).sum())
            if norm > 1e-9:
                out[i] = way / norm
            elif i > first[b]:
                out[i] = out[i - 1]
            else:
                out[i] = np.array([0.0, 0.0, 1.0])
    return out
