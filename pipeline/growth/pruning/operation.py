"""What all operations have in common: they act on a `Growth`, and the log tells what they did."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from pipeline.errors import UsageError
from pipeline.growth.carrying import Carrying
from pipeline.growth.log import Entry
from pipeline.growth.simulation import Growth
from pipeline.growth.state import DAMAGED, Metamers
from pipeline.model import Floats, Ints
from pipeline.options import Options

ROUNDING_M = 1e-9


@dataclass(frozen=True)
class Pruned(Entry):
    """What an operation has done.

    Attributes
    ----------
    operation : str
        Its name.
    cuts : int
        Places where wood was cut off; each bud there is damaged.
    removed : int
        Metamers gone.
    tied, bent : int
        Axes that were tied to a support, or bent.
    """

    operation: str
    cuts: int = 0
    removed: int = 0
    tied: int = 0
    bent: int = 0

    @property
    def idle(self) -> bool:
        """Whether nothing was there to do."""
        return not (self.cuts or self.tied or self.bent)


class Operation(Options, ABC):
    """Something that is done to a tree."""

    name: ClassVar[str]
    about: ClassVar[str]
    """What it does, in a line."""
    sought: ClassVar[str]
    """What it looks for, and what to try where there is none."""

    def apply(self, growth: Growth) -> Pruned:
        """Do it, and write it into the growth's log.

        Light and occupancy are then what they would be had the lost wood never grown; the numbers of the
        metamers that stay close up in their order.

        Raises
        ------
        UsageError
            If a named branch is not there, or a cut would leave nothing of the tree.
        """
        before = len(growth.metamers)
        done = self._act(growth)
        entry = Pruned(growth.year, self.name, removed=before - len(growth.metamers), **done)
        growth.log.append(entry)
        return entry

    def check_chosen(self, growth: Growth) -> None:
        """Make sure that the branches are there which are meant.

        Raises
        ------
        UsageError
            If no branch fits; tells the nearest.
        """

    @abstractmethod
    def _act(self, growth: Growth) -> dict[str, Any]:
        """Change the tree; returns counts for the log."""


def cut_off(growth: Growth, metamers: Iterable[int]) -> int:
    """Cut off metamers with all that they bear; the number of places where a cut was made.

    Raises
    ------
    UsageError
        If nothing above the foot would be left.
    """
    tree = growth.metamers
    cut = np.unique(np.fromiter(metamers, dtype=np.int64))
    if not len(cut):
        return 0
    gone = tree.subtree(cut)
    parent = tree.parent[cut]
    if gone[0] or gone[1:].all():
        base = tree.end[0] + reference(growth)
        msg = (
            f"the cut goes through the foot of the tree at ({base[0]:.2f}, {base[1]:.2f}, {base[2]:.2f}) and "
            "would leave nothing; cut higher up"
        )
        raise UsageError(msg)
    outermost = cut[~gone[parent]]
    growth.remove(outermost)
    return len(outermost)


def leader(tree: Metamers, start: int = 0) -> Ints:
    """Return the metamers of an axis and of what has taken over from it above cuts.

    Where the terminal bud is damaged, the axis goes on with the lateral one.
    """
    here, found = start, []
    while here >= 0:
        found.append(here)
        after = int(tree.terminal_child[here])
        if after < 0 and tree.terminal_bud[here] == DAMAGED:
            after = int(tree.lateral_child[here])
        here = after
    return np.array(found, dtype=np.int32)


def reference(growth: Growth) -> Floats:
    """(3,) coordinates of the local zero: those of a reconstructed tree, 0 for one that grew from a bud."""
    return growth.tree.skeleton.origin if isinstance(growth, Carrying) else np.zeros(3)
