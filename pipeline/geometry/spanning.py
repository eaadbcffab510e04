"""Exact Euclidean minimum spanning trees, by Boruvka's rounds over a box tree that knows components."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAF = 8  # points in a leaf of the box tree


def distinct_edges(pairs: Ints, count: int) -> Ints:
    """Give every edge once, the smaller end first, sorted.

    Parameters
    ----------
    pairs : (E, 2) array of int
        Ends of the edges, in any direction, again and again.
    count : int
        Points that there are.
    """
    keys = np.sort(pairs.min(axis=1) * count + pairs.max(axis=1))  # ten times as quick as np.unique
    return np.column_stack(np.divmod(keys[np.diff(keys, prepend=-1) > 0], count))


def euclidean_tree(xyz: Floats) -> tuple[Ints, Floats]:
    """Return the minimum spanning tree of the complete graph over `xyz`.

    Parameters
    ----------
    xyz : (P, 3) array
        Points, in metres.

    Returns
    -------
    edges : (P - 1, 2) array of int
        Pairs of points, the smaller index first, sorted.
    lengths : (P - 1,) array
        Their lengths in metres.

    Notes
    -----
    Boruvka (1926): in every round each component takes its shortest edge to another one. The
    points are laid along a space-filling curve, boxes over runs of it form a binary tree, and a
    search passes over boxes that lie wholly in the component it starts from (March, Ram & Gray
    2010, "Fast Euclidean minimum spanning tree"). Ties are broken by index, so the tree is unique.
    """
    pairs = shortest_bridges(xyz, np.arange(len(xyz)))
    return pairs, np.linalg.norm(xyz[pairs[:, 0]] - xyz[pairs[:, 1]], axis=1)


def shortest_bridges(xyz: Floats, component: Ints) -> Ints:
    """Return the shortest edges that join components of points into one.

    Parameters
    ----------
    xyz : (P, 3) array
        Points, in metres.
    component : (P,) array of int
        The component of every point, from 0 to below P.

    Returns
    -------
    (C - 1, 2) array of int
        Pairs of points, the smaller index first, sorted; C is the number of components.
    """
    if len(xyz) < 2:
        return np.empty((0, 2), dtype=np.int64)
    order = np.argsort(_curve_position(xyz), kind="stable")
    _, first, label = np.unique(component[order], return_index=True, return_inverse=True)
    pairs = order[_boruvka(np.ascontiguousarray(xyz[order]), order, first[label.ravel()], len(first))]
    pairs.sort(axis=1)
    return np.asarray(pairs[np.lexsort(pairs.T[::-1])])


def _curve_position(xyz: Floats) -> NDArray[np.uint64]:
    """Position of every point on a Morton (Z-order) curve through the bounding box."""
    low, size = xyz.min(axis=0), float(np.ptp(xyz, axis=0).max()) or 1.0
    cell = np.minimum((xyz - low) / size * (2**20), 2**20 - 1).astype(np.uint64)
    code = np.zeros(len(xyz), dtype=np.uint64)
    for axis in range(3):
        bits = cell[:, axis]
        for shift, mask in (
            (32, 0x1F00000000FFFF),
            (16, 0x1F0000FF0000FF),
            (8, 0x100F00F00F00F00F),
            (4, 0x10C30C30C30C30C3),
            (2, 0x1249249249249249),
        ):
            bits = (bits | (bits << np.uint64(shift))) & np.uint64(mask)
        code |= bits << np.uint64(axis)
    return code


@compiled
def _boxes(xyz: Floats, leaves: int) -> tuple[Floats, Floats]:
    """Bounding boxes of a heap-numbered binary tree over runs of `LEAF` points."""
    low = np.full((2 * leaves, 3), np.inf)
    high = np.full((2 * leaves, 3), -np.inf)
    for i in range(len(xyz)):
        node = leaves + i // LEAF
        for d in range(3):
            low[node, d] = min(low[node, d], xyz[i, d])
            high[node, d] = max(high[node, d], xyz[i, d])
    for node in range(leaves - 1, 0, -1):
        for d in range(3):
            low[node, d] = min(low[2 * node, d], low[2 * node + 1, d])
            high[node, d] = max(high[2 * node, d], high[2 * node + 1, d])
    return low, high


@compiled
def _label_boxes(component: Ints, leaves: int) -> Ints:
    """Component of every box, -1 where it is mixed, -2 where it is empty."""
    label = np.full(2 * leaves, -2, dtype=np.int64)
    for i in range(len(component)):
        node = leaves + i // LEAF
        if label[node] == -2:
            label[node] = component[i]
        elif label[node] != component[i]:
            label[node] = -1
    for node in range(leaves - 1, 0, -1):
        a, b = label[2 * node], label[2 * node + 1]
        label[node] = a if (b in (-2, a)) else -1
    return label


@compiled
def _gap(x: Floats, low: Floats, high: Floats) -> float:
    """Squared distance from a point to a box."""
    total = 0.0
    for d in range(3):
        off = max(low[d] - x[d], 0.0, x[d] - high[d])
        total += off * off
    return total


@compiled
def _nearest_outside(
    i: int, xyz: Floats, component: Ints, tree: tuple[Floats, Floats, Ints], bound: float, rank: Ints
) -> tuple[float, int]:
    """Nearest point to `i` of another component within `bound` (squared), or -1."""
    low, high, label = tree
    leaves = len(label) // 2
    stack = np.empty(64, dtype=np.int64)
    stack[0], top = 1, 1
    best, found = bound, -1
    while top:
        top -= 1
        node = stack[top]
        if label[node] in (-2, component[i]) or _gap(xyz[i], low[node], high[node]) > best:
            continue
        if node < leaves:
            left, right = 2 * node, 2 * node + 1
            if _gap(xyz[i], low[left], high[left]) < _gap(xyz[i], low[right], high[right]):
                left, right = right, left
            stack[top], stack[top + 1] = left, right  # the nearer one is taken first
            top += 2
            continue
        first = (node - leaves) * LEAF
        for j in range(first, min(first + LEAF, len(xyz))):
            if component[j] == component[i]:
                continue
            gap = 0.0
            for d in range(3):
                gap += (xyz[i, d] - xyz[j, d]) ** 2
            if gap < best or (gap == best and (found < 0 or rank[j] < rank[found])):
                best, found = gap, j
    return best, found


@compiled
def _root(parent: Ints, i: int) -> int:
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@compiled
def _boruvka(xyz: Floats, rank: Ints, start: Ints, components: int) -> Ints:
    """Edges that join the components as pairs of positions; ties fall to the smaller `rank` pair.

    `start` holds, for every point, the first position of its component.
    """
    count = len(xyz)
    leaves = 1
    while leaves * LEAF < count:
        leaves *= 2
    low, high = _boxes(xyz, leaves)
    parent = start.copy()
    component = start.copy()
    # the nearest point outside the component at the last look: a bound that only grows
    last = np.zeros(count)
    edges = np.empty((components - 1, 2), dtype=np.int64)
    made = 0
    while made < components - 1:
        tree = (low, high, _label_boxes(component, leaves))
        best = np.full(count, np.inf)
        link = np.full((count, 2), -1, dtype=np.int64)
        for i in range(count):
            c = component[i]
            if last[i] > best[c]:
                continue
            gap, j = _nearest_outside(i, xyz, component, tree, best[c], rank)
            if j < 0:
                last[i] = best[c]
                continue
            last[i] = gap
            a, b = min(rank[i], rank[j]), max(rank[i], rank[j])
            better = gap < best[c]
            if not better and link[c, 0] >= 0:
                p, q = rank[link[c, 0]], rank[link[c, 1]]
                better = (a, b) < (min(p, q), max(p, q))
            if better:
                best[c] = gap
                link[c, 0], link[c, 1] = i, j
        for c in range(count):
            if link[c, 0] < 0:
                continue
            a, b = _root(parent, link[c, 0]), _root(parent, link[c, 1])
            if a != b:
                parent[max(a, b)] = min(a, b)
                edges[made, 0], edges[made, 1] = link[c, 0], link[c, 1]
                made += 1
        for i in range(count):
            component[i] = _root(parent, i)
    return edges
