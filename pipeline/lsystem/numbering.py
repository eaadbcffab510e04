"""The order of nodes: as an L-string tells them, and as a model numbers them.

An L-string tells a tree depth first, side branches in brackets before the axis goes on. A model
numbers it path by path: the stem from foot to tip, then the branches that grow from it, base first,
then theirs. Both orders follow from parents and continuations, so that a tree comes back from its
L-string with the numbers it went in with.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.geometry.numbering import number_by_paths, renumbered
from pipeline.model import Floats, Ints, Skeleton, TreeModel


@compiled
def side_branches(parent: Ints, continuation: Ints) -> tuple[Ints, Ints]:
    """Chain the side branches of every node.

    Parameters
    ----------
    parent, continuation : (N,) array of int32
        -1 at the root, and at tips.

    Returns
    -------
    first, following : (N,) array of int32
        The first side branch of each node, and the next one on the same foot; -1 where none is.
    """
    first = np.full(len(parent), -1, dtype=np.int32)
    following = np.full(len(parent), -1, dtype=np.int32)
    for i in range(len(parent) - 1, 0, -1):
        if continuation[parent[i]] != i:
            following[i] = first[parent[i]]
            first[parent[i]] = i
    return first, following


@compiled
def told(parent: Ints, continuation: Ints) -> Ints:
    """Return the (N,) nodes as an L-string tells them: side branches by number, then the axis."""
    first, following = side_branches(parent, continuation)
    order = np.empty(len(parent), dtype=np.int32)
    waiting = np.zeros(len(parent), dtype=np.int32)
    depth = 1
    for position in range(len(parent)):
        depth -= 1
        node = waiting[depth]
        order[position] = node
        # What is put down last is told first: a brother waits for the axis, the axis for the branches.
        for later in (following[node], continuation[node], first[node]):
            if later >= 0:
                waiting[depth] = later
                depth += 1
    return order


@compiled
def carried(parent: Ints, length: Floats) -> Floats:
    """Return the (N,) length of wood that each segment carries, its own included."""
    total = length.copy()
    for i in range(len(parent) - 1, 0, -1):
        total[parent[i]] += total[i]
    return total


@compiled
def continued(parent: Ints, bracketed: NDArray[np.bool_], wood: Floats) -> Ints:
    """Return the (N,) child that continues each node: the one outside brackets, else the heaviest."""
    chosen = np.full(len(parent), -1, dtype=np.int32)
    for i in range(1, len(parent)):
        best = chosen[parent[i]]
        if best < 0 or (bracketed[best] and (not bracketed[i] or wood[i] > wood[best])):
            chosen[parent[i]] = i
    return chosen


def numbered(parent: Ints, continuation: Ints) -> tuple[NDArray[np.int64], Ints]:
    """Number a tree path by path, breadth first over its branches.

    Parameters
    ----------
    parent, continuation : (N,) array of int32
        -1 at the root, and at tips.

    Returns
    -------
    order : (N,) array of int64
        The old number of each new node.
    parent : (N,) array of int32
        Parents in new numbers.
    """
    order = number_by_paths(parent.astype(np.int64), continuation.astype(np.int64))
    return order, renumbered(parent, order)


def canonical(tree: TreeModel) -> TreeModel:
    """Return the same tree, numbered as its L-string brings it back.

    The stem comes first, then its side branches in the order of their feet (on one foot: of their
    old numbers), then theirs. A tree that is numbered so is returned as it is.
    """
    skeleton = tree.skeleton
    order, parent = numbered(skeleton.parent, skeleton.continuation)
    if np.array_equal(order, np.arange(len(order))):
        return tree
    return TreeModel(
        Skeleton(skeleton.xyz[order], parent, skeleton.origin, skeleton.crs, skeleton.metadata),
        tree.radius[order],
        tree.radius_source[order],
        tree.radius_rmse[order],
        tree.trunk,
        tree.metadata,
    )
