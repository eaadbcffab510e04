"""A measured tree cut into metamers: where each one ends, and what grows from what."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.growth.state import Mask
from pipeline.model import Floats, Ints, TreeModel

NEAR_ZERO_M = 0.001
"""Length of the metamers that split a fork of three or more."""


class Stations(NamedTuple):
    """The ends of the metamers of a tree: the foot, then axis by axis, parents before children.

    Attributes
    ----------
    end : (M, 3) array
        On the axes of the tree, metres.
    width : (M,) array
        Diameter there, metres.
    parent : (M,) array of int32
    is_lateral : (M,) array of bool
        Whether it begins a side branch.
    segment : (M,) array of int32
        The node at the upper end of the segment on which the metamer ends; 0 for the foot.
    share : (M,) array
        Where on that segment, 1 at the node.
    holder : (N,) array of int32
        The metamer that holds each node of the tree; of a split fork the lowest one.
    """

    end: Floats
    width: Floats
    parent: Ints
    is_lateral: Mask
    segment: Ints
    share: Floats
    holder: Ints


class _Axis(NamedTuple):
    """An axis: its nodes, from the one it grows from on; the side branches of each, thickest first."""

    node: Ints
    sides: list[list[int]]
    arc: Floats
    radius: Floats


class _Cuts(NamedTuple):
    """Where an axis is cut: arc lengths; the cut that holds each node; the first one that bears its sides."""

    arc: Floats
    holder: Ints
    bearer: list[int]


def resample(tree: TreeModel, length_m: float) -> Stations:
    """Cut all axes into metamers of about one length that end at every fork.

    An axis goes on with the thickest and straightest child. A fork of three or more becomes forks of two with
    near-zero metamers between.

    Parameters
    ----------
    tree : TreeModel
    length_m : float
        Between two forks there are as many metamers as come next to this length, at least one.
    """
    onward = goes_on(tree)
    holder = np.zeros(len(tree), dtype=np.int32)
    rows = [_foot(tree)]
    count = 1
    starts = [(0, int(onward[0]), 0)] if onward[0] >= 0 else []
    for foot, first, below in starts:  # grows while it is walked: an axis after the one that bears it
        axis = _axis(tree, foot, first, onward, is_stem=below == 0)
        cuts = _cuts(axis.arc, [len(side) for side in axis.sides], length_m)
        rows.append(_rows(tree, axis, cuts, count, below))
        holder[axis.node[1:]] = count + cuts.holder[1:]
        for node, sides, bearer in zip(axis.node.tolist(), axis.sides, cuts.bearer, strict=True):
            starts += [(node, child, count + bearer + k) for k, child in enumerate(sides)]
        count += len(cuts.arc)
    end, width, parent, lateral, segment, share = (np.concatenate(part) for part in zip(*rows, strict=True))
    return Stations(end, width, parent, lateral, segment, share, holder)


def goes_on(tree: TreeModel) -> Ints:
    """(N,) the thickest and straightest child of each node, by cross-section and angle; -1 at tips."""
    graph = tree.skeleton
    step = np.diff(graph.xyz[np.stack([np.maximum(graph.parent, 0), np.arange(len(tree))])], axis=0)[0]
    size = np.linalg.norm(step, axis=1, keepdims=True)
    way = np.divide(step, size, out=np.zeros_like(step), where=size > 0.0)
    cosine = (way * way[np.maximum(graph.parent, 0)]).sum(axis=1)
    cosine[graph.parent <= 0] = way[graph.parent <= 0, 2]
    score = (tree.radius**2 * (1.0 + cosine)).tolist()
    carried = (graph.subtree_length + graph.length).tolist()
    best = [max(below, key=lambda c: (score[c], carried[c], -c), default=-1) for below in graph.children]
    return np.array(best, dtype=np.int32)


def _axis(tree: TreeModel, foot: int, first: int, onward: Ints, *, is_stem: bool) -> _Axis:
    nodes = [foot]
    here = first
    while here >= 0:
        nodes.append(here)
        here = int(onward[here])
    node = np.array(nodes, dtype=np.int32)
    radius = tree.radius[node]
    sides = [_aside(tree, i, int(onward[i])) for i in nodes]
    if not is_stem:
        sides[0] = []  # they are on the axis that bears this one
        radius[0] = radius[1]
    step = np.linalg.norm(np.diff(tree.skeleton.xyz[node], axis=0), axis=1)
    return _Axis(node, sides, np.concatenate([[0.0], np.cumsum(step)]), radius)


def _aside(tree: TreeModel, node: int, onward: int) -> list[int]:
    aside = [child for child in tree.skeleton.children[node] if child != onward]
    return sorted(aside, key=lambda child: (-tree.radius[child], child))


def _cuts(arc: Floats, sides: Sequence[int], length_m: float) -> _Cuts:
    """Cut an axis at its forks and between them; where a fork has k sides, k cuts lie close together."""
    cuts: list[float] = []
    bearer = [0] * len(arc)
    lowest: dict[int, int] = {}
    if sides[0]:
        cuts += _close(0.0, arc[-1], sides[0]).tolist()
    at = 0.0
    for place in [k for k in range(1, len(arc)) if sides[k] or k == len(arc) - 1]:
        gap = arc[place] - at
        number = max(1, round(gap / length_m))
        cuts += (at + gap * np.arange(1, number) / number).tolist()
        bearer[place] = lowest[place] = len(cuts)
        more = max(sides[place] - 1, 0)
        cuts += (arc[place] - _close(0.0, gap / number, more)[::-1]).tolist()
        cuts.append(arc[place])
        at = arc[place]
    holder = np.searchsorted(cuts, arc)
    holder[list(lowest)] = list(lowest.values())
    return _Cuts(np.array(cuts), np.minimum(holder, len(cuts) - 1).astype(np.int32), bearer)


def _close(start: float, room: float, number: int) -> Floats:
    """(number,) arc lengths close above a start, well within some room."""
    step = min(NEAR_ZERO_M, room / (2.0 * number + 2.0))
    return np.asarray(start + step * np.arange(1, number + 1), dtype=np.float64)


def _foot(tree: TreeModel) -> tuple[NDArray[Any], ...]:
    none = np.zeros(1, dtype=np.int32)
    return (tree.skeleton.xyz[:1], 2.0 * tree.radius[:1], none - 1, none > 0, none, np.ones(1))


def _rows(tree: TreeModel, axis: _Axis, cuts: _Cuts, count: int, below: int) -> tuple[NDArray[Any], ...]:
    """Return the rows of `Stations` of an axis whose first metamer has the number `count`."""
    upper = np.minimum(np.searchsorted(axis.arc[1:], cuts.arc), len(axis.arc) - 2) + 1
    run = axis.arc[upper] - axis.arc[upper - 1]
    share = np.divide(cuts.arc - axis.arc[upper - 1], run, out=np.ones(len(run)), where=run > 0.0)
    a, b = tree.skeleton.xyz[axis.node[upper - 1]], tree.skeleton.xyz[axis.node[upper]]
    end = np.where(share[:, None] >= 1.0, b, a + share[:, None] * (b - a))
    number = np.arange(count, count + len(upper), dtype=np.int32)
    parent = np.concatenate([[below], number[:-1]]).astype(np.int32)
    lateral = (number == count) & (below > 0)
    width = 2.0 * np.interp(cuts.arc, axis.arc, axis.radius)
    return end, width, parent, lateral, axis.node[upper], share
