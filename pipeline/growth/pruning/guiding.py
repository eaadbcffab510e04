"""Stakes, and wood that is bent and tied."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from pydantic import Field, field_validator

from pipeline.errors import UsageError
from pipeline.growth.pruning.facing import checked, unit
from pipeline.growth.pruning.operation import ROUNDING_M
from pipeline.growth.pruning.selecting import Point, Scope, Selector
from pipeline.growth.simulation import Growth
from pipeline.growth.state import Metamers
from pipeline.model import Floats, Ints

OPPOSITE = -1.0 + 1e-9
"""Cosine from which on two ways are opposite."""


class _Tied(Selector):
    """What is tied grows along its support."""

    weight: float = Field(
        2.0, gt=0, le=20, description="pull of the support, beside those of bud, light and vertical"
    )
    years: int | None = Field(
        None, ge=1, le=1000, description="years after which the ties are taken off; without it never"
    )

    def _tie(self, growth: Growth, metamer: int, way: Floats) -> None:
        growth.tie(metamer, way, weight=self.weight, years=self.years)


class Stake(_Tied):
    """Tie the stem, or branches, to a stake of any direction: what they grow from now on goes its way.

    Upright for a straight stem, at 45 degrees for a cordon, level for the arm of an espalier.

    References
    ----------
    Section 4.2.2 of the thesis: one more vector in the sum that gives the direction of a new metamer.
    """

    name: ClassVar[str] = "stake"
    about: ClassVar[str] = "tie the stem or branches to a stake at any angle"
    sought: ClassVar[str] = "an axis to tie; choose other branches"
    scope: ClassVar[Scope] = "stem"

    direction: Point = Field((0.0, 0.0, 1.0), description="way of the stake (x, y, z)")

    @field_validator("direction")
    @classmethod
    def _has_length(cls, value: Point) -> Point:
        return checked(value)

    def _act(self, growth: Growth) -> dict[str, Any]:
        starts = self.starts(growth)
        for start in starts.tolist():
            self._tie(growth, start, unit(self.direction))
        return {"tied": len(starts)}


class BendAndTie(_Tied):
    """Bend branches, with all that they bear, and tie them there.

    The bend is spread over a stretch of wood, and lies in the plane of the old and the new way; each metamer
    of that stretch turns by an equal part, and what comes after it lies along the new way.

    References
    ----------
    Section 6.1 of the thesis tells that bending is missing, and how: a turn of the metamer at the bend.
    """

    name: ClassVar[str] = "bend-and-tie"
    about: ClassVar[str] = "bend young wood, and tie it there"
    sought: ClassVar[str] = (
        "wood beyond from_m on the chosen branches; choose longer ones or give a smaller from_m"
    )

    direction: Point | None = Field(
        None, description="way that the branch shall have (x, y, z); without it level, as it goes in plan"
    )
    from_m: float = Field(0.0, ge=0, le=100, description="length of the branch below the bend, metres")
    over_m: float = Field(0.3, ge=0, le=100, description="length of wood that is curved, metres; 0: a kink")
    thickest_m: float = Field(
        0.04, gt=0, le=1, description="diameter up to which wood bends, metres; thicker wood would break"
    )

    @field_validator("direction")
    @classmethod
    def _has_length(cls, value: Point | None) -> Point | None:
        return value if value is None else checked(value)

    def _act(self, growth: Growth) -> dict[str, Any]:
        bent = 0
        for start in self.starts(growth).tolist():
            axis = self._above(growth.metamers, start)
            if not len(axis):
                continue
            self._check(growth.metamers, int(axis[0]))
            way = level(growth.metamers, axis) if self.direction is None else unit(self.direction)
            bend(growth, axis[: self._curved(growth.metamers, axis)], axis, way)
            self._tie(growth, int(axis[0]), way)
            bent += 1
        return {"bent": bent, "tied": bent}

    def _above(self, tree: Metamers, start: int) -> Ints:
        """Return the metamers of an axis from the bend on."""
        axis = tree.axis(start)
        axis = axis[axis > 0]
        step = np.linalg.norm(tree.end[axis] - tree.begin[axis], axis=1)
        return np.asarray(axis[np.cumsum(step) - step >= self.from_m - ROUNDING_M])

    def _curved(self, tree: Metamers, axis: Ints) -> int:
        """Return how many metamers are curved, at least one."""
        step = np.linalg.norm(tree.end[axis] - tree.begin[axis], axis=1)
        return max(int((np.cumsum(step) <= self.over_m + ROUNDING_M).sum()), 1)

    def _check(self, tree: Metamers, metamer: int) -> None:
        if tree.width[metamer] > self.thickest_m:
            msg = (
                f"wood {100.0 * tree.width[metamer]:.1f} cm thick does not bend (thickest_m is "
                f"{100.0 * self.thickest_m:g} cm); bend it farther out with from_m, or earlier"
            )
            raise UsageError(msg)


def bend(growth: Growth, curved: Ints, axis: Ints, way: Floats) -> None:
    """Turn the metamers of an axis so that those after the curved ones lie along `way`.

    Parameters
    ----------
    growth : Growth
    curved : (K,) array
        The first metamers of `axis`; each turns by the K-th part of the angle, with all that it bears.
    axis : (M,) array
    way : (3,) array
        Unit vector.

    Raises
    ------
    UsageError
        If wood would come to lie below the foot; nothing is changed then.
    """
    tree = growth.metamers
    free = axis[len(curved) :] if len(axis) > len(curved) else axis
    chord = tree.end[free[-1]] - tree.begin[free[0]]
    size = float(np.linalg.norm(chord))
    if size < ROUNDING_M:
        return
    around, angle = turn_between(chord / size, way)
    moved = tree.subtree([int(curved[0])])
    held = {name: getattr(tree, name)[: len(tree)].copy() for name in MOVED}
    for metamer in curved.tolist():
        _turn(held, tree.subtree([metamer]), rotation(around, angle / len(curved)))
    low = float(held["end"][moved, 2].min() - tree.end[0, 2])
    if low < 0.0:
        msg = f"bent so, a branch would lie {-low:.2f} m below the foot; bend it less, or higher up"
        raise UsageError(msg)
    growth.light.remove(tree.end[: len(tree)][moved])
    for name, values in held.items():
        getattr(tree, name)[: len(tree)][moved] = values[moved]
    growth.light.add(tree.end[: len(tree)][moved])


def level(tree: Metamers, axis: Ints) -> Floats:
    """(3,) level unit vector along which an axis goes in plan.

    Raises
    ------
    UsageError
        If it goes straight up.
    """
    step = tree.end[axis[-1]] - tree.begin[axis[0]]
    step[2] = 0.0
    size = float(np.linalg.norm(step))
    if size < ROUNDING_M:
        msg = "a branch that stands upright goes nowhere in plan; give the direction to bend it to"
        raise UsageError(msg)
    return np.asarray(step / size)


def turn_between(before: Floats, after: Floats) -> tuple[Floats, float]:
    """Return the axis and the angle (radians) of the shortest turn from one unit vector to another."""
    cosine = float(np.clip(before @ after, -1.0, 1.0))
    around = np.cross(before, after)
    if cosine < OPPOSITE or not around.any():
        around = np.cross(before, np.eye(3)[np.argmin(np.abs(before))])
    return around / np.linalg.norm(around), float(np.arccos(cosine))


def rotation(around: Floats, angle: float) -> Floats:
    """(3, 3) matrix that turns by an angle about an axis (Rodrigues)."""
    x, y, z = around
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


def _turn(held: dict[str, Floats], part: Any, matrix: Floats) -> None:
    """Turn a part of the tree about where it begins."""
    pivot = held["begin"][int(part.argmax())].copy()
    for name in ("begin", "end"):
        held[name][part] = pivot + rowwise(held[name][part] - pivot, matrix)
    for name in ("direction", "lateral_bud_direction"):
        held[name][part] = rowwise(held[name][part], matrix)


def rowwise(vectors: Floats, matrix: Floats) -> Floats:
    """(K, 3) vectors turned; sums in a fixed order, so that equal vectors stay equal to the bit."""
    parts = [vectors[:, i, None] * matrix[None, :, i] for i in range(3)]
    return np.asarray(parts[0] + parts[1] + parts[2])


MOVED = ("begin", "end", "direction", "lateral_bud_direction")
