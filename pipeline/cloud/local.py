"""The local origin: whole metres below the points, so that float64 keeps every digit."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Floats, PointCloud

FARTHEST_M = 1e8
"""No reference system on Earth counts farther; what lies beyond is a filler such as 1e38."""


def usable(xyz: Floats) -> NDArray[np.bool_]:
    """Return for each point of an (P, 3) array whether its coordinates are finite and plausible."""
    with np.errstate(invalid="ignore"):
        return np.asarray((np.abs(xyz) < FARTHEST_M).all(axis=1))


def whole_metres_below(xyz: Floats) -> Floats:
    """Return the minimum of the usable points rounded down to whole metres; zero if there are none.

    A minimum does not depend on the order of the rows, and whole metres leave the decimals of
    every coordinate as they stand in the file.

    Parameters
    ----------
    xyz : (P, 3) array of float64
        Coordinates in metres.
    """
    good = usable(xyz)
    if not good.any():
        return np.zeros(3)
    return np.asarray(np.floor(np.min(xyz, axis=0, where=good[:, None], initial=FARTHEST_M)))


def localise(world: Floats, attributes: dict[str, NDArray[np.generic]] | None = None) -> PointCloud:
    """Make a cloud of (P, 3) coordinates in their own reference system, relative to a local origin."""
    origin = whole_metres_below(world)
    return PointCloud(world - origin, origin, attributes=attributes or {})
