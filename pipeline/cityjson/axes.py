"""Lines back to a tree: of the compact profile, of skeleton objects, and of the files of 2021.

Lines that grow start where an earlier one passes, and go on to new vertices. Other lines, such as the
edges of a graph in any order, are put in order from the root: the vertex that nothing leads to, else
the lowest. Nodes are numbered as their vertices where that puts parents first, else as they appear.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError
from pipeline.model import Floats

Line = list[int]


@dataclass(frozen=True)
class Grown:
    """A tree made of lines.

    Parameters
    ----------
    vertex : list of int
        Vertex of every node.
    parent : list of int
        Parent of every node, -1 at the root; parents first.
    at : list of (line, position)
        Where in the lines each node lies, as the end of a segment; (0, 0) for the root.
    """

    vertex: list[int]
    parent: list[int]
    at: list[tuple[int, int]]


def grown(lines: list[Line], points: Floats, *, feet: Mapping[int, int] | None = None) -> Grown:
    """Join lines to a tree.

    Parameters
    ----------
    lines : list of list of int
        Vertices.
    points : (V, 3) array of float64
        To find the lowest vertex and the longest branches.
    feet : mapping, optional
        Where it is given, the lines grow, two nodes may share a vertex, and it tells the first node
        of the lines whose vertex does not tell it.

    Returns
    -------
    Grown

    Raises
    ------
    InputFormatError
        If the lines make no tree.
    """
    return _by_vertex(_as_they_grow(lines, feet) or _as_a_graph(lines, points))


def _by_vertex(made: Grown) -> Grown:
    """Number the nodes as their vertices, where every node has its own and parents come first."""
    vertex, parent = np.array(made.vertex), np.array(made.parent)
    order = np.argsort(vertex, kind="stable")
    if (np.diff(vertex[order]) == 0).any() or (vertex[parent[1:]] >= vertex[1:]).any():
        return made
    number = np.empty(len(order), dtype=np.int64)
    number[order] = np.arange(len(order))
    above = [-1, *number[parent[order[1:]]].tolist()]
    return Grown(vertex[order].tolist(), above, [made.at[i] for i in order.tolist()])


def _as_they_grow(lines: list[Line], feet: Mapping[int, int] | None) -> Grown | None:
    """Follow lines that grow; None where they do not."""
    made = Grown([lines[0][0]], [-1], [(0, 0)])
    first = {lines[0][0]: 0}
    for number, line in enumerate(lines):
        last = len(made.parent) - 1
        above = last if made.vertex[last] == line[0] else first.get(line[0], -1)
        above = feet.get(number, above) if feet else above
        if not 0 <= above <= last:
            if feet is None:
                return None
            msg = f"line {number} starts at no node of an earlier line; write the file anew from its tree"
            raise InputFormatError(msg)
        for k, vertex in enumerate(line[1:], 1):
            if feet is None and vertex in first:
                return None
            above = _add(made, vertex, above, (number, k))
            first.setdefault(vertex, above)
    return made


def _add(made: Grown, vertex: int, above: int, at: tuple[int, int]) -> int:
    made.vertex.append(vertex)
    made.parent.append(above)
    made.at.append(at)
    return len(made.parent) - 1


@dataclass
class _Graph:
    """Edges between vertices: where each lies in the lines, and who is next to whom."""

    edge: dict[tuple[int, int], tuple[int, int]] = field(default_factory=dict)
    beside: dict[int, list[int]] = field(default_factory=dict)

    @classmethod
    def of(cls, lines: list[Line]) -> _Graph:
        graph = cls(beside={lines[0][0]: []})
        for number, line in enumerate(lines):
            for k, (a, b) in enumerate(pairwise(line), 1):
                if a != b and (a, b) not in graph.edge and (b, a) not in graph.edge:
                    graph.edge[a, b] = (number, k)
                    graph.beside.setdefault(a, []).append(b)
                    graph.beside.setdefault(b, []).append(a)
        return graph

    def root(self, points: Floats) -> int:
        """Return the vertex that nothing leads to, where that is one; else the lowest."""
        ends = {b for _, b in self.edge}
        starts = [v for v in self.beside if v not in ends]
        if len(starts) == 1 and len(ends) == len(self.edge):
            return starts[0]
        return min(self.beside, key=lambda v: (points[v, 2], v))


def _as_a_graph(lines: list[Line], points: Floats) -> Grown:
    """Walk from the root over lines in any order and direction."""
    graph = _Graph.of(lines)
    root = graph.root(points)
    above = {root: -1}
    queue = [root]
    for here in queue:
        new = [v for v in graph.beside[here] if v not in above]
        above |= dict.fromkeys(new, here)
        queue += new
    if len(queue) != len(graph.beside) or len(graph.edge) != len(queue) - 1:
        msg = (
            f"the lines join {len(graph.beside)} vertices by {len(graph.edge)} edges, and {len(queue)} hang "
            "together with the root, which is no tree; remove the rings and the loose parts"
        )
        raise InputFormatError(msg)
    order = _branch_by_branch(queue, above, points)
    number = {v: i for i, v in enumerate(order)}
    made = Grown([root], [-1], [(0, 0)])
    for v in order[1:]:
        up = above[v]
        _add(made, v, number[up], graph.edge.get((up, v)) or graph.edge[v, up])
    return made


def _branch_by_branch(queue: list[int], above: Mapping[int, int], points: Floats) -> list[int]:
    """Order vertices, given from the root outward, so that at a fork the longest branch goes on."""
    carried: dict[int, float] = dict.fromkeys(queue, 0.0)
    below: dict[int, list[int]] = {v: [] for v in queue}
    for v in reversed(queue[1:]):
        carried[v] += float(np.linalg.norm(points[v] - points[above[v]]))
        carried[above[v]] += carried[v]
        below[above[v]].append(v)
    order: list[int] = []
    stack = [queue[0]]
    while stack:
        here = stack.pop()
        order.append(here)
        stack += sorted(below[here], key=lambda v: (carried[v], -v))
    return order


def values_of(made: Grown, values: list[list[float]], root: float | None) -> NDArray[np.float64]:
    """Return the value of every node.

    Parameters
    ----------
    made : Grown
    values : list of list of float
        For every line one value a segment.
    root : float or None
        Value of the root; None for that of the first segment.

    Returns
    -------
    (N,) array of float64
    """
    found = [values[line][k - 1] for line, k in made.at[1:]]
    found.insert(0, (found[0] if found else values[0][0]) if root is None else root)
    return np.array(found, dtype=np.float64)
