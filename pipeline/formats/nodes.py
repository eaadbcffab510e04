"""Trees from nodes in any order: the numbers that they get carry the branches.

See `pipeline.model.Skeleton` and `pipeline.geometry.numbering`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.numbering import by_paths, renumbered
from pipeline.model import PROPAGATED, Floats, Skeleton, TreeModel, Trunk

Flags = NDArray[np.bool_]
Positions = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Nodes:
    """Nodes of one tree as a file tells them.

    They keep their order where it shows the branches, else they are numbered path by path; where the
    file does not say which child goes on, it is the one that carries the most length.

    Parameters
    ----------
    world : (N, 3) array of float64
        Metres, in the coordinates of the file.
    parent : (N,) array of int64
        Position of each node's parent, -1 at the one root; without a cycle.
    goes_on : (N,) array of bool or None
        Nodes that continue their parent's branch; None where the file does not say.
    crs : str or None
    origin : (3,) array or None
        Local zero in the coordinates of the file; None for the foot of the tree in whole metres.
    keep : bool
        The order of the nodes is known to show the branches.
    """

    world: Floats
    parent: Positions
    goes_on: Flags | None = None
    crs: str | None = None
    origin: Floats | None = None
    keep: bool = False

    def skeleton(self) -> Skeleton:
        """Return the skeleton."""
        return self.numbered()[0]

    def tree(
        self, radius: Floats, trunk: Trunk | None = None, source: NDArray[np.uint8] | None = None
    ) -> TreeModel:
        """Return the tree with radii (N,) in metres and their sources, in the order of the nodes here."""
        skeleton, node = self.numbered()
        tree = untold(skeleton, radius[node], trunk)
        return tree if source is None else replace(tree, radius_source=source[node])

    def numbered(self) -> tuple[Skeleton, Positions]:
        """Return the skeleton, and which node stands at each of its numbers."""
        node = self._order()
        zero = np.asarray(np.floor(self.world[node[0]])) if self.origin is None else self.origin
        # national coordinates cost the last bits; nodes that were whole micrometres are so again
        xyz: Floats = np.round(self.world[node] - zero, 9) + 0.0
        return Skeleton(xyz, renumbered(self.parent, node), zero, self.crs), node

    def _order(self) -> Positions:
        """Return which node comes where."""
        count = np.arange(len(self.parent))
        if (self.parent < count).all() and (self.keep or self._shown()):
            return count
        step = self.world - self.world[np.where(self.parent < 0, count, self.parent)]
        return by_paths(self.parent, np.linalg.norm(step, axis=1), goes_on=self.goes_on)

    def _shown(self) -> bool:
        """Whether the order of the nodes shows the branches as they are."""
        if self.goes_on is None:
            return False
        kept = Skeleton(self.world, self.parent.astype(np.int32))
        return bool(np.array_equal(~kept.branch_start[1:], self.goes_on[1:]))


def untold(skeleton: Skeleton, radius: Floats, trunk: Trunk | None = None) -> TreeModel:
    """Return a tree with radii (N,) in metres of which a file does not say where they come from.

    They count as propagated, with errors that are not known: their writer may have measured them, or not.
    """
    count = len(skeleton)
    source = np.full(count, PROPAGATED, dtype=np.uint8)
    return TreeModel(skeleton, radius, source, np.full(count, np.nan), trunk)
