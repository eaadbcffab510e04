"""The light of every bud of a tree, as any model of light gives it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.growth.state import DAMAGED, DORMANT, Metamers
from pipeline.model import Floats


class BudLight(NamedTuple):
    """(N,) light at the terminal and the lateral bud of every metamer; 0 where a bud has grown.

    A damaged terminal bud has light: it is what the cut axis would have used and hands down. A damaged
    lateral one has none.
    """

    terminal: Floats
    lateral: Floats


def bud_light(tree: Metamers, terminal: Floats, lateral: Floats) -> BudLight:
    """Keep the light of those buds that have any."""
    rows = slice(0, len(tree))
    waits = tree.terminal_bud[rows]
    return BudLight(
        np.where((waits == DORMANT) | (waits == DAMAGED), terminal, 0.0),
        np.where(tree.lateral_bud[rows] == DORMANT, lateral, 0.0),
    )
