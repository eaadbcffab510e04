"""The pipe model: wood is as thick as what it carries, and never becomes thinner."""

from __future__ import annotations

from pipeline.geometry.compiled import compiled
from pipeline.growth.options import LimitOptions
from pipeline.growth.state import Metamers
from pipeline.model import Floats, Ints


def thicken(tree: Metamers, options: LimitOptions) -> None:
    """Let every metamer be as thick as its children together, or as it was."""
    count = len(tree)
    tip = 2.0 * options.tip_radius_m
    pipes(tree.terminal_child[:count], tree.lateral_child[:count], tree.width, options.pipe_exponent, tip)


@compiled
def pipes(terminal_child: Ints, lateral_child: Ints, width: Floats, exponent: float, tip: float) -> None:
    """Join the diameters of children by a power, from the tips down."""
    for i in range(len(terminal_child) - 1, -1, -1):
        t, s = terminal_child[i], lateral_child[i]
        if t >= 0 and s >= 0:
            carried = (width[t] ** exponent + width[s] ** exponent) ** (1.0 / exponent)
        elif t >= 0 or s >= 0:
            carried = width[max(t, s)]
        else:
            carried = tip
        width[i] = max(width[i], carried)
