"""The convex outline of a crown, exact on snapped coordinates."""

from __future__ import annotations

import numpy as np

from pipeline.airborne.raster import STEPS, Ints
from pipeline.geometry.compiled import compiled
from pipeline.model import Floats


def hull(xy: Floats) -> Floats:
    """(K, 2) corners of the convex hull, anticlockwise from the westernmost; not closed.

    Parameters
    ----------
    xy : (N, 2) array
        Snapped coordinates in metres, at least one point.

    References
    ----------
    Andrew, A. M. (1979). Another efficient algorithm for convex hulls in two dimensions. Inf. Process.
    Lett. 9 (5), 216-219.
    """
    steps = np.rint(xy * STEPS).astype(np.int64)
    steps = steps[np.lexsort((steps[:, 1], steps[:, 0]))]
    lower, upper = _chain(steps), _chain(steps[::-1].copy())
    return np.asarray(np.concatenate([lower[:-1], upper[:-1]]) if len(lower) > 1 else lower) / STEPS


@compiled
def _chain(steps: Ints) -> Ints:
    """Half of the hull: the points that the path from the first to the last turns left at."""
    out = np.empty((len(steps), 2), dtype=np.int64)
    held = 0
    for p in range(len(steps)):
        x, y = steps[p, 0], steps[p, 1]
        if held and out[held - 1, 0] == x and out[held - 1, 1] == y:
            continue
        while held >= 2:
            ax, ay = out[held - 2, 0], out[held - 2, 1]
            bx, by = out[held - 1, 0], out[held - 1, 1]
            if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0:
                break
            held -= 1
        out[held, 0], out[held, 1] = x, y
        held += 1
    return out[:held].copy()


def area(outline: Floats) -> float:
    """Area of a polygon in square metres, from its corners (K, 2) in order."""
    x, y = np.rint((outline - outline[0]) * STEPS).astype(np.int64).T
    twice = int((x * np.roll(y, -1) - np.roll(x, -1) * y).sum())
    return abs(twice) / 2 / STEPS**2
