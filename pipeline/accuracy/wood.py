"""One form for all that is compared: models, skeletons and known truths as tapered segments."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.surface import Tubes
from pipeline.model import Skeleton, TreeModel
from pipeline.synthetic.truth import Truth

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

STEP_M = 0.02
"""An axis is followed by marks that are at most this far apart."""


@dataclass(frozen=True, eq=False)
class Marks:
    """Points along axes.

    Parameters
    ----------
    xyz : (K, 3) array
    segment : (K,) array of int
        The segment that each belongs to.
    share : (K,) array
        Where along it, 0 at its start and 1 at its end.
    """

    xyz: Floats
    segment: Ints
    share: Floats


@dataclass(frozen=True, eq=False)
class Wood:
    """A tree as a list of tapered segments, in metres.

    Parameters
    ----------
    start, end : (M, 3) arrays
        Ends of every segment's axis.
    start_radius, end_radius : (M,) arrays or None
        None where radii are not known.
    order, branch : (M,) arrays of int
        Branch order (0 is the stem) and branch number of every segment.
    branch_parent : (B,) array of int
        The branch that each branch grows from, -1 for the stem.
    path : (M,) array
        Length of the axis from the root to the end of every segment.
    root : (3,) array
        Where the tree stands.
    crs : str or None
    """

    start: Floats
    end: Floats
    start_radius: Floats | None
    end_radius: Floats | None
    order: Ints
    branch: Ints
    branch_parent: Ints
    path: Floats
    root: Floats
    crs: str | None = None

    def __len__(self) -> int:
        return len(self.start)

    @cached_property
    def length(self) -> Floats:
        """(M,) length of every segment."""
        return np.asarray(np.linalg.norm(self.end - self.start, axis=1))

    @cached_property
    def marks(self) -> Marks:
        """Marks along all axes, in the middle of equal parts of at most `STEP_M`."""
        count = np.maximum(1, np.ceil(self.length / STEP_M)).astype(np.int64)
        segment = np.repeat(np.arange(len(count)), count)
        number = np.arange(len(segment)) - np.repeat(np.cumsum(count) - count, count)
        share = (number + 0.5) / count[segment]
        along = (self.end - self.start)[segment]
        return Marks(self.start[segment] + along * share[:, None], segment, share)

    @cached_property
    def box(self) -> tuple[Floats, Floats]:
        """Lowest and highest coordinates."""
        return np.minimum(self.start, self.end).min(axis=0), np.maximum(self.start, self.end).max(axis=0)

    def tubes(self) -> Tubes | None:
        """The bark; None where radii are not known."""
        if self.start_radius is None or self.end_radius is None:
            return None
        return Tubes(self.start, self.end, self.start_radius, self.end_radius)

    def bare(self) -> Tubes:
        """The axes, as tubes without thickness."""
        nothing = np.zeros(len(self))
        return Tubes(self.start, self.end, nothing, nothing)

    def moved(self, shift: Floats) -> Wood:
        """The same tree elsewhere."""
        return replace(self, start=self.start + shift, end=self.end + shift, root=self.root + shift)


def wood_of(model: TreeModel | Skeleton) -> Wood:
    """Return the segments of a model, in the coordinates of its reference system."""
    graph = model.skeleton if isinstance(model, TreeModel) else model
    parent = graph.parent[1:]
    path = path_length(graph)
    thick = isinstance(model, TreeModel)
    return Wood(
        start=graph.world[parent],
        end=graph.world[1:],
        start_radius=model.start_radius[1:] if isinstance(model, TreeModel) and thick else None,
        end_radius=model.radius[1:] if isinstance(model, TreeModel) and thick else None,
        order=graph.order[1:].astype(np.int64),
        branch=graph.branch[1:].astype(np.int64),
        branch_parent=graph.branch_parent.astype(np.int64),
        path=path[1:],
        root=graph.world[0],
        crs=graph.crs,
    )


def wood_of_truth(truth: Truth) -> Wood:
    """Return the cylinders of a known truth."""
    parent = truth.parent.astype(np.int64)
    branch = truth.branch.astype(np.int64)
    below = np.full(int(branch.max(initial=-1)) + 1, -1, dtype=np.int64)
    first = (parent >= 0) & (branch[parent] != branch)
    below[branch[first]] = branch[parent[first]]
    length = np.linalg.norm(truth.e - truth.s, axis=1)
    path = length.copy()
    for i, p in enumerate(parent.tolist()):  # parents come first
        if p >= 0:
            path[i] += path[p]
    lowest = int(np.argmin(parent)) if len(parent) else 0
    root = truth.s[lowest] if len(parent) else np.zeros(3)
    return Wood(truth.s, truth.e, truth.r, truth.r, truth.order.astype(np.int64), branch, below, path, root)


def path_length(graph: Skeleton) -> Floats:
    """(N,) length of the axis from the root to every node, in metres."""
    total, parent = graph.length.tolist(), graph.parent.tolist()
    for i in range(1, len(total)):
        total[i] += total[parent[i]]
    return np.array(total)
