"""The tree that grows: metamers (a piece of stem with a terminal and a lateral bud at its end) in arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.geometry.numbering import number_by_paths, renumbered
from pipeline.model import ALLOMETRIC, Floats, Ints, Skeleton, TreeModel

Bytes = NDArray[np.int8]
Mask = NDArray[np.bool_]

DORMANT, GROWN, DAMAGED = 0, 1, 2
"""A bud waits, has become a metamer, or never grows again."""
NO_SUPPORT = -1
FIRST_ROOM = 256


@dataclass(eq=False)
class Metamers:
    """Metamers with parents before children; arrays hold more room than there are metamers.

    Metamer 0 is the *foot*: of no length, its terminal bud is the one that the tree grows from. The
    attributes are the whole arrays; their first `count` rows are the tree, which is what ``len`` counts
    and `held` returns.

    Parameters
    ----------
    count : int
        Number of metamers N, the foot included.
    begin, end : (R, 3) arrays of float64
        Ends of each metamer's axis, metres.
    direction : (R, 3) array of float64
        Unit vector along it; the foot's is that of the first bud.
    parent : (R,) array of int32
        The metamer that bears it, -1 for the foot.
    is_lateral : (R,) array of bool
        Whether it grew from its parent's lateral bud.
    terminal_child, lateral_child : (R,) arrays of int32
        Metamers that its buds have become, -1 for none.
    terminal_bud, lateral_bud : (R,) arrays of int8
        `DORMANT`, `GROWN` or `DAMAGED`.
    lateral_bud_direction : (R, 3) array of float64
        Unit vector.
    phyllotactic_angle : (R,) array of float64
        Angle of the lateral bud around its axis, counted on from the axis's first bud, degrees.
    order : (R,) array of int32
        Branch order: 0 on the stem, one more with every lateral bud passed.
    birth_year : (R,) array of int32
    width : (R,) array of float64
        Diameter in metres; never falls.
    support : (R,) array of int32
        Number of the support that the axis is tied to, -1 for none; new metamers of the axis inherit it.
    key : (R,) array of uint64
        Where the metamer stands in the tree, as the seed of its chances: a bud has the same chances
        whatever is cut elsewhere.
    """

    count: int
    begin: Floats
    end: Floats
    direction: Floats
    parent: Ints
    is_lateral: Mask
    terminal_child: Ints
    lateral_child: Ints
    terminal_bud: Bytes
    lateral_bud: Bytes
    lateral_bud_direction: Floats
    phyllotactic_angle: Floats
    order: Ints
    birth_year: Ints
    width: Floats
    support: Ints
    key: NDArray[np.uint64]

    def __len__(self) -> int:
        return self.count

    @classmethod
    def empty(cls, room: int = FIRST_ROOM) -> Metamers:
        """Return no metamers, with room for some."""
        vectors: dict[str, Any] = {name: np.zeros((room, 3)) for name in VECTORS}
        numbers: dict[str, Any] = {name: np.full(room, -1, dtype=np.int32) for name in NUMBERS}
        return cls(
            count=0,
            **vectors,
            **numbers,
            is_lateral=np.zeros(room, dtype=bool),
            terminal_bud=np.zeros(room, dtype=np.int8),
            lateral_bud=np.zeros(room, dtype=np.int8),
            phyllotactic_angle=np.zeros(room),
            width=np.zeros(room),
            key=np.zeros(room, dtype=np.uint64),
        )

    @classmethod
    def one_bud(
        cls, position: ArrayLike = (0.0, 0.0, 0.0), direction: ArrayLike = (0.0, 0.0, 1.0)
    ) -> Metamers:
        """Return the foot of a tree with a single bud.

        Parameters
        ----------
        position : (3,) array_like
            Metres.
        direction : (3,) array_like
            Where the bud points.
        """
        foot = cls.empty()
        foot.count = 1
        way = np.asarray(direction, dtype=np.float64)
        foot.begin[0] = foot.end[0] = position
        foot.direction[0] = foot.lateral_bud_direction[0] = way / np.linalg.norm(way)
        foot.lateral_bud[0] = DAMAGED
        foot.order[0] = foot.birth_year[0] = 0
        return foot

    def held(self) -> dict[str, NDArray[Any]]:
        """Return views of the first `count` rows of every array, by name."""
        return {name: getattr(self, name)[: self.count] for name in ARRAYS}

    def make_room(self, more: int) -> None:
        """Lengthen the arrays so that `more` metamers fit."""
        wanted = self.count + more
        room = len(self.parent)
        if wanted <= room:
            return
        for name in ARRAYS:
            old = getattr(self, name)
            new = np.zeros((max(wanted, 2 * room), *old.shape[1:]), dtype=old.dtype)
            new[: self.count] = old[: self.count]
            setattr(self, name, new)

    def subtree(self, metamers: ArrayLike) -> Mask:
        """(N,) which metamers are one of the given or stand above one."""
        inside = np.zeros(self.count, dtype=bool)
        inside[np.asarray(metamers, dtype=np.int64)] = True
        parent = self.parent.tolist()
        marked = inside.tolist()
        for i in range(int(inside.argmax()) + 1, self.count):
            if marked[parent[i]]:
                marked[i] = True
        return np.array(marked, dtype=bool)

    def keep(self, kept: Mask) -> Ints:
        """Drop metamers and close the gaps; whoever bore a dropped one has a damaged bud instead.

        Parameters
        ----------
        kept : (N,) array of bool
            No metamer stays whose parent goes; the foot stays.

        Returns
        -------
        (N,) array of int32
            The new number of every metamer, -1 where it is gone. Their order stays.
        """
        stays = np.flatnonzero(kept)
        new = np.full(self.count + 1, -1, dtype=np.int32)  # the last place answers for -1
        new[stays] = np.arange(len(stays), dtype=np.int32)
        for name in ARRAYS:
            array = getattr(self, name)
            array[: len(stays)] = array[stays]
        self.count = len(stays)
        rows = slice(0, self.count)
        self.parent[rows] = new[self.parent[rows]]
        for child, bud in ((self.terminal_child, self.terminal_bud), (self.lateral_child, self.lateral_bud)):
            child[rows] = new[child[rows]]
            bud[rows][(bud[rows] == GROWN) & (child[rows] < 0)] = DAMAGED
        return new[:-1]

    def axis(self, start: int = 0) -> Ints:
        """Return the metamers of an axis, from one of them on along terminal buds."""
        here, found = start, []
        while here >= 0:
            found.append(here)
            here = int(self.terminal_child[here])
        return np.array(found, dtype=np.int32)

    def to_model(
        self,
        origin: ArrayLike = (0.0, 0.0, 0.0),
        crs: str | None = None,
        metadata: Mapping[str, Any] | None = None,
    ) -> TreeModel:
        """Return the tree: every metamer's end is a node.

        Parameters
        ----------
        origin : (3,) array_like
            Coordinates of the local zero, metres.
        crs : str, optional
        metadata : mapping, optional

        Returns
        -------
        TreeModel
            Numbered path by path, an axis going on with its terminal metamer, after a cut with the lateral
            one. Radii are half the widths and count as allometric.
        """
        tree = self.held()
        ahead = np.where(tree["terminal_child"] >= 0, tree["terminal_child"], tree["lateral_child"])
        node = number_by_paths(tree["parent"], ahead)
        known = dict(metadata or {})
        place = np.asarray(origin, dtype=np.float64)
        skeleton = Skeleton(tree["end"][node], renumbered(tree["parent"], node), place, crs, known)
        count = len(node)
        source = np.full(count, ALLOMETRIC, dtype=np.uint8)
        return TreeModel(skeleton, tree["width"][node] / 2.0, source, np.full(count, np.nan), None, known)


VECTORS = ("begin", "end", "direction", "lateral_bud_direction")
NUMBERS = ("parent", "terminal_child", "lateral_child", "order", "birth_year", "support")
ARRAYS = tuple(field.name for field in fields(Metamers) if field.name != "count")
