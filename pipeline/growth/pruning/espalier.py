"""The espalier: a tree flat along a wall, with arms in tiers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from pipeline.errors import UsageError
from pipeline.growth.pruning.cutting import first_beyond
from pipeline.growth.pruning.guiding import bend
from pipeline.growth.pruning.operation import Operation, cut_off, leader
from pipeline.growth.simulation import Growth
from pipeline.growth.state import DAMAGED, DORMANT, NO_SUPPORT, Mask, Metamers
from pipeline.model import Floats, Ints

TIER = 6
"""Metamers of the stem in a tier: three to keep a distance, two that bear the arms, one to end it."""
ARMS = (4, 5)
THICKEST_M = 0.04
"""Diameter up to which an arm can be bent."""
CUT_M = 0.10
"""Diameter from which no cut is made: a grown tree is not made an espalier."""
UP = np.array([0.0, 0.0, 1.0])


class Espalier(Operation):
    """Train a tree flat along a wall; done every year, as long as it shall stay one.

    Of every six metamers of the stem, side shoots of the first three are cut, the fourth and fifth bear the
    arms, to the left and to the right, and the sixth ends the tier: its terminal bud is cut, and its lateral
    bud goes on as the stem, up to the last tier, where that is cut, too. Arms are bent level in the year in
    which they grow and tied; what they bear stays short.

    References
    ----------
    Section 4.3 of the thesis. Changed: the arms are bent, which it leaves out, and which of the two goes to
    the left is decided by their buds, so that they are bent less. An arm's length has a limit.
    """

    name: ClassVar[str] = "espalier"
    about: ClassVar[str] = "train tiers of level arms along a wall, year by year"
    sought: ClassVar[str] = "new shoots of the stem in its tiers; let the tree grow first"

    tiers: int = Field(3, ge=1, le=20, description="number of tiers, each with an arm to either side")
    wall_deg: float = Field(
        0.0, ge=-360, le=360, description="the way along the wall, from +x towards +y, degrees"
    )
    arm_m: float = Field(1.5, gt=0, le=20, description="greatest length of an arm, metres")
    side_metamers: int = Field(2, ge=0, le=100, description="metamers that side shoots of arms may have")
    weight: float = Field(1.0, gt=0, le=20, description="pull of the supports of stem and arms")

    def _act(self, growth: Growth) -> dict[str, Any]:
        tree = growth.metamers
        ending = list(self._cuts(tree))
        self._check(tree, ending)
        pinched = self._pinched(tree)
        young = pinched[tree.birth_year[pinched] > 0]
        spurs, ends = tree.key[tree.parent[young]], ~tree.is_lateral[young]
        cuts = cut_off(growth, [*ending, *pinched.tolist()])
        renew(tree, spurs, ends)
        self._rub_off(tree)
        bent, tied = self._train(growth)
        tied += self._stake(growth)
        return {"cuts": cuts, "bent": bent, "tied": tied}

    def _check(self, tree: Metamers, cuts: Sequence[int]) -> None:
        widths = tree.width[np.array(cuts, dtype=np.int64)]
        if len(cuts) and widths.max() > CUT_M:
            msg = (
                f"an espalier is trained from a young tree; this one would be cut where it is "
                f"{100.0 * widths.max():.0f} cm thick: begin in its first years"
            )
            raise UsageError(msg)

    def _places(self, tree: Metamers) -> Iterator[tuple[int, int, int]]:
        """Yield the metamers of the stem with their tier and their place in it, from 1."""
        for number, metamer in enumerate(leader(tree)[1:].tolist()):
            yield metamer, number // TIER, number % TIER + 1

    def _cuts(self, tree: Metamers) -> Iterator[int]:
        """Yield what is cut off for good."""
        for metamer, tier, place in self._places(tree):
            end, side = int(tree.terminal_child[metamer]), int(tree.lateral_child[metamer])
            if tier >= self.tiers:
                yield metamer
                return
            last = tier == self.tiers - 1
            if side >= 0 and (place < ARMS[0] or (place == TIER and last)):
                yield side
            if end >= 0 and place == TIER:
                yield end

    def _pinched(self, tree: Metamers) -> Ints:
        """Return where arms and the shoots on them are cut because they are too long."""
        sides = [(place, int(tree.lateral_child[metamer])) for metamer, _, place in self._places(tree)]
        return np.array(
            [
                top
                for place, side in sides
                if place in ARMS and side >= 0
                for top in self._too_long(tree, side)
            ],
            dtype=np.int32,
        )

    def _too_long(self, tree: Metamers, arm: int) -> Iterator[int]:
        """Yield what an arm, and the shoots on it, have too much."""
        if (top := first_beyond(tree, arm, self.arm_m)) is not None:
            yield top
        depth = {int(metamer): 0 for metamer in tree.axis(arm)}
        for metamer in np.flatnonzero(tree.subtree([arm])).tolist():
            if metamer not in depth:
                depth[metamer] = depth[int(tree.parent[metamer])] + 1
                if depth[metamer] == self.side_metamers + 1:
                    yield metamer

    def _rub_off(self, tree: Metamers) -> None:
        """Take the buds that end a tier."""
        for metamer, tier, place in list(self._places(tree)):
            if place == TIER and tree.terminal_bud[metamer] == DORMANT:
                tree.terminal_bud[metamer] = DAMAGED
            if place == TIER and tier == self.tiers - 1 and tree.lateral_bud[metamer] == DORMANT:
                tree.lateral_bud[metamer] = DAMAGED

    def _train(self, growth: Growth) -> tuple[int, int]:
        """Bend what the arms have grown this year, and tie arms that are new; how many of either."""
        tree = growth.metamers
        bent = tied = 0
        for arm, way in list(self._arms(tree)):
            axis = tree.axis(arm)
            young = axis[(tree.birth_year[axis] == growth.year) | (tree.support[arm] == NO_SUPPORT)]
            if len(young) and tree.width[young[0]] <= THICKEST_M:
                bend(growth, young[:1], axis[np.searchsorted(axis, young[0]) :], way)
                bent += 1
            if tree.support[arm] == NO_SUPPORT:
                growth.tie(arm, way, weight=self.weight)
                tied += 1
        return bent, tied

    def _arms(self, tree: Metamers) -> Iterator[tuple[int, Floats]]:
        """Yield the first metamer of every arm, and its way along the wall."""
        wall = np.radians(self.wall_deg)
        right = np.array([np.cos(wall), np.sin(wall), 0.0])
        stem = leader(tree)[1:].tolist()
        for first in range(ARMS[0] - 1, len(stem), TIER):
            pair = stem[first : first + 2]
            looks = [float(tree.lateral_bud_direction[metamer] @ right) for metamer in pair]
            swapped = len(looks) == 2 and looks[0] > looks[1]
            for metamer, way in zip(pair, (right, -right) if swapped else (-right, right), strict=False):
                if (arm := int(tree.lateral_child[metamer])) >= 0:
                    yield arm, way

    def _stake(self, growth: Growth) -> int:
        """Tie the stem, and what has taken over as such; the number of new ties."""
        tree, tied = growth.metamers, 0
        for metamer in leader(tree).tolist():
            if tree.support[metamer] == NO_SUPPORT:
                growth.tie(metamer, UP, weight=self.weight)
                tied += 1
        return tied


def renew(tree: Metamers, spurs: NDArray[np.uint64], ends: Mask) -> None:
    """Let buds sprout again where young wood was pinched: a short shoot keeps buds at its base.

    Parameters
    ----------
    tree : Metamers
    spurs : (K,) array
        Keys of the metamers that bore the wood.
    ends : (K,) array
        Whether it grew from the terminal bud.
    """
    row = {key: i for i, key in enumerate(tree.held()["key"].tolist())}
    for key, end in zip(spurs.tolist(), ends.tolist(), strict=True):
        if key in row:
            (tree.terminal_bud if end else tree.lateral_bud)[row[key]] = DORMANT
