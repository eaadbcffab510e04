"""What street trees need: a clear stem, a crown within bounds, light inside."""

from __future__ import annotations

from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from pipeline.growth.allocation import gather
from pipeline.growth.pruning.operation import ROUNDING_M, cut_off, leader
from pipeline.growth.pruning.selecting import Scope, Selector
from pipeline.growth.simulation import Growth
from pipeline.growth.state import Mask, Metamers
from pipeline.model import Floats, Ints

STEM_M = 0.05
"""Diameter below which a branch is never a stem: young ones are all about as thick."""


class _Crown(Selector):
    """Cuts in the crown, or in some of its branches with all that they bear."""

    scope: ClassVar[Scope] = "branches"

    def _concerned(self, growth: Growth) -> Mask:
        """(N,) which metamers the operation is for: all, or those of the selected branches."""
        if not self.selects:
            return np.ones(len(growth.metamers), dtype=bool)
        starts = self.starts(growth)
        return growth.metamers.subtree(starts) if len(starts) else np.zeros(len(growth.metamers), dtype=bool)


class CrownRaise(_Crown):
    """Clear the stem up to a height: branches that begin lower go, and what hangs lower of others.

    The stem stays; above a cut it goes on with what has taken over. Where it forks, what is at
    least half as thick is a stem, too: a wound of that size does not heal.
    """

    name: ClassVar[str] = "crown-raise"
    about: ClassVar[str] = "clear the stem up to a height"
    sought: ClassVar[str] = "branches that begin or hang lower than height_m; give a greater height_m"

    height_m: float = Field(gt=0, le=50, description="clear height above the foot, metres")
    codominant: float = Field(
        0.5,
        gt=0,
        le=2,
        description="diameter from which a branch is a stem, as a share of the stem beside it",
    )

    def _act(self, growth: Growth) -> dict[str, Any]:
        tree = growth.metamers
        begin, end = above_foot(tree, tree.begin)[:, 2], above_foot(tree, tree.end)[:, 2]
        low = (np.minimum(begin, end) < self.height_m - ROUNDING_M) & self._concerned(growth)
        low[stems(tree, self.codominant)] = False
        return {"cuts": cut_off(growth, np.flatnonzero(low).tolist())}


class Reduce(_Crown):
    """Cut back to an envelope over the foot, at the last bud within.

    The lower half of the stem is exempt, so that an envelope may begin above the ground.
    """

    name: ClassVar[str] = "reduce"
    about: ClassVar[str] = "cut the crown back to an envelope"
    sought: ClassVar[str] = "wood outside of the envelope; give a smaller one"

    shape: Literal["box", "cylinder", "ellipsoid"] = Field("ellipsoid", description="shape of the envelope")
    width_m: float = Field(gt=0, le=100, description="width of the envelope along x, metres")
    depth_m: float | None = Field(
        None, gt=0, le=100, description="depth along y, metres; without it the width"
    )
    height_m: float = Field(gt=0, le=100, description="height of the envelope, metres")
    base_m: float = Field(0.0, ge=0, le=100, description="height above the foot where it begins, metres")

    def _act(self, growth: Growth) -> dict[str, Any]:
        tree = growth.metamers
        outside = ~self.holds(above_foot(tree, tree.end)) & self._concerned(growth)
        stem = leader(tree)
        middle = self.base_m + self.height_m / 2.0
        outside[stem[above_foot(tree, tree.end)[stem, 2] < middle]] = False
        return {"cuts": cut_off(growth, np.flatnonzero(outside).tolist())}

    def holds(self, points: Floats) -> Mask:
        """(P,) whether points, relative to the foot, are within."""
        depth = self.width_m if self.depth_m is None else self.depth_m
        half = np.array([self.width_m, depth, self.height_m]) / 2.0
        u, v, w = np.abs((points - [0.0, 0.0, self.base_m + half[2]]) / half).T
        if self.shape == "ellipsoid":
            return np.asarray(u * u + v * v + w * w <= 1.0 + ROUNDING_M)
        flat = np.hypot(u, v) if self.shape == "cylinder" else np.maximum(u, v)
        return np.asarray(np.maximum(flat, w) <= 1.0 + ROUNDING_M)


class Thin(Selector):
    """Take out whole branches, those with the least light for their wood first.

    Branches go as long as all of them together stay within the share; one that is too large for what is left
    is passed over.
    """

    name: ClassVar[str] = "thin"
    about: ClassVar[str] = "take out the branches with the least light"
    sought: ClassVar[str] = "whole branches within largest, and together within share; raise them"
    scope: ClassVar[Scope] = "branches"

    share: float = Field(
        0.2, gt=0, le=0.5, description="greatest share of the tree's metamers that goes, 0 to 0.5"
    )
    largest: float = Field(
        0.05, gt=0, le=0.5, description="greatest share of the tree's metamers in a branch that may go"
    )

    def _act(self, growth: Growth) -> dict[str, Any]:
        tree = growth.metamers
        light = gather(tree, growth.light.at_buds(tree))
        starts = self.starts(growth)
        starts = starts[starts > 0]
        starts = starts[light.internodes[starts] <= self.largest * (len(tree) - 1)]
        mean = (light.terminal + light.lateral)[starts] / light.internodes[starts]
        left = self.share * (len(tree) - 1)
        gone = np.zeros(len(tree), dtype=bool)
        cuts: list[int] = []
        for start in starts[np.argsort(mean, kind="stable")].tolist():
            if gone[start] or left < 1.0:
                continue
            branch = tree.subtree([start]) & ~gone
            more = int(branch.sum())
            if more <= left:
                gone |= branch
                left -= more
                cuts.append(start)
        return {"cuts": cut_off(growth, cuts)}


def stems(tree: Metamers, codominant: float) -> Ints:
    """Return the metamers of the stem, and of branches from `STEM_M` on that are nearly as thick as it is."""
    found, waiting = [], [0]
    while waiting:
        path = leader(tree, waiting.pop())
        found.append(path)
        sides, ends = tree.lateral_child[path], tree.terminal_child[path]
        thick = (sides >= 0) & (ends >= 0) & (tree.width[sides] >= codominant * tree.width[ends])
        waiting += sides[thick & (tree.width[sides] >= STEM_M)].tolist()
    return np.concatenate(found)


def above_foot(tree: Metamers, points: Floats) -> Floats:
    """(N, 3) points of all metamers, relative to the foot."""
    return np.asarray(points[: len(tree)] - tree.end[0])
