"""Number the nodes of a tree path by path: the branch structure is then carried by the numbers.

A branch's nodes follow each other without a gap; the stem comes first, then its side branches from
the base up, then theirs. See `pipeline.model.Skeleton`, which reads the branches from the numbers.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.errors import ModelError

Positions = NDArray[np.int64]


def from_edges(xyz: ArrayLike, edges: ArrayLike) -> tuple[Positions, NDArray[np.int32]]:
    """Make one rooted tree of loose edges, numbered path by path.

    The root is the node to which no edge leads; where several are, the edges have no direction and
    the lowest node is it (node 0 where none is). At a fork the branch goes on with the child that
    carries the most length (the first of equals).

    Parameters
    ----------
    xyz : (N, 3) array_like of float
        Node positions.
    edges : (E, 2) array_like of int
        The two nodes of each edge, parent first where it is known; in any order. An edge that is
        given twice counts once.

    Returns
    -------
    node : (N,) array of int64
        Which of the given nodes stands at each new number.
    parent : (N,) array of int32
        Parent of each node in new numbers; ``parent[0] == -1`` and ``parent[i] < i``.

    Raises
    ------
    ModelError
        If a node or an edge is missing, out of range or not finite, or the edges make a cycle or
        more than one tree.

    Examples
    --------
    >>> node, parent = from_edges([[0, 0, 3], [0, 0, 0], [1, 0, 1], [0, 0, 1]], [[1, 3], [3, 2], [3, 0]])
    >>> node.tolist(), parent.tolist()
    ([1, 3, 0, 2], [-1, 0, 1, 1])
    """
    xyz = np.asarray(xyz, dtype=np.float64)
    parent = rooted(len(xyz), edges, xyz[:, 2] if xyz.ndim == 2 else None)
    if not np.isfinite(xyz).all():
        bad = int(np.flatnonzero(~np.isfinite(xyz).all(axis=1))[0])
        msg = f"node {bad} has a coordinate that is not finite; remove the node or mend the file"
        raise ModelError(msg)
    length = np.linalg.norm(xyz - xyz[np.where(parent < 0, np.arange(len(xyz)), parent)], axis=1)
    node = by_paths(parent, length)
    return node, renumbered(parent, node)


def rooted(count: int, edges: ArrayLike, height: ArrayLike | None = None) -> Positions:
    """Direct the edges of one tree away from its root.

    Parameters
    ----------
    count : int
        Number of nodes.
    edges : (E, 2) array_like of int
        As in `from_edges`.
    height : (N,) array_like of float, optional
        Without it the first node to which no edge leads is the root.

    Returns
    -------
    parent : (N,) array of int64
        Parent of each node in the given numbers, -1 at the root.

    Raises
    ------
    ModelError
        As in `from_edges`.
    """
    pairs = _checked(count, edges)
    free = np.flatnonzero(np.bincount(pairs[:, 1], minlength=count) == 0)
    root = int(free[0]) if len(free) else 0
    if len(free) > 1 and height is not None:
        root = int(np.argmin(height))
    both = np.concatenate([pairs, pairs[:, ::-1]])
    both = np.unique(both, axis=0)
    first = np.searchsorted(both[:, 0], np.arange(count + 1)).tolist()
    near = both[:, 1].tolist()
    parent = [-2] * count
    parent[root] = -1
    waiting = deque([root])
    while waiting:
        i = waiting.popleft()
        for j in near[first[i] : first[i + 1]]:
            if parent[j] == -2:
                parent[j] = i
                waiting.append(j)
    lonely = parent.count(-2)
    if lonely:
        msg = (
            f"node {parent.index(-2)} is not connected to the root, node {root} ({lonely} of {count} nodes "
            "are not); keep one tree a file"
        )
        raise ModelError(msg)
    if len(both) // 2 != count - 1:
        msg = (
            f"{len(both) // 2} edges join {count} nodes, a tree has {count - 1}: the graph has a cycle; "
            "remove the edges that close it (a spanning tree)"
        )
        raise ModelError(msg)
    return np.array(parent, dtype=np.int64)


def by_paths(parent: ArrayLike, length: ArrayLike, *, goes_on: ArrayLike | None = None) -> Positions:
    """Order the nodes of a rooted tree path by path.

    Parameters
    ----------
    parent : (N,) array_like of int
        Parent of each node, -1 at the one root; nodes in any order.
    length : (N,) array_like of float
        Length of the segment that ends at each node. At a fork the branch goes on with the child
        that carries the most, its own segment included (the first of equals).
    goes_on : (N,) array_like of bool, optional
        Nodes that are known to continue their parent's branch: they come before all others.

    Returns
    -------
    node : (N,) array of int64
        ``node[k]`` is the node that gets number k.

    Raises
    ------
    ModelError
        If there is not exactly one root, or a node cannot be reached from it.

    Examples
    --------
    >>> by_paths([-1, 0, 0, 2, 2], [0, 1, 1, 1, 5]).tolist()
    [0, 2, 4, 1, 3]
    """
    above = np.asarray(parent, dtype=np.int64).tolist()
    order, below = _downward(above)
    carried = np.asarray(length, dtype=np.float64).tolist()
    known = [False] * len(above) if goes_on is None else np.asarray(goes_on, dtype=bool).tolist()
    for i in reversed(order[1:]):
        carried[above[i]] += carried[i]
    ahead = [max(children, key=lambda c: (known[c], carried[c], -c), default=-1) for children in below]
    return number_by_paths(above, ahead)


def number_by_paths(parent: ArrayLike, ahead: ArrayLike) -> Positions:
    """Order the nodes of a rooted tree path by path, where it is known which child goes on.

    The stem comes first; side branches follow in the order in which their feet come, each as one
    run of numbers.

    Parameters
    ----------
    parent : (N,) array_like of int
        Parent of each node, -1 at the one root.
    ahead : (N,) array_like of int
        The child that continues each node's branch, -1 at tips.

    Returns
    -------
    (N,) array of int64
        The old number of each new node.
    """
    above = np.asarray(parent, dtype=np.int64).tolist()
    following = np.asarray(ahead, dtype=np.int64).tolist()
    sides: list[list[int]] = [[] for _ in above]
    for child, foot in enumerate(above):
        if foot >= 0 and following[foot] != child:
            sides[foot].append(child)
    node: list[int] = []
    starts = [next(i for i, foot in enumerate(above) if foot < 0)]
    for here in starts:  # grows while it is walked: breadth first over branches
        while here >= 0:
            node.append(here)
            starts.extend(sides[here])
            here = following[here]  # noqa: PLW2901 (the loop walks on from each start)
    return np.array(node, dtype=np.int64)


def renumbered(parent: ArrayLike, node: ArrayLike) -> NDArray[np.int32]:
    """Express `parent` in the new numbers of `by_paths`.

    Parameters
    ----------
    parent : (N,) array_like of int
        Parent of each node in old numbers.
    node : (N,) array_like of int
        The old number of each new node.

    Returns
    -------
    (N,) array of int32
        Parent of each new node, -1 at the root.
    """
    old = np.asarray(node, dtype=np.int64)
    new = np.full(len(old) + 1, -1, dtype=np.int32)  # the last place answers for parent -1
    new[old] = np.arange(len(old), dtype=np.int32)
    return new[np.asarray(parent, dtype=np.int64)[old]]


def _downward(above: list[int]) -> tuple[list[int], list[list[int]]]:
    """Return the nodes with parents before children, and the children of each node."""
    roots = [i for i, p in enumerate(above) if p < 0]
    if len(roots) != 1:
        msg = f"{len(roots)} nodes have no parent, expected one root; keep one tree a file"
        raise ModelError(msg)
    below: list[list[int]] = [[] for _ in above]
    for i, p in enumerate(above):
        if p >= len(above):
            msg = f"node {i} names the parent {p}, but the last node is {len(above) - 1}; mend its parent"
            raise ModelError(msg)
        if p >= 0:
            below[p].append(i)
    order = roots
    for i in order:  # grows while it is walked: breadth first
        order.extend(below[i])
    if len(order) != len(above):
        lost = (set(range(len(above))) - set(order)).pop()
        msg = f"node {lost} is its own ancestor; break the cycle"
        raise ModelError(msg)
    return order, below


def _checked(count: int, edges: ArrayLike) -> Positions:
    """Return the edges as (E, 2) int64 after the checks that need no walking."""
    pairs = np.asarray(edges)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not len(pairs) or count < 2:
        msg = f"a skeleton needs two nodes and an edge, found {count} nodes and edges of shape {pairs.shape}"
        raise ModelError(msg)
    if not np.isfinite(pairs).all() or (pairs != np.rint(pairs)).any():
        msg = "an edge names a node by something that is not a whole number; mend the file"
        raise ModelError(msg)
    bad = np.flatnonzero(((pairs < 0) | (pairs >= count)).any(axis=1))
    if len(bad):
        a, b = pairs[bad[0]].tolist()
        msg = f"edge {bad[0]} joins nodes {a} and {b}, but nodes run from 0 to {count - 1}; mend the file"
        raise ModelError(msg)
    loops = np.flatnonzero(pairs[:, 0] == pairs[:, 1])
    if len(loops):
        msg = f"edge {loops[0]} joins node {int(pairs[loops[0], 0])} to itself, a cycle; remove it"
        raise ModelError(msg)
    return pairs.astype(np.int64)
