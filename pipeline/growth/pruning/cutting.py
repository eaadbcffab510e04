"""Cuts at a bud, where somebody points or where a branch becomes too long."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from pipeline.geometry.compiled import compiled
from pipeline.growth.pruning.operation import ROUNDING_M, cut_off
from pipeline.growth.pruning.selecting import Scope, Selector
from pipeline.growth.simulation import Growth
from pipeline.growth.state import Mask, Metamers
from pipeline.model import Floats, Ints


class CutToBud(Selector):
    """Cut wood off, just above a bud.

    With `length_m`, the selected axes keep this length, rounded down to a bud; without it, a position names
    the wood that goes with all that it bears, and other selectors name branches that go altogether.
    """

    name: ClassVar[str] = "cut-to-bud"
    about: ClassVar[str] = "cut wood off, just above a bud"
    sought: ClassVar[str] = "wood beyond length_m on the chosen branches; give a smaller length_m"

    length_m: float | None = Field(
        None,
        ge=0,
        le=200,
        description="length of the axis that stays, metres; without it none of what is named",
    )

    def _act(self, growth: Growth) -> dict[str, Any]:
        if self.length_m is None and self.position is not None:
            return {"cuts": cut_off(growth, [self.metamer_at(growth)] if len(self.starts(growth)) else [])}
        tree = growth.metamers
        tops = (first_beyond(tree, int(start), self.length_m or 0.0) for start in self.starts(growth))
        return {"cuts": cut_off(growth, (top for top in tops if top is not None))}


class LimitLength(Selector):
    """Keep branches within a length: no wood stays farther than that from where its branch begins.

    The distance is along the wood and counts what a branch bears, so that a side shoot that takes over after
    a cut does not escape. Of branches within each other, the outermost counts.
    """

    name: ClassVar[str] = "limit-length"
    about: ClassVar[str] = "keep branches within a length"
    sought: ClassVar[str] = "wood farther than length_m from where its branch begins; give a smaller length_m"
    scope: ClassVar[Scope] = "branches"

    length_m: float = Field(gt=0, le=200, description="greatest distance along the wood, metres")

    def _act(self, growth: Growth) -> dict[str, Any]:
        tree = growth.metamers
        chosen = np.zeros(len(tree), dtype=bool)
        chosen[self.starts(growth)] = True
        away = reach(tree.parent[: len(tree)], lengths(tree), chosen)
        return {"cuts": cut_off(growth, np.flatnonzero(away > self.length_m + ROUNDING_M).tolist())}


def lengths(tree: Metamers) -> Floats:
    """(N,) length of each metamer, metres."""
    rows = slice(0, len(tree))
    return np.asarray(np.linalg.norm(tree.end[rows] - tree.begin[rows], axis=1))


def first_beyond(tree: Metamers, start: int, length_m: float) -> int | None:
    """Return the first metamer of an axis that ends beyond a length, None where the axis is no longer."""
    axis = tree.axis(start)
    step = np.linalg.norm(tree.end[axis] - tree.begin[axis], axis=1)
    beyond = np.flatnonzero(np.cumsum(step) > length_m + ROUNDING_M)
    return int(axis[beyond[0]]) if len(beyond) else None


@compiled
def reach(parent: Ints, length: Floats, chosen: Mask) -> Floats:
    """(N,) how far each metamer's end is from where the outermost chosen branch begins; 0 on others."""
    away = np.zeros(len(parent))
    inside = chosen.copy()
    for i in range(len(parent)):
        if i > 0 and inside[parent[i]]:
            inside[i] = True
            away[i] = away[parent[i]]
        if inside[i]:
            away[i] += length[i]
    return away
