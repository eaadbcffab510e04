"""What of one tree's axes another has: recall, precision, branch orders, and branches with their parents."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import networkx as nx
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.accuracy.nodes import Pairs
from pipeline.accuracy.wood import Marks, Wood

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

NEAR_M = 0.05
"""Axes that come so near to each other are the same."""

MOST = 0.5
"""A branch is matched when this share of its axis (of its nodes, where they are pairs) is of one branch."""


@dataclass(frozen=True)
class Branches:
    """Branches of B and those of A that run along them.

    Parameters
    ----------
    a, b : int
        Numbers of branches.
    matched : int
        Branches of B of which half the axis or more runs along one branch of A.
    parent_matched : int
        Those of them that grow from the branch of A that runs along their own parent; the stem counts.
    """

    a: int
    b: int
    matched: int
    parent_matched: int


@dataclass(frozen=True)
class Topology:
    """How far the axes of A are those of the reference B.

    Parameters
    ----------
    recall, precision : float
        Share of B's axis within 5 cm of A's, and of A's within 5 cm of B's.
    recall_by_order : tuple of float or None
        Recall of B's branches by their order; None of orders that B has not.
    order_accuracy : float or None
        Share of the recalled axis that has the same branch order in both.
    order_confusion_m : tuple of tuple of float
        Metres of the recalled axis: rows are orders in B, columns orders in A.
    radius_error_mm : float or None
        Mean difference of the radii along the recalled axis.
    branches : Branches
    same_branching : bool
        Whether the trees have the same branches on the same parents: their graphs of branches are one and the
        same when matched branches are given the same names.
    """

    recall: float
    precision: float
    recall_by_order: tuple[float | None, ...]
    order_accuracy: float | None
    order_confusion_m: tuple[tuple[float, ...], ...]
    radius_error_mm: float | None
    branches: Branches
    same_branching: bool


def topology(a: Wood, b: Wood, pairs: Pairs | None = None) -> Topology:
    """Compare the axes of A with those of the reference B.

    Parameters
    ----------
    a, b : Wood
    pairs : Pairs, optional
        Where the nodes of two models are pairs by number or shape, branches are matched by them: twigs
        that lie in each other are then told apart.
    """
    mine, theirs = a.marks, b.marks
    gap, at = cKDTree(mine.xyz).query(theirs.xyz)
    found = gap < NEAR_M
    back = cKDTree(theirs.xyz).query(mine.xyz)[0] < NEAR_M
    order, true_order = a.order[mine.segment][at], b.order[theirs.segment]
    along = (a.branch[mine.segment][at], b.branch[theirs.segment], found)
    if pairs is not None and pairs.by != "nearest":
        along = (a.branch, b.branch[pairs.partner[1:] - 1], pairs.distance[1:] < NEAR_M)
    partner = _partners(*along, len(b.branch_parent))
    step = (b.length / np.bincount(theirs.segment, minlength=len(b)))[theirs.segment]
    return Topology(
        recall=float(found.mean()),
        precision=float(back.mean()),
        recall_by_order=tuple(_mean(found[true_order == k]) for k in range(int(true_order.max()) + 1)),
        order_accuracy=_mean((order == true_order)[found]),
        order_confusion_m=_confusion(true_order[found], order[found], step[found]),
        radius_error_mm=_radius_error_mm(a, b, mine.segment[at], theirs, found),
        branches=_counted(a, b, partner),
        same_branching=_same_branching(a, b, partner),
    )


def _mean(flags: NDArray[np.bool_]) -> float | None:
    return float(flags.mean()) if len(flags) else None


def _confusion(rows: Ints, columns: Ints, weight: Floats) -> tuple[tuple[float, ...], ...]:
    """Return summed weights by row and column."""
    if not len(rows):
        return ()
    table = np.zeros((int(rows.max()) + 1, int(columns.max()) + 1))
    np.add.at(table, (rows, columns), weight)
    return tuple(tuple(row) for row in table.tolist())


def _radius_error_mm(a: Wood, b: Wood, segment: Ints, marks: Marks, found: NDArray[np.bool_]) -> float | None:
    """Return the mean difference of radii at marks of B and at their feet on segments of A."""
    mine, theirs = a.tubes(), b.tubes()
    if mine is None or theirs is None or not found.any():
        return None
    along = (a.end - a.start)[segment]
    square = np.maximum(np.einsum("ij,ij->i", along, along), 1e-12)
    share = np.clip(np.einsum("ij,ij->i", marks.xyz - a.start[segment], along) / square, 0, 1)
    radius = mine.start_radius[segment] + share * (mine.end_radius - mine.start_radius)[segment]
    other = theirs.start_radius[marks.segment]
    other = other + marks.share * (theirs.end_radius[marks.segment] - other)
    return float(1000.0 * np.abs(radius - other)[found].mean())


def _partners(mine: Ints, theirs: Ints, found: NDArray[np.bool_], count: int) -> Ints:
    """Return the branch of A that runs along most of each branch of B, -1 where none has enough of it."""
    partner = np.full(count, -1, dtype=np.int64)
    pair, held = np.unique(np.column_stack([theirs, mine])[found], axis=0, return_counts=True)
    upward = np.argsort(held, kind="stable")[::-1]
    total = np.bincount(theirs, minlength=count)
    first = upward[np.unique(pair[upward, 0], return_index=True)[1]]
    enough = held[first] >= MOST * total[pair[first, 0]]
    partner[pair[first[enough], 0]] = pair[first[enough], 1]
    return partner


def _counted(a: Wood, b: Wood, partner: Ints) -> Branches:
    here = np.unique(b.branch)
    here = here[partner[here] >= 0]
    below = b.branch_parent[here]
    wanted = np.where(below >= 0, partner[np.maximum(below, 0)], -1)
    right = (a.branch_parent[partner[here]] == wanted) & ((below < 0) | (wanted >= 0))
    return Branches(len(np.unique(a.branch)), len(np.unique(b.branch)), len(here), int(right.sum()))


def _same_branching(a: Wood, b: Wood, partner: Ints) -> bool:
    """Tell whether matching is an isomorphism of the graphs of branches."""
    graph_a, graph_b = branch_graph(a), branch_graph(b)
    names = {branch: int(partner[branch]) for branch in graph_b}
    if len(set(names.values())) < len(names) or graph_a.number_of_nodes() != len(names):
        return False
    renamed = nx.relabel_nodes(graph_b, names)
    return set(renamed) == set(graph_a) and set(renamed.edges) == set(graph_a.edges)


def branch_graph(wood: Wood) -> nx.DiGraph[int]:
    """Return the graph of branches: an edge from each to those that grow from it, with `length_m`.

    The length of an edge is that of the branch it leads to.
    """
    graph: nx.DiGraph[int] = nx.DiGraph()
    length = np.bincount(wood.branch, wood.length)
    for branch in np.unique(wood.branch).tolist():
        graph.add_node(branch, length_m=float(length[branch]))
        below = int(wood.branch_parent[branch])
        if below >= 0:
            graph.add_edge(below, branch, length_m=float(length[branch]))
    return graph


def path_statistics(wood: Wood) -> dict[str, Any]:
    """Return what the ways from the root are like.

    Returns
    -------
    dict
        ``longest_m`` and ``mean_m`` from the root to the tips of branches along the axes; ``max_order`` and
        ``mean_order`` of the branches.
    """
    graph = branch_graph(wood)
    roots = [branch for branch in graph if graph.in_degree(branch) == 0]
    depth = nx.multi_source_dijkstra_path_length(graph, set(roots), weight=None)
    tip = np.zeros(max(graph, default=0) + 1)
    np.maximum.at(tip, wood.branch, wood.path)
    ends = tip[sorted(graph)]
    return {
        "longest_m": float(ends.max()),
        "mean_m": float(ends.mean()),
        "max_order": int(max(depth.values())),
        "mean_order": float(np.mean(list(depth.values()))),
    }
