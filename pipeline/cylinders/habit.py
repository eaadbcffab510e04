"""The tree's habit: how thick its branches are for the length that they carry."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.axes import Axes
from pipeline.geometry.compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

PIPE = 1.0  # a branch's cross-section follows the length that it carries (pipe model)
CARRIED_M = 0.05  # a tip carries something too
LEARN = 30  # nodes that it takes to learn the tree's habit
CLASS, CLASSES = 0.5, 3  # width of its classes of carried length, as a logarithm, and how many it takes
CLASS_LEAST, CLASS_SHARE = 8, 0.4  # measured nodes that a class takes, and their share of its nodes
LEANING = 1.5  # spread of the logarithms of length with which the classes weigh as much as the pipe model
STEEPEST = 1.5


def expected_square(
    axes: Axes, square: Floats, known: NDArray[np.bool_], carried: Floats, stem: float
) -> Floats:
    """Squared radius that the tree's own measured branches suggest for every node.

    A straight line through the logarithms of radius and carried length, by medians over classes of
    length: each tree has its own pipe model. Noise then leaves thin twigs where their carried length
    puts them. A class of which few nodes are measured shows its thickest alone and does not count; what
    little is left of the slope then leans on the pipe model's.

    Parameters
    ----------
    axes : Axes
    square : (M,) array
        Squared radii, square metres.
    known : (M,) array of bool
        Which are measured.
    carried : (M,) array
        Length beyond every node, metres.
    stem : float
        Squared radius of the lower stem, square metres; where too few nodes are measured, the pipe model
        shares it out.

    Returns
    -------
    (M,) array
        Square metres.

    References
    ----------
    Shinozaki et al. (1964), "A quantitative analysis of plant form: the pipe model theory".
    """
    begin = int(axes.first[1])  # the stem has a habit of its own
    piped = stem * (carried + CARRIED_M) / (carried[0] + CARRIED_M)
    x = np.log(carried + CARRIED_M)
    group = np.floor(x / CLASS).astype(np.int64)
    known = known & (np.arange(len(known)) >= begin)
    if np.count_nonzero(known) < LEARN:
        return np.asarray(piped)
    rows = []
    for g in np.unique(group[known]):
        chosen = known & (group == g)
        count, middle = np.count_nonzero(chosen), np.median(square[chosen])  # noise makes some negative
        if count >= max(CLASS_LEAST, CLASS_SHARE * np.count_nonzero(group[begin:] == g)) and middle > 0.0:
            rows.append((np.median(x[chosen]), np.log(middle), count))
    if len(rows) < CLASSES:
        return np.asarray(piped)
    middle, level, count = np.array(rows).T
    weight = count / count.mean()
    off = middle - np.average(middle, weights=weight)
    slope = ((weight * off * level).sum() + LEANING * PIPE) / ((weight * off * off).sum() + LEANING)
    slope = min(max(float(slope), 0.0), STEEPEST)
    return np.asarray(np.exp(np.average(level - slope * middle, weights=weight) + slope * x))


def carried_length(axes: Axes) -> Floats:
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
