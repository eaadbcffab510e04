"""Which branches an operation is for: by place, height, order or the way they go."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike
from pydantic import Field

from pipeline.errors import UsageError
from pipeline.geometry.compiled import compiled
from pipeline.growth.pruning.operation import Operation, reference
from pipeline.growth.simulation import Growth
from pipeline.growth.state import Mask, Metamers
from pipeline.model import Floats, Ints

Point = tuple[float, float, float]
Scope = Literal["stem", "branches", "named"]


class Selector(Operation):
    """An operation on some branches; of several selectors, all must hold."""

    scope: ClassVar[Scope] = "named"
    """What is meant when nothing is selected: the stem, every side branch, or neither."""

    all: bool = Field(False, description="every side branch")
    position: Point | None = Field(
        None, description="a point on the branch, or near it, in the coordinates of the tree, metres"
    )
    within_m: float = Field(0.5, gt=0, le=100, description="how far from that point a branch may be, metres")
    lowest_m: float | None = Field(
        None, ge=-100, le=200, description="least height above the foot where branches begin, metres"
    )
    highest_m: float | None = Field(
        None, ge=-100, le=200, description="greatest height above the foot where branches begin, metres"
    )
    order: int | None = Field(
        None, ge=0, le=100, description="order of the branches; 0 is the stem, 1 what it bears"
    )
    azimuth_deg: float | None = Field(
        None, ge=-360, le=360, description="where branches go to in plan, from +x towards +y, degrees"
    )
    azimuth_within_deg: float = Field(
        45.0, gt=0, le=180, description="greatest difference from that azimuth, degrees"
    )

    @property
    def selects(self) -> bool:
        """Whether any selector is given."""
        given = (self.position, self.lowest_m, self.highest_m, self.order, self.azimuth_deg)
        return self.all or any(value is not None for value in given)

    def starts(self, growth: Growth) -> Ints:
        """Return the first metamers of the selected axes, the foot for the stem.

        Raises
        ------
        UsageError
            If no axis is near the position, or nothing is selected and the operation needs it.
        """
        tree = growth.metamers
        if not self.selects:
            return self._unselected(tree)
        chosen = starts_of(tree)
        if self.all:
            chosen = chosen[1:]
        if self.position is not None:
            near = axis_of(tree)[self.metamer_at(growth)]
            chosen = chosen[chosen == near]
        return chosen[self._fits(tree, chosen)]

    def check_chosen(self, growth: Growth) -> None:
        """Make sure that a branch fits; the text of the error tells which comes nearest.

        Raises
        ------
        UsageError
        """
        if not self.selects or len(self.starts(growth)):
            return
        tree = growth.metamers
        there = starts_of(tree)[1:] if self.all else starts_of(tree)
        if self.position is not None:
            there = there[there == axis_of(tree)[self.metamer_at(growth)]]
        if not len(there):
            msg = f"{self.name}: the tree has no side branch yet; choose the stem, order = 0, or a later year"
            raise UsageError(msg)
        near = there[np.lexsort(self._misses(tree, there)[::-1])[0]]
        at = np.round(tree.begin[near] + reference(growth), 2) + 0.0  # no -0.00
        place = ", ".join(f"{value:.2f}" for value in at.tolist())
        way = goes_to(tree, [near])[0]
        goes = "is upright" if np.isnan(way) else f"goes to {way:.0f} degrees in plan"
        msg = (
            f"{self.name}: no branch fits {self._asked()}; the nearest is of order {tree.order[near]}, "
            f"begins {tree.begin[near, 2] - tree.end[0, 2]:.2f} m above the foot, at ({place}), and {goes}: "
            "correct what it is chosen by"
        )
        raise UsageError(msg)

    def _asked(self) -> str:
        """Return the selectors that are given, as they are written."""
        keys = ("position", "lowest_m", "highest_m", "order", "azimuth_deg")
        given = [f"{key} = {value}" for key in keys if (value := getattr(self, key)) is not None]
        within = f" within {self.azimuth_within_deg:g} degrees" if self.azimuth_deg is not None else ""
        return " and ".join(given or ["all"]) + within

    def metamer_at(self, growth: Growth) -> int:
        """Return the metamer nearest to the position.

        Raises
        ------
        UsageError
            If it is farther away than `within_m`.
        """
        point = np.asarray(self.position, dtype=np.float64) - reference(growth)
        found, distance, place = nearest(growth.metamers, point)
        if distance > self.within_m:
            shown = ", ".join(f"{value:.2f}" for value in self.position or ())
            there = ", ".join(f"{value:.2f}" for value in (place + reference(growth)).tolist())
            msg = (
                f"no branch is within {self.within_m:g} m of ({shown}); the nearest is {distance:.2f} m "
                f"away, at ({there}): correct the position or raise within_m"
            )
            raise UsageError(msg)
        return found

    def _unselected(self, tree: Metamers) -> Ints:
        if self.scope == "stem":
            return np.zeros(1, dtype=np.int32)
        if self.scope == "branches":
            return starts_of(tree)[1:]
        msg = (
            f"{self.name} must know which branches are meant; give position, lowest_m, highest_m, order or "
            "azimuth_deg, or all = true"
        )
        raise UsageError(msg)

    def _fits(self, tree: Metamers, starts: Ints) -> Mask:
        """(K,) whether axes fit height, order and azimuth."""
        off_order, off_height, off_way = self._misses(tree, starts)
        return np.asarray((off_order == 0) & (off_height == 0.0) & (off_way <= self.azimuth_within_deg))

    def _misses(self, tree: Metamers, starts: Ints) -> tuple[Ints, Floats, Floats]:
        """(K,) by how much axes miss the order, the heights (metres) and the azimuth (degrees)."""
        height = tree.begin[starts, 2] - tree.end[0, 2]
        order = tree.order[starts] if self.order is None else self.order
        off_height = np.zeros(len(starts))
        if self.lowest_m is not None:
            off_height = np.maximum(off_height, self.lowest_m - height)
        if self.highest_m is not None:
            off_height = np.maximum(off_height, height - self.highest_m)
        off_way = np.zeros(len(starts))
        if self.azimuth_deg is not None:
            apart = goes_to(tree, starts) - self.azimuth_deg
            off_way = np.nan_to_num(np.abs((apart + 180.0) % 360.0 - 180.0), nan=UPRIGHT_DEG)
        return np.abs(tree.order[starts] - order), off_height, off_way


def goes_to(tree: Metamers, starts: ArrayLike) -> Floats:
    """(K,) azimuth from where axes begin to their ends, degrees; NaN for upright ones."""
    first = np.asarray(starts, dtype=np.int64)
    tips = np.array([tree.axis(int(start))[-1] for start in first], dtype=np.int64)
    step = tree.end[tips] - tree.begin[first]
    flat = np.hypot(step[:, 0], step[:, 1]) > 0.0
    return np.asarray(np.where(flat, np.degrees(np.arctan2(step[:, 1], step[:, 0])), np.nan))


def starts_of(tree: Metamers) -> Ints:
    """Return the first metamer of every axis; the stem's is the foot."""
    return np.concatenate([[0], np.flatnonzero(tree.is_lateral[: len(tree)])]).astype(np.int32)


def axis_of(tree: Metamers) -> Ints:
    """(N,) the first metamer of the axis of each metamer."""
    return first_of_axis(tree.parent[: len(tree)], tree.is_lateral[: len(tree)])


def nearest(tree: Metamers, point: Floats) -> tuple[int, float, Floats]:
    """Return the metamer nearest to a point, its distance in metres, and the place on its axis."""
    rows = slice(1, len(tree))
    a, way = tree.begin[rows], tree.end[rows] - tree.begin[rows]
    square = np.maximum((way * way).sum(axis=1), ROUNDING_M2)
    share = np.clip(((point - a) * way).sum(axis=1) / square, 0.0, 1.0)
    place = a + share[:, None] * way
    distance = np.linalg.norm(place - point, axis=1)
    if not len(distance):
        return 0, float(np.linalg.norm(tree.end[0] - point)), tree.end[0].copy()
    best = int(np.argmin(distance))
    return best + 1, float(distance[best]), place[best]


@compiled
def first_of_axis(parent: Ints, is_lateral: Mask) -> Ints:
    """(N,) the first metamer of each one's axis."""
    first = np.zeros(len(parent), dtype=np.int32)
    for i in range(1, len(parent)):
        first[i] = i if is_lateral[i] else first[parent[i]]
    return first


ROUNDING_M2 = 1e-12
UPRIGHT_DEG = 360.0
"""By how much an upright axis misses any azimuth: more than any other."""
