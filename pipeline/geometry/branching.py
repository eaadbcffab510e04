"""Which child continues a branch at a fork."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# A straight way on counts twice, thickness and carried length (as logarithms) help.
STRAIGHT, THICK, CARRIED = 2.0, 0.6, 0.4


def continue_branches(xyz: Floats, parent: Ints, radius: Floats, window_m: float) -> Ints:
    """(N,) the child that continues the branch at every node, -1 at tips.

    The score of a child is ``2 cos(bend) + 0.6 ln(radius) + 0.4 ln(carried length)``; the bend
    is taken between the way in and the way out over `window_m` or three radii.

    Parameters
    ----------
    xyz : (N, 3) array
        Nodes in metres.
    parent : (N,) array
        Parents before children, -1 at node 0.
    radius : (N,) array
        Thickness of the wood at every node, metres.
    window_m : float
        Least length over which directions are taken, metres.
    """
    step = np.linalg.norm(xyz - xyz[np.maximum(parent, 0)], axis=1)
    return _continuing(xyz, parent, step, radius, window_m)


@compiled
def longest_child(parent: Ints, step: Floats) -> Ints:
    """(N,) the child on the longest way to a tip; -1 at tips. Ties fall to the smaller number."""
    count = len(parent)
    reach = np.zeros(count)
    ahead = np.full(count, -1, dtype=np.int64)
    for i in range(count - 1, 0, -1):
        p = parent[i]
        if ahead[p] < 0 or reach[i] + step[i] >= reach[p]:
            reach[p] = reach[i] + step[i]
            ahead[p] = i
    return ahead


@compiled
def _continuing(xyz: Floats, parent: Ints, step: Floats, thickness: Floats, window: float) -> Ints:
    count = len(parent)
    ahead = longest_child(parent, step)
    carried = step.copy()
    for i in range(count - 1, 0, -1):
        carried[parent[i]] += carried[i]
    chosen = np.full(count, -1, dtype=np.int64)
    best = np.full(count, -np.inf)
    for c in range(1, count):
        fork = parent[c]
        reach = max(window, 3.0 * thickness[fork])
        behind, gone = fork, 0.0
        while parent[behind] >= 0 and gone < reach:
            gone += step[behind]
            behind = parent[behind]
        tip, gone = c, step[c]
        while ahead[tip] >= 0 and gone < reach:
            tip = ahead[tip]
            gone += step[tip]
        way_in, way_out = xyz[fork] - xyz[behind], xyz[tip] - xyz[fork]
        if behind == fork:
            way_in = np.array([0.0, 0.0, 1.0])
        norm = np.sqrt((way_in * way_in).sum() * (way_out * way_out).sum())
        straight = (way_in * way_out).sum() / norm if norm > 0.0 else 0.0
        score = STRAIGHT * straight
        score += THICK * np.log(max(thickness[tip], 1e-4)) + CARRIED * np.log(max(carried[c], 1e-4))
        if score > best[fork]:
            best[fork], chosen[fork] = score, c
    return chosen
