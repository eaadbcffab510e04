"""Cuts to a bud that looks the way the branch shall go."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from pydantic import Field, field_validator

from pipeline.errors import UsageError
from pipeline.growth.pruning.operation import cut_off
from pipeline.growth.pruning.selecting import Point, Selector
from pipeline.growth.simulation import Growth
from pipeline.growth.state import DAMAGED, Metamers
from pipeline.model import Floats

LEAST_LOOK = 1e-6


class _ToBud(Selector):
    """Cut each selected axis to the bud nearest its middle that looks the right way."""

    def _act(self, growth: Growth) -> dict[str, Any]:
        tree = growth.metamers
        buds = (facing_bud(tree, int(start), self._way(tree, int(start))) for start in self.starts(growth))
        return {"cuts": cut_off(growth, (int(tree.terminal_child[bud]) for bud in buds if bud is not None))}

    def _way(self, tree: Metamers, start: int) -> Floats:
        """(3,) unit vector that the axis from `start` on shall go."""
        raise NotImplementedError


class FacingBud(_ToBud):
    """Cut a branch to a bud that looks a given way, down if none is given: it takes over and goes there."""

    name: ClassVar[str] = "facing-bud"
    about: ClassVar[str] = "cut to the bud nearest the middle that looks a given way"
    sought: ClassVar[str] = (
        "a living bud that looks along direction, below the last of a chosen branch; choose longer "
        "branches or another direction"
    )

    direction: Point = Field((0.0, 0.0, -1.0), description="way that the branch shall go (x, y, z)")

    @field_validator("direction")
    @classmethod
    def _has_length(cls, value: Point) -> Point:
        return checked(value)

    def _way(self, tree: Metamers, start: int) -> Floats:
        del tree, start
        return unit(self.direction)


class Outward(_ToBud):
    """Cut a branch to a bud that looks away from the stem, in plan."""

    name: ClassVar[str] = "outward"
    about: ClassVar[str] = "cut to the bud nearest the middle that looks away from the stem"
    sought: ClassVar[str] = (
        "a living bud that looks away from the stem, below the last of a chosen branch; choose longer "
        "branches"
    )

    def _way(self, tree: Metamers, start: int) -> Floats:
        return outward(tree, start)


def facing_bud(tree: Metamers, start: int, way: Floats) -> int | None:
    """Return the metamer of an axis whose lateral bud is nearest the middle and looks along `way`.

    A bud looks that way if it points farther along it than its mirror image about the axis. Damaged buds do
    not count, nor the last one, above which nothing could be cut. Of two as near the middle, the lower.

    References
    ----------
    Section 4.2.4 of the thesis: the first bud that fits, not the best.
    """
    axis = tree.axis(start)
    buds = axis[(tree.terminal_child[axis] >= 0) & (axis > 0)]
    order = np.argsort(np.abs(np.arange(len(buds)) - (len(buds) - 1) / 2.0), kind="stable")
    for bud in buds[order].tolist():
        along, side = tree.direction[bud], tree.lateral_bud_direction[bud]
        mirrored = 2.0 * float(side @ along) * along - side
        if tree.lateral_bud[bud] != DAMAGED and float((side - mirrored) @ way) > LEAST_LOOK:
            return int(bud)
    return None


def outward(tree: Metamers, start: int) -> Floats:
    """(3,) level unit vector from the stem to the middle of an axis; 0 where that is above the foot."""
    axis = tree.axis(start)
    middle = tree.end[axis[len(axis) // 2]]
    stem = tree.axis(0)
    beside = stem[np.argmin(np.abs(tree.end[stem, 2] - middle[2]))]
    way = middle - tree.end[beside]
    way[2] = 0.0
    size = float(np.linalg.norm(way))
    return np.asarray(way / size) if size > LEAST_LOOK else np.zeros(3)


def unit(way: Point) -> Floats:
    """(3,) unit vector."""
    vector = np.asarray(way, dtype=np.float64)
    return np.asarray(vector / np.linalg.norm(vector))


def checked(way: Point) -> Point:
    """Return a direction that has a length.

    Raises
    ------
    ValueError
        If it has none.
    """
    if not any(way):
        msg = "a direction of no length leads nowhere; give for example [0, 0, 1] for upright"
        raise UsageError(msg)
    return way
