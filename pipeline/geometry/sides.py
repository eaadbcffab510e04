"""Which side of the branches a scanner saw, learnt where bark is thick enough to show it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.axes import Axes
from pipeline.geometry.estimates import CYLINDER, MOMENTS
from pipeline.geometry.windows import Windows

Floats = NDArray[np.float64]

LEAST = 5  # windows that it takes to know
LEAST_POINTS = 30
CLEAR = 5.0  # radii of this many noises show which side is seen
HALF_RING = 2.0 / np.pi  # length of the mean unit vector over half a circle


def seen_from(windows: Windows, noise: float) -> Floats:
    """Learn from the thick limbs where the bark is seen from.

    Parameters
    ----------
    windows : Windows
    noise : float
        Range noise, metres.

    Returns
    -------
    (3,) array
        Mean of the unit vectors from the axes to the points: nothing for a tree that is seen all round,
        0.64 long towards the scanner when only one side is.
    """
    bark = (windows.kind == CYLINDER) & (windows.count >= LEAST_POINTS)
    bark &= (windows.evidence > 0.5) & (windows.square > (CLEAR * noise) ** 2)
    if np.count_nonzero(bark) < LEAST:
        return np.zeros(3)
    mean = windows.facing[bark].mean(axis=0)
    return np.asarray(mean * min(1.0, HALF_RING / max(float(np.linalg.norm(mean)), 1e-9)))


def complete(windows: Windows, axes: Axes, towards: Floats) -> Windows:
    """Estimates of thin branches from the side that is seen of them, as if all were.

    The points of half a ring lie nearer to their own mean line than to the axis: their mean square
    distance is ``r^2 (1 - m^2)``, m the length of the mean unit vector, and the axis lies ``m r`` behind
    their middle. Fitted cylinders know that already.

    Parameters
    ----------
    windows : Windows
    axes : Axes
    towards : (3,) array
        From `seen_from`.
    """
    thin = windows.kind == MOMENTS
    share = 1.0 - float((towards**2).sum())
    square = np.where(thin, windows.square / share, windows.square)
    variance = np.where(thin, windows.variance / share**2, windows.variance)
    along = axes.frames()
    across = towards - (along @ towards)[:, None] * along
    radius = np.sqrt(np.maximum(square, 0.0)) * thin
    return replace(windows, square=square, variance=variance, shift=windows.shift - radius[:, None] * across)
