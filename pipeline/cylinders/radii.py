"""Radii along branches: monotone in the square, never above the parent's, each with its source."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.cylinders.axes import Axes
from pipeline.cylinders.windows import NONE, Windows
from pipeline.geometry.compiled import compiled
from pipeline.geometry.smoothing import falling
from pipeline.model import MEASURED, PROPAGATED

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

REWEIGHTS = 3
PIPE = 1.0  # a branch's cross-section follows the length that it carries (pipe model)
GUESS = 0.3  # relative standard error of a radius that no points support


@dataclass(frozen=True, eq=False)
class Radii:
    """Squared radius at every node, where it comes from and how sure it is.

    Parameters
    ----------
    square : (M,) array
        Square metres; below zero where noise exceeds the wood.
    source : (M,) array of uint8
        MEASURED or PROPAGATED.
    error : (M,) array
        Standard error of the radius, metres.
    """

    square: Floats
    source: NDArray[np.uint8]
    error: Floats


def smooth(axes: Axes, windows: Windows, *, min_arc: float) -> Radii:
    """Fit falling squared radii to the windows of every branch, from the stem outwards.

    A branch without any window tapers from its share of the parent's cross-section, by the length
    that it carries.

    Parameters
    ----------
    axes : Axes
    windows : Windows
    min_arc : float
        Least arc, in radians, for a node to count as measured.

    References
    ----------
    Shinozaki et al. (1964) for the pipe model.
    """
    count = len(axes.xyz)
    usable = (windows.kind != NONE) & (windows.variance > 0) & np.isfinite(windows.variance)
    square, weight = np.zeros(count), np.zeros(count)
    carried = _carried(axes)
    radius = np.sqrt(np.maximum(windows.square, 0.0))
    # No tree is round to better than a hundredth of its radius.
    variance = windows.variance + (0.02 * windows.square) ** 2 + 1e-12
    _smooth(
        axes.first, axes.foot, carried, (windows.square, variance, usable), (square, weight)
    )
    seen = usable & (windows.arc >= min_arc) & (weight > 0.2)
    source = np.where(seen, MEASURED, PROPAGATED).astype(np.uint8)
    smoothed = np.sqrt(np.maximum(square, 0.0))
    error = np.where(
        seen, np.sqrt(variance) / np.maximum(2.0 * np.maximum(smoothed, radius), 1e-4), GUESS * smoothed
    )
    return Radii(square, source, error)


def _carried(axes: Axes) -> Floats:
    """(M,) length of wood beyond every node, side branches included."""
    step = np.linalg.norm(np.diff(axes.xyz, axis=0, prepend=axes.xyz[:1]), axis=1)
    step[axes.first[:-1]] = 0.0
    return _sum_beyond(step, axes.first, axes.foot)


@compiled
def _sum_beyond(step: Floats, first: Ints, foot: Ints) -> Floats:
    beyond = np.zeros(len(step))
    for b in range(len(first) - 2, -1, -1):  # branches come after the branch that they stand on
        for i in range(first[b + 1] - 2, first[b] - 1, -1):
            beyond[i] += beyond[i + 1] + step[i + 1]
        if foot[b] >= 0:
            beyond[foot[b]] += beyond[first[b]]
    return beyond


@compiled
def _smooth(
    first: Ints,
    foot: Ints,
    carried: Floats,
    windows: tuple[Floats, Floats, NDArray[np.bool_]],
    out: tuple[Floats, Floats],
) -> None:
    value, variance, usable = windows
    square, weight = out
    for b in range(len(first) - 1):
        low, high = first[b], first[b + 1]
        known = np.flatnonzero(usable[low:high]) + low
        ceiling = square[foot[b]] if foot[b] >= 0 else np.inf
        if len(known) < 2:
            _by_pipe(b, (low, high), ceiling, carried, foot, square)
            continue
        y, v = value[known], variance[known]
        robust = np.ones(len(known))
        fit = falling(y, 1.0 / v)
        for _ in range(REWEIGHTS):
            off = np.abs(y - fit)
            spread = max(np.median(off / np.sqrt(v)), 1.0)
            for k in range(len(known)):
                u = off[k] / (4.685 * spread * np.sqrt(v[k]))
                robust[k] = max((1.0 - u * u) ** 2, 1e-3) if u < 1.0 else 1e-3
            fit = falling(y, robust / v)
        weight[known] = robust
        _spread_out((low, high), known, fit, square)
        for i in range(low, high):
            square[i] = min(square[i], ceiling)


@compiled
def _spread_out(run: tuple[int, int], known: Ints, fit: Floats, square: Floats) -> None:
    """Interpolate between the known nodes; before the first constant, after the last taper."""
    low, high = run
    at = 0
    for i in range(low, high):
        while at < len(known) - 1 and known[at + 1] <= i:
            at += 1
        if i <= known[0]:
            square[i] = fit[0]
        elif i >= known[-1]:
            rest = 1.0 - (i - known[-1]) / (high - known[-1])
            square[i] = fit[-1] * rest if fit[-1] > 0.0 else fit[-1]
        else:
            share = (i - known[at]) / (known[at + 1] - known[at])
            square[i] = fit[at] + share * (fit[at + 1] - fit[at])


@compiled
def _by_pipe(
    b: int, run: tuple[int, int], ceiling: float, carried: Floats, foot: Ints, square: Floats
) -> None:
    """Taper a branch that nothing measures from its share of the parent's cross-section."""
    low, high = run
    if not np.isfinite(ceiling) or ceiling <= 0.0:
        square[low:high] = 0.0
        return
    share = (carried[low] / max(carried[foot[b]], 1e-9)) ** PIPE
    for i in range(low, high):
        square[i] = min(share, 1.0) * ceiling * (high - i) / (high - low)
