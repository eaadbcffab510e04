"""Which radii the points measure, and which a node owes to its neighbours or to the tree's habit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.axes import Axes
from pipeline.geometry.compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

AROUND = 6  # nodes to either side that are asked
AGREES = 0.5  # a window bears a cross-section out that lies within this share of its own estimate
MOST = 0.5  # more than this share of the nodes around bear out what is measured,
OWN = 0.5  # and of its value more than this share is the points' own, not the tree's habit


def measured_nodes(axes: Axes, square: Floats, fitted: Floats, bears: Mask, own: Floats) -> Mask:
    """(M,) nodes whose radius is measured.

    One window alone fits a circle to much that is no branch, leaves before all. What is a branch has
    nearly the same cross-section a few nodes on, and its windows say so one after the other: so most of
    the nodes around must hold a window that agrees with the radius in the model. And what habit has
    made of a window that noise leaves open is not the window's.

    Parameters
    ----------
    axes : Axes
    square : (M,) array
        What the windows say, square metres.
    fitted : (M,) array
        What the model holds, square metres.
    bears : (M,) array of bool
        Windows that look like bark and cover enough of it.
    own : (M,) array
        Share of each value that comes from the window itself, 0 to 1.
    """
    agrees = bears & (np.abs(square - fitted) <= AGREES * fitted)
    return np.asarray(bears & (own > OWN) & (_share_around(axes.first, agrees) > MOST))


@compiled
def _share_around(first: Ints, chosen: Mask) -> Floats:
    """Share of chosen ones among the nodes of the same branch around each node, itself included."""
    share = np.zeros(len(chosen))
    for b in range(len(first) - 1):
        for i in range(first[b], first[b + 1]):
            low, high = max(i - AROUND, first[b]), min(i + AROUND + 1, first[b + 1])
            share[i] = chosen[low:high].sum() / (high - low)
    return share
