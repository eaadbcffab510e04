"""Rounded bends: cubic curves through the nodes of an axis that never leave the bark.

A curve through given points swings out beside long segments when its direction at a node is that of
a short neighbour: a straight trunk of two metres bends over because the next ten centimetres do.
Here a curve is bound to its skeleton twice. Its reach at a node is no longer than the *shorter* of the
two segments that meet there, and so short that the curve stays within a share of the radius of
the segment. A bend is rounded where it is; what is straight stays straight.
"""

from __future__ import annotations

import numpy as np

from pipeline.mesh.options import MeshOptions
from pipeline.mesh.surface import Axis
from pipeline.model import Floats

SWING = 4.0 / 27.0
"""A cubic Hermite curve leaves its chord by at most this share of the tangents' parts across the chord."""


def smoothed(axis: Axis, options: MeshOptions) -> Axis:
    """Add points between the nodes of an axis, on cubic Hermite curves through the nodes.

    Parameters
    ----------
    axis : Axis
        Its nodes are apart, as those that carry the rings of a tube are.
    options : MeshOptions

    Returns
    -------
    Axis
        The nodes where they were, and `subdivisions` spare points on every segment that bends; radii
        taper evenly in between. No point is farther from the skeleton than `max_swing` times the
        thinner radius of its segment.
    """
    count = options.subdivisions
    if len(axis.points) < 3 or not count:
        return axis
    start, end = tangents(axis.points, axis.radius, options.max_swing)
    step = np.diff(axis.points, axis=0)
    chord = np.linalg.norm(step, axis=1)
    swing = SWING * (across(start, step, chord) + across(end, step, chord))
    bends = np.flatnonzero(swing > options.max_deviation_m / 4)
    t = np.arange(1, count + 1) / (count + 1)
    between = hermite(axis.points[bends], axis.points[bends + 1], start[bends], end[bends], t)
    share = np.clip(np.linalg.norm(between - axis.points[bends, None], axis=2) / chord[bends, None], 0, 1)
    radius = axis.radius[bends, None] * (1 - share) + axis.radius[bends + 1, None] * share
    place = np.repeat(bends + 1, count)
    return Axis(
        axis.branch,
        np.insert(axis.points, place, between.reshape(-1, 3), axis=0),
        np.insert(axis.radius, place, radius.ravel()),
        np.insert(axis.spare, place, True),
    )


def tangents(points: Floats, radius: Floats, swing: float) -> tuple[Floats, Floats]:
    """Return the tangents at both ends of every segment.

    Parameters
    ----------
    points : (K, 3) array of float64
    radius : (K,) array of float64
    swing : float
        How far the curve may leave a segment, as a share of its thinner radius.

    Returns
    -------
    start, end : (K - 1, 3) array of float64
        Along the line that halves the bend; along the axis at its foot and tip.
    """
    step = np.diff(points, axis=0)
    chord = np.linalg.norm(step, axis=1)
    along = step / chord[:, None]
    heading = np.concatenate([along[:1], along[:-1] + along[1:], along[-1:]])
    size = np.linalg.norm(heading, axis=1, keepdims=True)
    heading = np.where(size > 1e-6, heading / np.maximum(size, 1e-6), 0.0)
    shorter = np.concatenate([chord[:1], np.minimum(chord[:-1], chord[1:]), chord[-1:]])
    allowed = swing * np.minimum(radius[:-1], radius[1:]) / (2 * SWING)
    reach = []
    for at in (slice(None, -1), slice(1, None)):
        sideways = across(heading[at], step, chord)
        bound = np.where(sideways > 1e-9, allowed / np.maximum(sideways, 1e-9), np.inf)
        reach.append(np.minimum(shorter[at], bound)[:, None] * heading[at])
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
