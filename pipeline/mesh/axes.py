"""`Axes`: what tubes are drawn around, those of all branches in one set of arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.mesh.triangles import Flags
from pipeline.model import Floats, TreeModel

Index = NDArray[np.int64]


class Axes(NamedTuple):
    """Axes of branches, one after another, each from its foot to its tip.

    Attributes
    ----------
    branch : (A,) array of int64
        Branch numbers, rising.
    first : (A + 1,) array of int64
        Where each axis begins among the points, and where the last one ends.
    points : (K, 3) array of float64
    radius : (K,) array of float64
        As drawn, metres.
    spare : (K,) array of bool
        Points between the nodes, which may be left out.
    """

    branch: Index
    first: Index
    points: Floats
    radius: Floats
    spare: Flags

    @property
    def foot(self) -> Index:
        """(A,) the first point of each axis."""
        return self.first[:-1]

    @property
    def tip(self) -> Index:
        """(A,) the last point of each axis."""
        return self.first[1:] - 1

    def only(self, points: Flags) -> Axes:
        """Return the chosen points, and the axes that have some.

        Parameters
        ----------
        points : (K,) array of bool
        """
        before = np.concatenate([[0], np.cumsum(points)])[self.first]
        some = np.diff(before) > 0
        first = np.concatenate([before[:-1][some], before[-1:]])
        return Axes(self.branch[some], first, self.points[points], self.radius[points], self.spare[points])


def nodes_of(tree: TreeModel, branch: Index) -> NDArray[np.int32]:
    """Return the nodes on the paths of some branches, path after path."""
    paths = tree.skeleton.paths
    return np.concatenate([np.zeros(0, dtype=np.int32), *(paths[b] for b in branch.tolist())])
