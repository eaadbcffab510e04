"""The open tree: no central leader, a few that share its place."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from pipeline.growth.pruning.facing import outward
from pipeline.growth.pruning.operation import ROUNDING_M, cut_off, leader
from pipeline.growth.pruning.selecting import Scope, Selector
from pipeline.growth.simulation import Growth
from pipeline.growth.state import DAMAGED, Metamers
from pipeline.model import Floats, Ints


class OpenCentre(Selector):
    """Cut the stem, or branches, right above the third side branch: the three take over.

    Axes that do not have so many yet stay as they are. Done again in later years, it keeps the centre open:
    a branch that has outgrown the others is cut back, at a bud, to the height of the next.

    References
    ----------
    Section 4.2.3 of the thesis, after Brickell & Joyce: at a height of about 0.9 m, about year 10. Added: the
    cuts of later years, and `level`.
    """

    name: ClassVar[str] = "open-centre"
    about: ClassVar[str] = "cut the leader right above its third side branch"
    sought: ClassVar[str] = (
        "as many grown side branches as leaders on the axis, and wood above them; give fewer leaders, a "
        "smaller trunk_m, or let the tree grow first"
    )
    scope: ClassVar[Scope] = "stem"

    leaders: int = Field(3, ge=1, le=20, description="number of side branches that stay below the cut")
    trunk_m: float = Field(
        0.0, ge=0, le=50, description="length of the axis on which side branches do not count, metres"
    )
    ahead: float = Field(
        1.2,
        ge=1,
        le=10,
        description="height above the cut, as a share of the next, from which one is cut back",
    )

    level: bool = Field(
        False, description="with the cut, also head side branches back to the height of the middle one"
    )

    def _act(self, growth: Growth) -> dict[str, Any]:
        tree = growth.metamers
        return {
            "cuts": cut_off(growth, [top for start in self.starts(growth) for top in self._tops(tree, start)])
        }

    def _tops(self, tree: Metamers, start: int) -> Iterator[int]:
        """Yield the metamer to cut off, if there is one."""
        axis = tree.axis(int(start))
        step = np.linalg.norm(tree.end[axis] - tree.begin[axis], axis=1)
        sides = axis[(tree.lateral_child[axis] >= 0) & (np.cumsum(step) >= self.trunk_m - ROUNDING_M)]
        if len(sides) >= self.leaders and (top := int(tree.terminal_child[sides[self.leaders - 1]])) >= 0:
            yield top
            if self.level:
                yield from self._levelled(tree, tree.lateral_child[sides[: self.leaders]])
        elif tree.terminal_bud[axis[-1]] == DAMAGED and len(sides) > 1:
            yield from self._ahead(tree, int(axis[-1]), tree.lateral_child[sides])

    def _ahead(self, tree: Metamers, cut: int, branches: Ints) -> Iterator[int]:
        """Yield where the highest branch is cut back to the height of the next."""
        ends, base = tree.end[: len(tree), 2], tree.end[cut, 2]
        tops = self._heights(tree, branches) - base
        first, second = np.argsort(-tops, kind="stable")[:2]
        if tops[second] <= 0.0 or tops[first] <= self.ahead * tops[second]:
            return
        path = leader(tree, int(branches[first]))
        low = path[(ends[path] - base <= tops[second]) & (tree.terminal_child[path] >= 0)]
        if len(low):
            yield int(tree.terminal_child[low[-1]])

    def _levelled(self, tree: Metamers, branches: Ints) -> Iterator[int]:
        """Yield cuts of branches that are higher than the middle one: above the last bud that looks out.

        Where none of the buds below that height looks away from the stem, the last of them is taken.
        """
        tops = self._heights(tree, branches)
        height = np.sort(tops)[len(tops) // 2]
        for branch in branches[tops > height].tolist():
            path = leader(tree, branch)
            low = path[
                (tree.end[path, 2] <= height)
                & (tree.terminal_child[path] >= 0)
                & (tree.lateral_bud[path] != DAMAGED)
            ]
            out = low[tree.lateral_bud_direction[low] @ outward(tree, branch) > 0.0]
            if len(low):
                yield int(tree.terminal_child[(out if len(out) else low)[-1]])
                part = np.flatnonzero(tree.subtree([branch]) & (tree.end[: len(tree), 2] > height))
                yield from part[part != branch].tolist()

    @staticmethod
    def _heights(tree: Metamers, branches: Ints) -> Floats:
        """(B,) heights of the highest points of branches."""
        ends = tree.end[: len(tree), 2]
        return np.array([ends[tree.subtree([branch])].max() for branch in branches.tolist()])
