"""Trees as lists of cylinders, each with one radius: how our tapered segments get there and back.

A segment becomes the cylinder of the same axis and the same volume, so that a program that sums
``pi radius^2 length`` finds our volume. Back, the cylinders of other programs leave gaps where ours
join: a branch there begins on its parent's bark. The tree gets a node on the parent's axis, where the
branch starts, and one on the bark.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.formats.nodes import Flags, Nodes, Positions
from pipeline.model import Floats, Ints, TreeModel

SAME_M = 1e-5
"""Two points closer than this are one; files are rounded to a micrometre."""


@dataclass(frozen=True, eq=False)
class Cylinders:
    """Cylinders of one tree.

    Parameters
    ----------
    start, end : (M, 3) array of float64
        Ends of each axis in metres.
    radius : (M,) array of float64
        Metres.
    parent : (M,) array of int64
        The cylinder that each grows from, -1 at the lowest; without a cycle.
    goes_on : (M,) array of bool
        Cylinders that continue the branch of their parent.
    end_radius : (M,) array of float64 or None
        Radius at the end of each axis where the file tells it, metres.
    foot_radius : float or None
        Radius at the foot of the tree where the file tells it, metres.
    """

    start: Floats
    end: Floats
    radius: Floats
    parent: Positions
    goes_on: Flags
    end_radius: Floats | None = None
    foot_radius: float | None = None

    @property
    def length(self) -> Floats:
        """(M,) length of each axis in metres."""
        return np.asarray(np.linalg.norm(self.end - self.start, axis=1))

    @property
    def volume(self) -> float:
        """Volume of all of them in cubic metres, as the program that wrote them sums it."""
        return float((np.pi * self.radius**2 * self.length).sum())


def equal_volume(start_radius: Floats, end_radius: Floats) -> Floats:
    """Return the radius of the cylinder that has the volume of a frustum of the same length.

    Parameters
    ----------
    start_radius, end_radius : (M,) array of float64

    Returns
    -------
    (M,) array of float64

    Examples
    --------
    >>> equal_volume(np.array([2.0, 3.0]), np.array([2.0, 0.0])).round(3).tolist()
    [2.0, 1.732]
    """
    return np.asarray(np.sqrt((start_radius**2 + start_radius * end_radius + end_radius**2) / 3))


def foot_radius(radius: float, end_radius: float) -> float:
    """Return the start radius of the frustum that has the volume of a cylinder: `equal_volume` undone."""
    inside = max(12 * radius**2 - 3 * end_radius**2, 0.0)
    return max((float(np.sqrt(inside)) - end_radius) / 2, 0.0)


def segments(tree: TreeModel, *, digits: int = 6) -> Cylinders:
    """Return the segments of a tree as cylinders of the same axis and volume.

    Parameters
    ----------
    tree : TreeModel
    digits : int, optional
        Decimals that the coordinates are rounded to.

    Returns
    -------
    Cylinders
        Cylinder i is the segment that ends at node i + 1. A branch at the very foot of the tree names
        the lowest cylinder as its parent, and starts where that starts.
    """
    skeleton = tree.skeleton
    parent = skeleton.parent[1:].astype(np.int64)
    above = np.maximum(parent - 1, 0)
    above[:1] = -1
    points = np.round(skeleton.world, digits) + 0.0  # no -0.000000
    return Cylinders(
        points[parent],
        points[1:],
        equal_volume(tree.start_radius[1:], tree.radius[1:]),
        above,
        ~skeleton.branch_start[1:],
        tree.radius[1:],
        float(tree.radius[0]),
    )


def following(parent: NDArray[np.int64], goes_on: Flags) -> Positions:
    """(M,) the cylinder that continues each one, -1 at the end of a branch; the first of several."""
    ahead = np.full(len(parent), -1, dtype=np.int64)
    rows = np.flatnonzero(goes_on & (parent >= 0))[::-1]
    ahead[parent[rows]] = rows
    return ahead


def positions(parent: NDArray[np.int64], branch: Ints) -> Positions:
    """(M,) the place of each cylinder in its branch, from 1; parents come first."""
    place = np.ones(len(parent), dtype=np.int64)
    for i, p in enumerate(parent.tolist()):
        if p >= 0 and branch[p] == branch[i]:
            place[i] = place[p] + 1
    return place


def tree_of(cylinders: Cylinders, crs: str | None = None) -> TreeModel:
    """Return the tree that a list of cylinders describes.

    Node i + 1 is the end of cylinder i, node 0 the start of the lowest. A cylinder that goes on runs
    from its parent's end to its own. A branch that starts elsewhere splits its parent's axis at the
    nearest point, and gets a node where its first cylinder starts if that is off the axis. Where the
    radii at the ends are not told, a node has the mean of the two cylinders that meet there.

    Parameters
    ----------
    cylinders : Cylinders
    crs : str, optional

    Returns
    -------
    TreeModel
    """
    growing = _Growing(cylinders)
    for row in _downward(cylinders.parent):
        growing.add(row)
    nodes = Nodes(np.array(growing.world), np.array(growing.parent), np.array(growing.on), crs)
    return nodes.tree(np.array(growing.radius))


class _Growing:
    """The nodes of a tree while its cylinders are added, parents first."""

    def __init__(self, cylinders: Cylinders) -> None:
        count = len(cylinders.radius)
        self.of = cylinders
        self.end_radius = _end_radius(cylinders)
        self.share = _shares(cylinders)
        self.base = [0] * count
        self.own_base = [True] * count
        self.start_radius = [0.0] * count
        self.split: dict[int, int] = {}
        self.sides: list[list[int]] = [[] for _ in range(count)]
        for row, p in enumerate(cylinders.parent.tolist()):
            if p >= 0 and not cylinders.goes_on[row]:
                self.sides[p].append(row)
        lowest = int(np.flatnonzero(cylinders.parent < 0)[0])
        foot = cylinders.foot_radius
        self.world = [cylinders.start[lowest], *cylinders.end]
        self.radius = [cylinders.radius[lowest] if foot is None else foot, *self.end_radius]
        self.parent = [-1] * (count + 1)
        self.on = [True] * (count + 1)

    def add(self, row: int) -> None:
        """Join a cylinder to its parent, and part its own axis where branches start."""
        here, on = self._begin(row)
        self.base[row], self.own_base[row] = here, on
        for side, share in sorted(((s, self.share[s]) for s in self.sides[row]), key=lambda pair: pair[1]):
            if not 0.0 < share < 1.0:
                continue
            here = self._split(row, side, share, here, on=on)
            on = on or here != self.base[row]
        self.parent[row + 1], self.on[row + 1] = here, on

    def _begin(self, row: int) -> tuple[int, bool]:
        """Return the node that a cylinder's axis begins at, and whether it goes on from there."""
        above, start = int(self.of.parent[row]), self.of.start[row]
        if above < 0 or self.of.goes_on[row]:
            here = 0 if above < 0 else above + 1
            self.start_radius[row] = self.radius[here]
            return here, True
        self.start_radius[row] = self.end_radius[row]
        foot = self._foot(row, above)
        if np.abs(self.world[foot] - start).max() <= SAME_M:
            return foot, False
        self.start_radius[row] = self.of.radius[row]
        return self._new(start, self.of.radius[row], foot, on=False), True

    def _foot(self, row: int, above: int) -> int:
        """Return the node on the parent's axis that a branch starts from."""
        if row in self.split:
            return self.split[row]
        at_base = self.share[row] <= 0.0 and self.own_base[above]
        return self.base[above] if at_base else above + 1

    def _split(self, row: int, side: int, share: float, here: int, *, on: bool) -> int:
        """Return the node on a cylinder's axis where a branch starts, a new one if need be."""
        point = self.of.start[row] + share * (self.of.end[row] - self.of.start[row])
        if here == self.base[row] or np.abs(self.world[here] - point).max() > SAME_M:
            first = self.start_radius[row]
            here = self._new(point, first + share * (self.end_radius[row] - first), here, on=on)
        self.split[side] = here
        return here

    def _new(self, point: Floats, radius: float, parent: int, *, on: bool) -> int:
        self.world.append(point)
        self.radius.append(radius)
        self.parent.append(parent)
        self.on.append(on)
        return len(self.world) - 1


def _end_radius(cylinders: Cylinders) -> Floats:
    """(M,) radius at the end of each cylinder: told, else the mean of the two that meet there."""
    if cylinders.end_radius is not None:
        return cylinders.end_radius
    ahead = following(cylinders.parent, cylinders.goes_on)
    radius = cylinders.radius
    return np.where(ahead >= 0, (radius + radius[ahead]) / 2, radius)


def _shares(cylinders: Cylinders) -> list[float]:
    """Return where on its parent's axis each cylinder starts: 0 at its start, 1 at its end."""
    above = np.maximum(cylinders.parent, 0)
    axis = cylinders.end[above] - cylinders.start[above]
    square = (axis * axis).sum(axis=1)
    along = ((cylinders.start - cylinders.start[above]) * axis).sum(axis=1)
    share = np.clip(along / np.where(square > 0, square, 1.0), 0.0, 1.0)
    length = np.sqrt(square)
    share[share * length <= SAME_M] = 0.0
    share[(1.0 - share) * length <= SAME_M] = 1.0
    return [float(value) for value in share]


def _downward(parent: Positions) -> list[int]:
    """Return the cylinders with parents before children."""
    if (parent < np.arange(len(parent))).all():
        return list(range(len(parent)))
    below: list[list[int]] = [[] for _ in range(len(parent))]
    for row, p in enumerate(parent.tolist()):
        if p >= 0:
            below[p].append(row)
    order = [int(np.flatnonzero(parent < 0)[0])]
    for row in order:  # grows while it is walked: breadth first
        order.extend(below[row])
    return order
