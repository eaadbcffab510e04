"""Wood that a later acquisition lacks: what may have been pruned between the two."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from pipeline.growth.log import Removal
from pipeline.growth.simulation import Growth
from pipeline.growth.state import Mask
from pipeline.model import Floats, TreeModel

LOST_M = 0.20
"""Wood is missing where the later one has nothing within this distance of its bark, metres: twigs sway."""
LEAST_M = 0.5
"""Branches with less wood are not told, metres."""
MOST_LEFT = 0.2
"""A branch is lost if at most this share of its wood is still there."""
INTO_M = 0.05
"""How far along a lost branch its cut is placed, metres: it shall not fall on the axis that bears it."""


@dataclass(frozen=True, eq=False)
class Cut:
    """A proposed cut; as an event it takes off the metamer there, and all that it bears.

    Parameters
    ----------
    year : int
    position : (3,) array
        On the axis of the lost wood just above the cut, metres, relative to the tree's origin.
    diameter_m : float
        Of the wood there.
    length_m : float
        Wood that is lost.
    """

    year: int
    position: Floats
    diameter_m: float
    length_m: float

    def apply(self, growth: Growth) -> Removal:
        """Cut off the metamer that is nearest to the position."""
        tree = growth.metamers.held()
        a, way = tree["begin"][1:], tree["end"][1:] - tree["begin"][1:]
        square = np.maximum((way * way).sum(axis=1), 1e-12)
        share = np.clip(((self.position - a) * way).sum(axis=1) / square, 0.0, 1.0)
        off = np.linalg.norm(a + share[:, None] * way - self.position, axis=1)
        return growth.remove(1 + int(np.argmin(off)))


def lost_wood(tree: TreeModel, later: Floats, *, year: int = 0) -> tuple[Cut, ...]:
    """Propose cuts where a later acquisition has no wood any more.

    Parameters
    ----------
    tree : TreeModel
        The earlier one.
    later : (P, 3) array
        Points of the later one, relative to the tree's origin.
    year : int
        When the cuts are taken to have been made.

    Returns
    -------
    tuple of Cut
        The lowest place of every lost branch, from the root up.
    """
    graph = tree.skeleton
    distance, _ = cKDTree(later).query(graph.xyz)
    missing = np.where(distance - tree.radius > LOST_M, graph.length, 0.0)
    gone = missing.copy()
    parent = graph.parent.tolist()
    for i in range(len(tree) - 1, 0, -1):
        gone[parent[i]] += gone[i]
    wood = graph.subtree_length + graph.length
    lost = (wood >= LEAST_M) & (gone >= (1.0 - MOST_LEFT) * wood)
    lost[0] = False
    below = np.zeros(len(tree), dtype=bool)
    for i in range(1, len(tree)):
        below[i] = below[parent[i]] or lost[parent[i]]
    starts = [_start(tree, i, missing, lost) for i in np.flatnonzero(lost & ~below).tolist()]
    return tuple(_cut(tree, i, float(wood[i]), year) for i in starts)


def _start(tree: TreeModel, node: int, missing: Floats, lost: Mask) -> int:
    """Go up from where a lost branch begins to its first wood that is missing, or its first fork."""
    while not missing[node]:
        above = tree.skeleton.children[node]
        if len(above) != 1 or not lost[above[0]]:
            break
        node = above[0]
    return node


def _cut(tree: TreeModel, node: int, wood: float, year: int) -> Cut:
    graph = tree.skeleton
    length = float(graph.length[node])
    share = min(INTO_M / length, 1.0) if length > 0.0 else 1.0
    foot = graph.xyz[graph.parent[node]]
    position = foot + share * (graph.xyz[node] - foot)
    return Cut(year, position, float(2.0 * tree.start_radius[node]), wood)
