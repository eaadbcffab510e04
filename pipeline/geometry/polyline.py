"""Simplifying chains of nodes: Douglas-Peucker with a tolerance of its own at every node."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled

Floats = NDArray[np.float64]


@compiled
def douglas_peucker(values: Floats, tolerance: Floats) -> NDArray[np.bool_]:
    """Choose the nodes of a chain that keep every other node within its tolerance.

    Parameters
    ----------
    values : (N, D) array
        Position along the chain's nodes; the first three columns are x, y, z. Further columns
        are quantities in units of their own tolerance (deviation 1 is the most allowed) that are
        interpolated by arc length.
    tolerance : (N,) array
        Greatest distance of each node from the simplified chain, in metres.

    Returns
    -------
    keep : (N,) array of bool
        True for the nodes that stay; both ends always do.

    References
    ----------
    Douglas & Peucker (1973). Here a node splits a span when its deviation *in units of its own
    tolerance* is the largest and above one.
    """
    count = len(values)
    keep = np.zeros(count, dtype=np.bool_)
    keep[0] = True
    keep[count - 1] = True
    arc = np.zeros(count)
    for i in range(1, count):
        arc[i] = arc[i - 1] + np.sqrt(((values[i, :3] - values[i - 1, :3]) ** 2).sum())
    stack = np.empty((count + 2, 2), dtype=np.int64)
    stack[0, 0], stack[0, 1], top = 0, count - 1, 1
    while top:
        top -= 1
        a, b = stack[top, 0], stack[top, 1]
        worst, at = 1.0, -1
        for i in range(a + 1, b):
            off = deviation(values, arc, a, b, i, tolerance[i])
            if off > worst:
                worst, at = off, i
        if at >= 0:
            keep[at] = True
            stack[top, 0], stack[top, 1] = a, at
            stack[top + 1, 0], stack[top + 1, 1] = at, b
            top += 2
    return keep


@compiled
def deviation(values: Floats, arc: Floats, a: int, b: int, i: int, tolerance: float) -> float:
    """Deviation of node `i` from the span `a`-`b`, in units of its tolerance."""
    along = values[b, :3] - values[a, :3]
    off = values[i, :3] - values[a, :3]
    square = (along * along).sum()
    t = min(max((off * along).sum() / square, 0.0), 1.0) if square > 0.0 else 0.0
    away = off - t * along
    worst = np.sqrt((away * away).sum()) / tolerance
    span = arc[b] - arc[a]
    share = (arc[i] - arc[a]) / span if span > 0.0 else 0.0
    for d in range(3, values.shape[1]):
        between = values[a, d] + share * (values[b, d] - values[a, d])
        worst = max(worst, abs(values[i, d] - between))
    return float(worst)
