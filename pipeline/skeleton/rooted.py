"""From a graph to a rooted tree: where the stem stands, and which edges carry the growth."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import breadth_first_order, dijkstra, minimum_spanning_tree

from pipeline.errors import NotATreeError
from pipeline.geometry.branching import continue_branches
from pipeline.geometry.numbering import number_by_paths
from pipeline.model import PointCloud, Skeleton

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

LEAST_THICKNESS_M = 0.003  # a slice of two points has none, and logarithms are taken


@dataclass(frozen=True, eq=False)
class Rooted:
    """Nodes with parents before children, before any branch structure is chosen.

    Parameters
    ----------
    xyz : (N, 3) array
        Positions in metres.
    parent : (N,) array of int
        -1 at the root, which is node 0.
    thickness : (N,) array
        Local radius of the wood in metres, as the points show it.
    support : (N,) array
        Points that each node stands for.
    """

    xyz: Floats
    parent: Ints
    thickness: Floats
    support: Floats

    def keep(self, mask: NDArray[np.bool_]) -> Rooted:
        """Drop the nodes outside `mask` (which must hold every kept node's parent)."""
        number = np.cumsum(mask) - 1
        parent = np.where(self.parent >= 0, number[np.maximum(self.parent, 0)], -1)[mask]
        return Rooted(self.xyz[mask], parent, self.thickness[mask], self.support[mask])


def find_root(xyz: Floats, thickness: Floats, support: Floats) -> int:
    """Return the node at the foot of the stem.

    Among the nodes of the lowest part of the tree, each height slice votes for the place where
    most wood stands (points times thickness); the lowest node of that stem is the root. A lone
    low point or a patch of ground has no thickness to vote with.

    Parameters
    ----------
    xyz : (N, 3) array
    thickness, support : (N,) arrays
        As in `Rooted`.
    """
    z = xyz[:, 2]
    height = float(np.ptp(z))
    low = np.flatnonzero(z <= z.min() + max(0.08 * height, 0.3))
    weight = support[low] * thickness[low]
    reach = np.maximum(np.quantile(thickness[low], 0.9), 0.05)
    gap = np.linalg.norm(xyz[low, None, :2] - xyz[None, low, :2], axis=2) if len(low) < 4000 else None
    if gap is None:
        best = int(np.argmax(weight))
        gap_to_best = np.linalg.norm(xyz[low, :2] - xyz[low[best], :2], axis=1)
    else:
        votes = (gap <= 2.0 * reach) @ weight
        best = int(np.argmax(votes))
        gap_to_best = gap[best]
    stem = low[gap_to_best <= 2.0 * reach]
    return int(stem[np.lexsort((stem, z[stem]))[0]])


def by_minimum_spanning_tree(graph: csr_array, root: int) -> tuple[Ints, Ints]:
    """Order and predecessors of the minimum spanning tree of `graph`, walked from `root`."""
    tree = minimum_spanning_tree(graph)
    order, before = breadth_first_order(tree + tree.T, root, directed=False)
    return order.astype(np.int64), before.astype(np.int64)


def by_shortest_paths(graph: csr_array, root: int) -> tuple[Ints, Ints]:
    """Order and predecessors of the shortest paths from `root`, each edge at its squared length.

    References
    ----------
    Du et al. (2019), "AdTree", section 2.1, whose "minimum spanning tree" this is.
    """
    squared = graph.copy()
    squared.data = squared.data**2
    distance, before = dijkstra(squared, directed=False, indices=root, return_predecessors=True)
    return np.argsort(distance, kind="stable").astype(np.int64), before.astype(np.int64)


def arrange(order: Ints, before: Ints, xyz: Floats, thickness: Floats, support: Floats) -> Rooted:
    """Number the nodes in `order` (the root first) and translate their predecessors."""
    number = np.full(len(xyz), -1, dtype=np.int64)
    number[order] = np.arange(len(order))
    parent = before[order]
    parent = np.where(parent >= 0, number[np.maximum(parent, 0)], -1)
    return Rooted(xyz[order], parent, thickness[order], support[order])


def skeleton_of(tree: Rooted, cloud: PointCloud, window_m: float) -> Skeleton:
    """Choose which way each branch goes on, and number the nodes path by path.

    Parameters
    ----------
    tree : Rooted
    cloud : PointCloud
        Where origin, reference system and metadata come from.
    window_m : float
        Least length over which directions are taken at a fork, metres.

    Raises
    ------
    NotATreeError
        If there are fewer than two nodes.
    """
    if len(tree.parent) < 2:
        msg = "the points make no skeleton of two nodes or more; are they one tree, in metres?"
        raise NotATreeError(msg)
    thickness = np.maximum(tree.thickness, LEAST_THICKNESS_M)
    ahead = continue_branches(tree.xyz, tree.parent, thickness, window_m)
    order = number_by_paths(tree.parent, ahead)
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    parent = tree.parent[order]
    parent[1:] = number[parent[1:]]
    return Skeleton(tree.xyz[order], parent.astype(np.int32), cloud.origin, cloud.crs, dict(cloud.metadata))
