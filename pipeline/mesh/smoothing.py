"""Rounded bends: cubic curves through the nodes of an axis that never leave the bark.

A curve through given points swings out beside long segments when its direction at a node is that of
a short neighbour: a straight trunk of two metres bends over because the next ten centimetres do.
Here a curve is bound to its skeleton twice. Its reach at a node is no longer than the *shorter* of the
two segments that meet there, and so short that the curve stays within a share of the radius of
the segment. A bend is rounded where it is; what is straight stays straight.
"""

from __future__ import annotations

import numpy as np

from pipeline.mesh.axes import Axes, Index
from pipeline.mesh.options import MeshOptions
from pipeline.mesh.triangles import Flags
from pipeline.model import Floats

SWING = 4.0 / 27.0
"""A cubic Hermite curve leaves its chord by at most this share of the tangents' parts across the chord."""


def smoothed(axes: Axes, options: MeshOptions) -> Axes:
    """Add points between the nodes of axes, on cubic Hermite curves through the nodes.

    Parameters
    ----------
    axes : Axes
        The nodes of each are apart, as those that carry the rings of a tube are.
    options : MeshOptions

    Returns
    -------
    Axes
        The nodes where they were, and `subdivisions` spare points on every segment that bends; radii
        taper evenly in between. No point is farther from the skeleton than `max_swing` times the
        thinner radius of its segment.
    """
    count = options.subdivisions
    foot = segments(axes)
    if not len(foot) or not count:
        return axes
    start, end = tangents(axes, options.max_swing)
    step = axes.points[foot + 1] - axes.points[foot]
    chord = np.linalg.norm(step, axis=1)
    swing = SWING * (across(start, step, chord) + across(end, step, chord))
    bends = np.flatnonzero((swing > options.max_deviation_m / 4) & crooked(axes))
    t = np.arange(1, count + 1) / (count + 1)
    a = foot[bends]
    between = hermite(axes.points[a], axes.points[a + 1], start[bends], end[bends], t)
    share = np.clip(np.linalg.norm(between - axes.points[a, None], axis=2) / chord[bends, None], 0, 1)
    radius = axes.radius[a, None] * (1 - share) + axes.radius[a + 1, None] * share
    place = np.repeat(a + 1, count)
    return Axes(
        axes.branch,
        axes.first + count * np.searchsorted(a, axes.first),
        np.insert(axes.points, place, between.reshape(-1, 3), axis=0),
        np.insert(axes.radius, place, radius.ravel()),
        np.insert(axes.spare, place, True),
    )


def segments(axes: Axes) -> Index:
    """(S,) where every segment begins among the points of the axes."""
    goes_on = np.ones(len(axes.points), dtype=bool)
    goes_on[axes.tip] = False
    return np.flatnonzero(goes_on)


def crooked(axes: Axes) -> Flags:
    """(S,) whether a segment is of an axis that has others too."""
    count = np.diff(axes.first) - 1
    return np.repeat(count > 1, count)


def tangents(axes: Axes, swing: float) -> tuple[Floats, Floats]:
    """Return the tangents at both ends of every segment.

    Parameters
    ----------
    axes : Axes
    swing : float
        How far the curve may leave a segment, as a share of its thinner radius.

    Returns
    -------
    start, end : (S, 3) array of float64
        Along the line that halves the bend; along the axis at its foot and tip.
    """
    foot = segments(axes)
    step = axes.points[foot + 1] - axes.points[foot]
    chord = np.linalg.norm(step, axis=1)
    along = step / chord[:, None]
    heading, shorter = np.zeros_like(axes.points), np.full(len(axes.points), np.inf)
    for end in (foot, foot + 1):  # no two segments have the same foot, nor the same end
        heading[end] += along
        shorter[end] = np.minimum(shorter[end], chord)
    size = np.linalg.norm(heading, axis=1, keepdims=True)
    heading = np.where(size > 1e-6, heading / np.maximum(size, 1e-6), 0.0)
    allowed = swing * np.minimum(axes.radius[foot], axes.radius[foot + 1]) / (2 * SWING)
    reach = []
    for end in (foot, foot + 1):
        sideways = across(heading[end], step, chord)
        bound = np.where(sideways > 1e-9, allowed / np.maximum(sideways, 1e-9), np.inf)
        reach.append(np.minimum(shorter[end], bound)[:, None] * heading[end])
    return reach[0], reach[1]


def across(vectors: Floats, step: Floats, chord: Floats) -> Floats:
    """Return the lengths of the vectors' parts at right angles to their segments."""
    return np.asarray(np.linalg.norm(np.cross(vectors, step), axis=1) / chord)


def hermite(a: Floats, b: Floats, start: Floats, end: Floats, t: Floats) -> Floats:
    """Return (S, T, 3) points at the shares `t` of S cubic Hermite curves.

    Parameters
    ----------
    a, b : (S, 3) array of float64
        Where the curves start and end.
    start, end : (S, 3) array of float64
        Their tangents there.
    t : (T,) array of float64
        Between 0 and 1.
    """
    t = t[:, None]
    weight = ((1 + 2 * t) * (1 - t) ** 2, t * t * (3 - 2 * t), t * (1 - t) ** 2, t * t * (t - 1))
    parts = zip(weight, (a, b, start, end), strict=True)
    return np.asarray(sum(w * part[:, None] for w, part in parts))
