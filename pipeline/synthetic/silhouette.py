"""Which directions of a scanner's grid can hit anything: nine in ten beams at a bare tree cannot."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Floats, Ints


class Grid(NamedTuple):
    """Directions of a scanner: azimuth and elevation in steps.

    Attributes
    ----------
    step : float
        Radians.
    phase : (2,) array of float64
        Azimuth (from `ahead`) and elevation of direction (0, 0), in steps.
    ahead : float
        Azimuth of the tree, radians; the grid ends behind the scanner.
    """

    step: float
    phase: Floats
    ahead: float

    def directions(self, cells: NDArray[np.int64]) -> Floats:
        """Return the (D, 3) unit vectors of (D, 2) numbered directions."""
        azimuth, elevation = ((cells + self.phase) * self.step).T
        azimuth = azimuth + self.ahead
        level = np.cos(elevation)
        return np.column_stack([level * np.cos(azimuth), level * np.sin(azimuth), np.sin(elevation)])


def cells_towards(corners: Floats, faces: Ints, grid: Grid, beam: tuple[float, float]) -> NDArray[np.int64]:
    """Return the directions that pass through the box around any triangle.

    Parameters
    ----------
    corners : (V, 3) array of float64
        Metres from the scanner.
    faces : (F, 3) array of int32
    grid : Grid
    beam : pair of float
        Aperture in metres and divergence in radians: how far beside its direction a beam can hit.

    Returns
    -------
    (D, 2) array of int64
        By azimuth, then elevation; each once.
    """
    low, high = _boxes(corners, faces, grid.ahead, beam)
    first = np.ceil(low / grid.step - grid.phase).astype(np.int64)
    last = np.floor(high / grid.step - grid.phase).astype(np.int64)
    around = np.array([[np.pi, np.pi / 2]])
    first = np.maximum(first, np.ceil(-around / grid.step - grid.phase).astype(np.int64))
    last = np.minimum(last, np.ceil(around / grid.step - grid.phase).astype(np.int64) - 1)
    seen = (first <= last).all(axis=1)
    first, last = first[seen], last[seen]
    if not len(first):
        return np.zeros((0, 2), dtype=np.int64)
    corner = first.min(axis=0)
    return np.asarray(np.argwhere(_covered(first - corner, last - corner)) + corner)


def _boxes(corners: Floats, faces: Ints, ahead: float, beam: tuple[float, float]) -> tuple[Floats, Floats]:
    """Return the least and the greatest azimuth and elevation of every triangle, with the beam's width."""
    level = np.hypot(corners[:, 0], corners[:, 1])
    turned = np.arctan2(corners[:, 1], corners[:, 0]) - ahead
    azimuth = ((turned + np.pi) % (2 * np.pi) - np.pi)[faces]
    elevation = np.arctan2(corners[:, 2], level)[faces]
    left, right = azimuth.min(axis=1), azimuth.max(axis=1)
    half = np.minimum((right - left) / 2, 1.5)
    # An edge between two corners of one elevation rises above both: along it tan(e) goes with 1 / cos.
    low, high = (
        np.where(e * side > 0, np.arctan(np.tan(e) / np.cos(half)), e)
        for e, side in ((elevation.min(axis=1), -1), (elevation.max(axis=1), 1))
    )
    distance = np.maximum(np.linalg.norm(corners, axis=1)[faces].min(axis=1), 1e-3)
    wide = beam[0] / 2 / distance + beam[1] / 2 + 1e-9
    low, high = low - wide, high + wide
    steepest = np.maximum(np.abs(low), np.abs(high))
    sideways = wide / np.maximum(np.cos(np.minimum(steepest, np.pi / 2)), 1e-6)
    left, right = left - sideways, right + sideways
    turns = (left < -np.pi) | (right > np.pi) | (right - left > np.pi)
    # Behind the scanner, or around its zenith or nadir: the box goes all the way round.
    low, high = np.where(turns & (low < 0), -np.pi / 2, low), np.where(turns & (high > 0), np.pi / 2, high)
    left, right = np.where(turns, -np.pi, left), np.where(turns, np.pi, right)
    return np.column_stack([left, low]), np.column_stack([right, high])


def _covered(first: NDArray[np.int64], last: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return the cells of the grid that lie in any box of cells."""
    rows, columns = last.max(axis=0) + 2
    count = np.zeros((rows, columns), dtype=np.int32)
    (top, left), (bottom, right) = first.T, last.T + 1
    for row, column, add in ((top, left, 1), (top, right, -1), (bottom, left, -1), (bottom, right, 1)):
        np.add.at(count, (row, column), add)
    return np.asarray(count.cumsum(axis=0).cumsum(axis=1) > 0)
