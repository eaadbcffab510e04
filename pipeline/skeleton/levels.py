"""Level sets of the distance from the base: one node for every connected slice of wood."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from pipeline.geometry.compiled import compiled
from pipeline.geometry.spanning import distinct_edges, shortest_bridges

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

STEP_M = 1e-5  # lengths are compared in steps of this: points on a raster lie equally far from many others
SPARE = 4  # neighbours asked for beyond those needed, to choose among equals
CLEARLY = 1.0 - 1e-4


@dataclass(frozen=True, eq=False)
class Slices:
    """Connected slices of points at equal distance from the base, in the order of that distance.

    Parameters
    ----------
    xyz : (S, 3) array
        Mean of the points of each slice, metres.
    parent : (S,) array of int
        The slice from which each is reached, or -1.
    source : (S,) array of int
        Where parent is -1, the source vertex from which it is reached (-1 at the base itself).
    thickness : (S,) array
        Root mean square distance of the slice's points from the line of the branch, metres.
    support : (S,) array
        Points in each slice.
    """

    xyz: Floats
    parent: Ints
    source: Ints
    thickness: Floats
    support: Floats

    def less_noise(self, noise: float) -> Slices:
        """The same slices, their thickness freed of range noise (metres) in two directions."""
        square = self.thickness**2 - 2.0 * noise**2
        thickness = np.sqrt(np.maximum(square, (0.3 * self.thickness) ** 2))
        return Slices(self.xyz, self.parent, self.source, thickness, self.support)


def joined_neighbours(xyz: Floats, neighbours: int) -> tuple[Ints, Ints]:
    """The k nearest neighbours of every point, and all edges with the bridges between parts.

    Parameters
    ----------
    xyz : (P, 3) array
    neighbours : int

    Returns
    -------
    near : (P, k) array of int
    pairs : (E, 2) array of int
        Every edge once, the smaller index first, sorted.
    """
    near = _nearest(xyz, min(neighbours, len(xyz) - 1))
    pairs = np.column_stack([np.repeat(np.arange(len(xyz)), near.shape[1]), near.ravel()])
    graph = coo_array((np.ones(len(pairs), dtype=np.int8), pairs.T), shape=(len(xyz), len(xyz)))
    parts, part = connected_components(graph, directed=False)
    if parts > 1:
        pairs = np.vstack([pairs, shortest_bridges(xyz, part.astype(np.int64))])
    return near, distinct_edges(pairs, len(xyz))


def _nearest(xyz: Floats, count: int) -> Ints:
    """(P, count) nearest other points; of those that lie equally far (on a raster), the first ones."""
    asked = min(count + 1 + SPARE, len(xyz))
    away, near = cKDTree(xyz).query(xyz, k=asked)
    away, near = away.reshape(len(xyz), -1)[:, 1:], near.reshape(len(xyz), -1)[:, 1:].astype(np.int64)
    step = np.round(away / STEP_M).astype(np.int64)
    order = np.argsort(step * len(xyz) + near, axis=1, kind="stable")[:, :count]
    return np.take_along_axis(near, order, axis=1)


def gabriel(xyz: Floats, near: Ints, pairs: Ints) -> Ints:
    """Drop the edges that a common neighbour makes needless.

    Edge ij goes when a point k that is joined to both lies in the ball over ij:
    ``d_ik^2 + d_kj^2 < d_ij^2``. The shorter way over k stays, so nothing falls apart.

    References
    ----------
    Gabriel & Sokal (1969), restricted to the neighbours of i and j.
    """
    return np.asarray(pairs[_gabriel(xyz, near, pairs)])


@compiled
def _joined(near: Ints, a: int, b: int) -> bool:
    for k in near[a]:
        if k == b:
            return True
    for k in near[b]:  # noqa: SIM110 (a generator does not compile)
        if k == a:
            return True
    return False


@compiled
def _gabriel(xyz: Floats, near: Ints, pairs: Ints) -> NDArray[np.bool_]:
    keep = np.ones(len(pairs), dtype=np.bool_)
    for e in range(len(pairs)):
        i, j = pairs[e]
        square = ((xyz[i] - xyz[j]) ** 2).sum()
        for end in range(2):
            for k in near[i if end == 0 else j]:
                far = j if end == 0 else i
                if k == far or not _joined(near, k, far):
                    continue
                total = 0.0
                for d in range(3):
                    total += (xyz[i, d] - xyz[k, d]) ** 2 + (xyz[k, d] - xyz[j, d]) ** 2
                if total < CLEARLY * square:
                    keep[e] = False
                    break
            if not keep[e]:
                break
    return keep


def distances(xyz: Floats, pairs: Ints, sources: Ints, cost: Floats) -> tuple[Floats, Ints]:
    """Shortest way to every point from the sources, each of which has a cost of its own to start.

    Parameters
    ----------
    xyz : (P, 3) array
    pairs : (E, 2) array of int
    sources : (S,) array of int
    cost : (S,) array
        Metres.

    Returns
    -------
    distance : (P,) array
    before : (P,) array of int
        The point before each on its way; -1 where a source starts by itself.
    """
    count = len(xyz)
    # in whole steps sums are exact, so that ways of equal length stay equal however the cloud is turned
    length = np.linalg.norm(xyz[pairs[:, 0]] - xyz[pairs[:, 1]], axis=1)
    length = np.maximum(np.round(length / STEP_M), 1.0)
    rows = np.concatenate([pairs[:, 0], pairs[:, 1], np.full(len(sources), count)])
    columns = np.concatenate([pairs[:, 1], pairs[:, 0], sources])
    weights = np.concatenate([length, length, np.round(cost / STEP_M) + 1.0])
    graph = csr_array((weights, (rows, columns)), shape=(count + 1, count + 1))
    distance, before = dijkstra(graph, indices=count, return_predecessors=True)
    before = before[:count].astype(np.int64)
    before[before == count] = -1
    return (distance[:count] - 1.0) * STEP_M, before


def slice_points(
    xyz: Floats, pairs: Ints, way: tuple[Floats, Ints], height_m: float, claimed: NDArray[np.bool_]
) -> Slices:
    """Cut the points into connected slices of equal distance, and link each to the one before.

    Parameters
    ----------
    xyz : (P, 3) array
    pairs : (E, 2) array of int
        Edges along which a slice is connected.
    way : tuple
        `distances`' result.
    height_m : float
        Thickness of a slice, metres.
    claimed : (P,) array of bool
        Points that belong to known limbs and make no slices.

    References
    ----------
    Verroust & Lazarus (2000), "Extracting skeletal curves from 3D scattered data".
    """
    distance, before = way
    level = np.floor(distance / height_m)
    a, b = pairs[(level[pairs[:, 0]] == level[pairs[:, 1]]) & ~claimed[pairs].any(axis=1)].T
    link = coo_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(len(xyz), len(xyz)))
    _, label = connected_components(link, directed=False)
    free = np.flatnonzero(~claimed)
    order = free[np.lexsort((free, distance[free]))]
    _, first, which = np.unique(label[order], return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))  # slices in the order of their nearest point
    number = np.full(len(xyz), -1, dtype=np.int64)
    number[order] = rank[which.ravel()]
    head = order[np.sort(first)]
    previous = before[head]
    parent = np.where(previous >= 0, number[np.maximum(previous, 0)], -1)
    source = np.where(parent < 0, previous, -1)
    return _gather(xyz[order], number[order], parent, source)


def _gather(xyz: Floats, number: Ints, parent: Ints, source: Ints) -> Slices:
    """Mean, count and thickness of every slice."""
    support = np.bincount(number).astype(np.float64)
    mean = np.column_stack([np.bincount(number, values) / support for values in xyz.T])
    way = np.where((parent >= 0)[:, None], mean - mean[np.maximum(parent, 0)], 0.0)
    norm = np.linalg.norm(way, axis=1, keepdims=True)
    way = np.divide(way, norm, out=np.zeros_like(way), where=norm > 0)
    off = xyz - mean[number]
    across = (off**2).sum(axis=1) - (off * way[number]).sum(axis=1) ** 2
    thickness = np.sqrt(np.maximum(np.bincount(number, across) / support, 0.0))
    return Slices(mean, parent, source, thickness, support)
