"""Circles that the skeleton stage fitted to a thinly scanned stem, as windows of the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pipeline.geometry.axes import Axes
from pipeline.geometry.estimates import CYLINDER
from pipeline.geometry.windows import Windows

NEAR_M = 0.2  # a circle stands for the nodes this near to its height
SOUND = 0.5  # evidence of a window that needs no circle


def with_circles(windows: Windows, axes: Axes, circles: Sequence[tuple[float, float, float]]) -> Windows:
    """Let circles stand in where the stem's own windows hold too few points to show its bark.

    Parameters
    ----------
    windows : Windows
    axes : Axes
        Branch 0 is the stem; its nodes lie on the circles' centres already.
    circles : sequence of tuple
        Height (relative to the origin), radius and its standard error, metres.
    """
    if not len(circles):
        return windows
    height, radius, error = np.array(circles, dtype=np.float64).T
    stem = np.arange(int(axes.first[0]), int(axes.first[1]))
    gap = np.abs(axes.xyz[stem, 2][:, None] - height)
    nearest = gap.argmin(axis=1)
    weak = (windows.kind[stem] != CYLINDER) | (windows.evidence[stem] < SOUND)
    chosen = weak & (gap.min(axis=1) <= NEAR_M)
    at, circle = stem[chosen], nearest[chosen]
    kind, evidence = windows.kind.copy(), windows.evidence.copy()
    square, variance = windows.square.copy(), windows.variance.copy()
    shift, centre, arc = windows.shift.copy(), windows.centre_variance.copy(), windows.arc.copy()
    kind[at], evidence[at] = CYLINDER, 1.0
    square[at] = radius[circle] ** 2
    variance[at] = (2.0 * radius[circle] * error[circle]) ** 2
    shift[at], centre[at], arc[at] = 0.0, error[circle] ** 2, 2.0 * np.pi
    return replace(
        windows,
        kind=kind,
        shift=shift,
        square=square,
        variance=variance,
        centre_variance=centre,
        arc=arc,
        evidence=evidence,
    )
