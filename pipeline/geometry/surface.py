"""Distances from points to the surface of tapered tubes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.geometry.compiled import compiled
from pipeline.geometry.voxels import cells_with_means

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

STEP_M = 0.04  # a segment is looked up by marks that are at most this far apart
CELL_M = 0.05  # the points of one cell are looked up together: three times as quick
# A thick stem's axis is far from its own bark, so thick segments are looked up apart as well.
TIERS = ((0.0, 14), (0.03, 8), (0.10, 5))


@dataclass(frozen=True, eq=False)
class Tubes:
    """Tapered tube segments.

    Parameters
    ----------
    start, end : (M, 3) arrays
        Ends of each segment's axis, in metres.
    start_radius, end_radius : (M,) arrays
        Radii at the ends, in metres.
    """

    start: Floats
    end: Floats
    start_radius: Floats
    end_radius: Floats


@dataclass(frozen=True, eq=False)
class Nearest:
    """For every point, the segment whose surface is nearest.

    Parameters
    ----------
    segment : (P,) array of int
    share : (P,) array
        Where along the segment the point's foot lies, 0 at its start and 1 at its end.
    axial : (P,) array
        Distance to the axis, in metres.
    surface : (P,) array
        Distance to the axis less the radius there, in metres; negative inside.
    """

    segment: Ints
    share: Floats
    axial: Floats
    surface: Floats


def nearest_tube(xyz: Floats, tubes: Tubes) -> Nearest:
    """Find the nearest tube surface to every point.

    Parameters
    ----------
    xyz : (P, 3) array
        Points in metres.
    tubes : Tubes
    """
    marks, owner = _marks(tubes)
    radius = np.maximum(tubes.start_radius, tubes.end_radius)[owner]
    cell, middle = cells_with_means(xyz, CELL_M)
    segment = np.full(len(xyz), -1, dtype=np.int64)
    share, axial, surface = np.zeros(len(xyz)), np.zeros(len(xyz)), np.full(len(xyz), np.inf)
    out = (segment, share, axial, surface)
    ends = (tubes.start, tubes.end, tubes.start_radius, tubes.end_radius)
    for least, count in TIERS:
        thick = np.flatnonzero(radius >= least)
        if len(thick):
            near = cKDTree(marks[thick]).query(middle, k=min(count, len(thick)))[1].reshape(len(middle), -1)
            _take_nearest(xyz, cell, np.sort(owner[thick[near]], axis=1), ends, out)
    return Nearest(*out)


def _marks(tubes: Tubes) -> tuple[Floats, Ints]:
    """Points along every axis, at most `STEP_M` apart, and the segment each belongs to."""
    along = tubes.end - tubes.start
    count = np.maximum(1, np.ceil(np.linalg.norm(along, axis=1) / STEP_M)).astype(np.int64)
    owner = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    share = (number + 0.5) / count[owner]
    return tubes.start[owner] + along[owner] * share[:, None], owner


@compiled
def _take_nearest(
    xyz: Floats,
    cell: Ints,
    candidates: Ints,
    ends: tuple[Floats, Floats, Floats, Floats],
    out: tuple[Ints, Floats, Floats, Floats],
) -> None:
    """Improve `out` by the candidate segments of each point's cell; ties fall to the smaller segment."""
    start, end, start_radius, end_radius = ends
    segment, share, axial, surface = out
    for i in range(len(xyz)):
        last = -1
        for c in candidates[cell[i]]:
            if c == last:
                continue
            last = c
            square, dot = 0.0, 0.0
            for d in range(3):
                along = end[c, d] - start[c, d]
                square += along * along
                dot += along * (xyz[i, d] - start[c, d])
            t = min(max(dot / square, 0.0), 1.0) if square > 0.0 else 0.0
            away = 0.0
            for d in range(3):
                away += (xyz[i, d] - start[c, d] - t * (end[c, d] - start[c, d])) ** 2
            away = np.sqrt(away)
            off = away - (start_radius[c] + t * (end_radius[c] - start_radius[c]))
            nearer = abs(off) < abs(surface[i])
            if nearer or (abs(off) == abs(surface[i]) and c < segment[i]):
                segment[i], share[i], axial[i], surface[i] = c, t, away, off
