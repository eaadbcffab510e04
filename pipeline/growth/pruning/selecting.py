"""Which branches an operation is for: by place, height, order or the way they go."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np
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
        fits = np.ones(len(starts), dtype=bool)
        height = tree.begin[starts, 2] - tree.end[0, 2]
        if self.lowest_m is not None:
            fits &= height >= self.lowest_m
        if self.highest_m is not None:
            fits &= height <= self.highest_m
        if self.order is not None:
            fits &= tree.order[starts] == self.order
        if self.azimuth_deg is not None:
            tips = np.array([tree.axis(int(start))[-1] for start in starts], dtype=np.int64)
            step = tree.end[tips] - tree.begin[starts]
            apart = np.degrees(np.arctan2(step[:, 1], step[:, 0])) - self.azimuth_deg
            fits &= np.abs((apart + 180.0) % 360.0 - 180.0) <= self.azimuth_within_deg
            fits &= np.hypot(step[:, 0], step[:, 1]) > 0.0
        return fits


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
