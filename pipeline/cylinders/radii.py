"""Radii along branches: monotone in the square, never above the parent's, each with its source."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.cylinders.allometry import allometric_diameter
from pipeline.cylinders.crown import Crown
from pipeline.cylinders.habit import PIPE, carried_length, expected_square
from pipeline.cylinders.support import measured_nodes
from pipeline.geometry.axes import Axes
from pipeline.geometry.compiled import compiled
from pipeline.geometry.estimates import CYLINDER, MOMENTS, NONE
from pipeline.geometry.smoothing import falling_tree
from pipeline.geometry.windows import Windows
from pipeline.model import ALLOMETRIC, MEASURED, PROPAGATED

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

REWEIGHTS = 3
AROUND = 6  # nodes to either side whose median a window is first held against
DOUBT = 0.15  # relative error of a squared radius from points that look like anything but bark
WEAK = 0.25  # evidence below which a window does not count as bark
SLIM_M = 0.015  # radii below this are left alone
FEW, MANY = 6, 14  # points that fit any cylinder, and that show one
HABIT = 0.5  # relative spread of radii about that habit
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


def smooth(axes: Axes, windows: Windows, *, noise: float, min_arc: float, crown: Crown) -> Radii:
    """Fit squared radii to all windows that fall from the root to every tip.

    Where leaves or sparse points hide the bark, the pipe model stands in for windows that do not
    look like a shell: the cross-section of the lower stem, shared out by the length that each part
    carries. A branch without any window tapers from its share of the parent's cross-section. Where
    not even the lower stem is measured, allometry gives its diameter.

    Parameters
    ----------
    axes : Axes
    windows : Windows
    noise : float
        Range noise, metres.
    min_arc : float
        Least arc, in radians, for a cylinder to count as measured.
    crown : Crown
        Its diameter serves the allometry; where it does not show bark, the pipe model sets bounds.

    References
    ----------
    Shinozaki et al. (1964) for the pipe model; Jucker et al. (2017) for the allometry.
    """
    count = len(axes.xyz)
    usable = (windows.kind != NONE) & (windows.variance > 0) & np.isfinite(windows.variance)
    if crown.in_leaf:  # what is left of the leaves makes twigs as wide as the search for lines lets it
        usable &= windows.evidence >= WEAK
    square, weight = np.zeros(count), np.zeros(count)
    carried = carried_length(axes)
    stem, is_measured = _lower_stem(axes, windows, crown.diameter_m)
    pipe = stem * carried / max(carried[0], 1e-9)
    # leaves and sparse points are wider than the wood: there the pipe model stands in for them
    loose = usable & (windows.evidence < WEAK) & (windows.square > np.maximum(pipe, SLIM_M**2))
    loose &= not crown.shows_bark
    value = np.where(loose, np.maximum(pipe, SLIM_M**2), windows.square)
    # No branch is round to better than some hundredths of its radius.
    variance = np.where(usable, windows.variance, 0.0) + (0.02 * value) ** 2 + 1e-12
    variance = variance + np.where(loose, value**2, 0.0)
    # points far wider than noise about a mean line are no twig: that they lie so is all that is known
    # and two branches side by side fit one wide cylinder, at twice the noise
    loose_fit = np.clip(
        windows.spread / np.maximum(noise, 0.08 * np.sqrt(np.maximum(value, 0.0))) - 1.3, 0, 1
    )
    doubt = np.where(windows.kind == MOMENTS, 1.0 - windows.evidence, DOUBT * (1.0 - windows.evidence))
    # and few points fit any cylinder
    few = np.clip((MANY - windows.count) / (MANY - FEW), 0.0, 1.0)
    doubt = np.where(windows.kind == CYLINDER, np.maximum(np.maximum(doubt, loose_fit), few), doubt)
    variance = variance + np.where(usable, (doubt * np.maximum(value, 0.0)) ** 2, 0.0)
    expected = expected_square(axes, value, usable & ~loose & (few < 1.0), carried, stem)
    spread = (2.0 * HABIT * expected) ** 2
    own = np.where(usable, spread / (spread + np.where(usable, variance, 1.0)), 1.0)
    own[: int(axes.first[1])] = 1.0
    value, variance = own * value + (1.0 - own) * expected, own * variance
    if not is_measured:
        usable = usable & (windows.evidence >= WEAK)
        usable[: int(axes.first[1])] = False
    _smooth(axes.first, axes.foot, carried, (value, variance, usable), (square, weight), stem)
    wide_enough = (windows.arc >= min_arc) | (windows.kind == MOMENTS)
    bears = usable & wide_enough & (windows.evidence >= WEAK) & (weight > 0.2)
    seen = measured_nodes(axes, windows.square, square, bears, own)
    other = PROPAGATED if is_measured else ALLOMETRIC
    source = np.where(seen, MEASURED, other).astype(np.uint8)
    radius = np.sqrt(np.maximum(square, 0.0))
    error = np.where(bears, np.sqrt(variance) / np.maximum(2.0 * radius, 1e-3), 0.0)
    return Radii(square, source, np.where(seen, error, np.maximum(error, GUESS * radius)))


def _lower_stem(axes: Axes, windows: Windows, crown_m: float) -> tuple[float, bool]:
    """Squared radius of the lowest metres of the stem, and whether the points show it."""
    stem = np.arange(int(axes.first[0]), int(axes.first[1]))
    height = axes.xyz[stem, 2] - axes.xyz[stem[0], 2]
    low = stem[(height >= 0.2) & (height <= 2.0)]
    sure = low[(windows.kind[low] == CYLINDER) & (windows.evidence[low] >= WEAK)]
    if len(sure) >= 3:
        return float(np.median(windows.square[sure])), True
    tall = float(np.ptp(axes.xyz[:, 2]))
    return (allometric_diameter(tall, crown_m) / 2) ** 2, False


@compiled
def _smooth(
    first: Ints,
    foot: Ints,
    carried: Floats,
    windows: tuple[Floats, Floats, NDArray[np.bool_]],
    out: tuple[Floats, Floats],
    stem: float,
) -> None:
    """One falling fit over the whole tree, so that which branch goes on at a fork makes no difference."""
    value, variance, usable = windows
    square, weight = out
    known, above, begin = _known_nodes(first, foot, usable)
    y, v = value[known], variance[known]
    robust = np.ones(len(known))
    for b in range(len(first) - 1):
        run = slice(begin[b], begin[b + 1])
        if begin[b + 1] > begin[b]:
            robust[run] = _tukey(np.abs(y[run] - _running_median(y[run])), np.sqrt(v[run]))
    fit = falling_tree(y, robust / v, above)
    for _ in range(REWEIGHTS):
        off = np.abs(y - fit)
        for b in range(len(first) - 1):
            run = slice(begin[b], begin[b + 1])
            if begin[b + 1] > begin[b]:
                robust[run] = _tukey(off[run], np.sqrt(v[run]))
        fit = falling_tree(y, robust / v, above)
    weight[known] = robust
    for b in range(len(first) - 1):
        run, low, high = slice(begin[b], begin[b + 1]), first[b], first[b + 1]
        ceiling = square[foot[b]] if foot[b] >= 0 else 4.0 * stem
        if begin[b + 1] == begin[b]:
            _by_pipe(b, (low, high), ceiling, carried, foot, square)
            continue
        _spread_out((low, high), known[run], fit[run], square)
        for i in range(low, high):
            square[i] = min(square[i], ceiling)


@compiled
def _known_nodes(first: Ints, foot: Ints, usable: NDArray[np.bool_]) -> tuple[Ints, Ints, Ints]:
    """Measured nodes, the measured one before each towards the root, and where each branch's begin."""
    known = np.empty(len(usable), dtype=np.int64)
    above = np.empty(len(usable), dtype=np.int64)
    before = np.full(len(usable), -1, dtype=np.int64)  # the last measured node up to every node
    begin = np.zeros(len(first), dtype=np.int64)
    count = 0
    for b in range(len(first) - 1):
        last = before[foot[b]] if foot[b] >= 0 else -1
        enough = usable[first[b] : first[b + 1]].sum() >= 2
        for i in range(first[b], first[b + 1]):
            if usable[i] and enough:
                known[count], above[count] = i, last
                last = count
                count += 1
            before[i] = last
        begin[b + 1] = count
    return known[:count].copy(), above[:count].copy(), begin


@compiled
def _running_median(values: Floats) -> Floats:
    """Median over the neighbours, from which a fit that pools what does not fall may start."""
    out = np.empty(len(values))
    for i in range(len(values)):
        out[i] = np.median(values[max(i - AROUND, 0) : i + AROUND + 1])
    return out


@compiled
def _tukey(off: Floats, error: Floats) -> Floats:
    """Tukey's weights of residuals, which never go to nothing."""
    limit = 4.685 * max(np.median(off / error), 1.0)
    u = np.minimum(off / (limit * error), 1.0)
    return np.maximum((1.0 - u * u) ** 2, 1e-3)


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
    share = (carried[low] / max(carried[foot[b]], 1e-9)) ** PIPE if foot[b] >= 0 else 0.25
    for i in range(low, high):
        square[i] = min(share, 1.0) * max(ceiling, 0.0) * (high - i) / (high - low)
