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
    return _around(np.rint(xy * STEPS).astype(np.int64)) / STEPS


@compiled
def _around(steps: Ints) -> Ints:
    """Corners of the hull; points are sorted by x, then y, as one number each."""
    low, west = steps[:, 1].min(), steps[:, 0].min()
    high = steps[:, 1].max() - low + 1
    key = np.sort((steps[:, 0] - west) * high + steps[:, 1] - low)
    ordered = np.empty((len(key), 2), dtype=np.int64)
    for p in range(len(key)):
        ordered[p, 0], ordered[p, 1] = key[p] // high + west, key[p] % high + low
    lower, upper = _chain(ordered), _chain(ordered[::-1].copy())
    if len(lower) == 1:
        return lower
    return np.concatenate((lower[:-1], upper[:-1]))


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
    return abs(_twice(np.rint((outline - outline[0]) * STEPS).astype(np.int64))) / 2 / STEPS**2


@compiled
def _twice(steps: Ints) -> int:
    """Twice the area that corners go round, in square steps."""
    total, last = 0, len(steps) - 1
    for p in range(len(steps)):
        total += steps[last, 0] * steps[p, 1] - steps[p, 0] * steps[last, 1]
        last = p
    return int(total)
