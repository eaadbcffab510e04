"""Distances between the barks of two trees."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.accuracy.bark import nearest_bark
from pipeline.geometry.surface import Tubes

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SIDES = 6
"""Sides of the tube around a segment; each makes two triangles."""


def face_centroids(tubes: Tubes) -> tuple[Floats, Ints]:
    """Return points on bark: the centroids of the faces of a six-sided tube around every segment.

    They are moved outwards on to the round tube, so that a tree lies at no distance from itself.

    Parameters
    ----------
    tubes : Tubes

    Returns
    -------
    xyz : (K, 3) array
        Metres.
    segment : (K,) array of int
        The segment that each lies on; those without length have none.
    """
    along = tubes.end - tubes.start
    length = np.linalg.norm(along, axis=1)
    held = np.flatnonzero(length > 0)
    axis = along[held] / length[held, None]
    right = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis), axis=1)])
    right /= np.linalg.norm(right, axis=1)[:, None]
    ahead = np.cross(axis, right)
    share = np.tile([1 / 3, 2 / 3], SIDES)
    turn = 2 * np.pi / SIDES * (np.repeat(np.arange(SIDES), 2) + share)
    taper = (tubes.end_radius - tubes.start_radius)[held]
    radius = tubes.start_radius[held, None] + taper[:, None] * share
    arm = np.cos(turn)[:, None] * right[:, None] + np.sin(turn)[:, None] * ahead[:, None]
    foot = tubes.start[held, None] + share[:, None] * along[held, None]
    return (foot + radius[:, :, None] * arm).reshape(-1, 3), np.repeat(held, 2 * SIDES)


def bark_distances(a: Tubes | None, b: Tubes | None) -> tuple[Floats, Ints]:
    """Return how far the faces of A lie from the bark of B.

    Parameters
    ----------
    a, b : Tubes or None
        None where radii are not known: there are no distances then.

    Returns
    -------
    distance : (K,) array
        Metres, >= 0.
    segment : (K,) array of int
        The segment of A that each belongs to.
    """
    if a is None or b is None:
        return np.zeros(0), np.zeros(0, dtype=np.int64)
    points, segment = face_centroids(a)
    return np.abs(nearest_bark(points, b).surface), segment


def mean_by_segment(distance: Floats, segment: Ints, count: int) -> Floats:
    """(M,) mean distance of every segment; NaN where it has none."""
    held = np.bincount(segment, minlength=count)
    total = np.bincount(segment, weights=distance, minlength=count)
    mean = np.full(count, np.nan)
    mean[held > 0] = total[held > 0] / held[held > 0]
    return mean
