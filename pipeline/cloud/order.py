"""Canonical order: the same set of points gives the same rows, whatever order they came in."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.model import PointCloud

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

DECIMALS = 11  # what is nearer than this is float rounding


def canonical(cloud: PointCloud) -> PointCloud:
    """Round off float noise and sort the rows by z, then y, then x.

    Points at one place are ordered by their attributes, so that which of them comes first does
    not depend on the rows either.

    Parameters
    ----------
    cloud : PointCloud
        Finite points.
    """
    xyz = np.round(cloud.xyz, DECIMALS) + 0.0  # + 0.0 turns -0.0 into 0.0: the same place, the same bytes
    order = np.lexsort((xyz[:, 0], xyz[:, 1], xyz[:, 2]))
    order = _break_ties(xyz, order, cloud.attributes)
    held = {name: values[order] for name, values in cloud.attributes.items()}
    return PointCloud(xyz[order], cloud.origin, cloud.crs, held, cloud.metadata)


def repeats(xyz: Floats) -> NDArray[np.bool_]:
    """(P,) mask of the rows that lie exactly where the row before them lies; `xyz` is in canonical order."""
    mask = np.zeros(len(xyz), dtype=bool)
    mask[1:] = (xyz[1:] == xyz[:-1]).all(axis=1)
    return mask


def from_corner(xyz: Floats) -> Floats:
    """Coordinates from the lowest corner of the points, so that a grid on them moves with the cloud."""
    return np.asarray(np.round(xyz - xyz.min(axis=0), DECIMALS) + 0.0) if len(xyz) else xyz


def _break_ties(xyz: Floats, order: Ints, attributes: Mapping[str, NDArray[Any]]) -> Ints:
    """Sort the rows that share one place by all their attributes, name by name."""
    later = repeats(xyz[order])
    tied = later.copy()
    tied[:-1] |= later[1:]
    at = np.flatnonzero(tied)
    if not len(at) or not attributes:
        return order
    rows = order[at]
    place = np.cumsum(~later)[at]
    keys = [column for name in sorted(attributes) for column in _columns(attributes[name][rows])]
    order = order.copy()
    order[at] = rows[np.lexsort((*keys[::-1], place))]
    return order


def _columns(values: NDArray[Any]) -> list[NDArray[Any]]:
    return list(values.reshape(len(values), -1).T)
