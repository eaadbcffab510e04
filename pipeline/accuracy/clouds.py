"""A model beside the points it was made from: what each leaves out of the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from pipeline.accuracy.placing import NotComparableError
from pipeline.accuracy.wood import Wood
from pipeline.cloud.local import usable
from pipeline.geometry.surface import Nearest, Tubes
from pipeline.model import PointCloud

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

NOT_TREE = (2, 7, 9, 18)
"""ASPRS classes that are no part of a tree: ground, noise, water, high noise."""

NEAR_M = 0.05
"""Points this near to the bark are explained by it."""

CLUMP_M = 0.10
"""Unexplained points in cells of this size that touch are one clump."""

MOST_CLUMPS = 10


@dataclass(frozen=True)
class Clump:
    """Points that no bark explains: how many, and their middle in metres."""

    points: int
    x: float
    y: float
    z: float


@dataclass(frozen=True)
class Unexplained:
    """Points farther than 5 cm from any bark, and where most of them are.

    Parameters
    ----------
    points : int
    share : float
        Of all points.
    clumps : tuple of Clump
        The ten largest.
    """

    points: int
    share: float
    clumps: tuple[Clump, ...]


@dataclass(frozen=True)
class Unsupported:
    """Wood without points: the nearest is more than 5 cm off the bark.

    Parameters
    ----------
    length_m, share : float
        Of the axes.
    branches : int
        Branches of which more than half the axis has no points.
    """

    length_m: float
    share: float
    branches: int


def points_of_tree(cloud: PointCloud) -> Floats:
    """(P, 3) points that are neither ground, water nor noise, in the cloud's reference system.

    Raises
    ------
    NotComparableError
        If there is none.
    """
    kept = usable(cloud.xyz)
    if "classification" in cloud.attributes:
        kept &= ~np.isin(cloud.attributes["classification"], NOT_TREE)
    if not kept.any():
        msg = "the cloud is empty: all its points are ground, water or noise; give the cloud of the tree"
        raise NotComparableError(msg)
    points = cloud.world[kept]
    return np.asarray(points[np.lexsort(points.T)])  # sums do not depend on the order of rows


def unexplained(points: Floats, nearest: Nearest, base: Floats) -> Unexplained:
    """Return the points that no bark explains.

    Parameters
    ----------
    points : (P, 3) array
    nearest : Nearest
        The nearest bark to each of them.
    base : (3,) array
        Added to the places that are returned.
    """
    lost = points[np.abs(nearest.surface) >= NEAR_M]
    if not len(lost):
        return Unexplained(0, 0.0, ())
    grid, cell = np.unique(np.floor(lost / CLUMP_M), axis=0, return_inverse=True)
    count = len(grid)
    pair = cKDTree(grid).query_pairs(1.8, output_type="ndarray")  # cells that share a face, edge or corner
    links = coo_matrix((np.ones(len(pair)), (pair[:, 0], pair[:, 1])), shape=(count, count))
    clump = connected_components(links, directed=False)[1][cell]
    size = np.bincount(clump)
    middle = np.column_stack([np.bincount(clump, lost[:, d]) / size + base[d] for d in range(3)])
    largest = np.argsort(-size, kind="stable")[:MOST_CLUMPS]
    clumps = tuple(Clump(int(size[k]), *middle[k].tolist()) for k in largest)
    return Unexplained(len(lost), len(lost) / len(points), clumps)


def unsupported(wood: Wood, tubes: Tubes, points: Floats) -> tuple[Unsupported, Flags]:
    """Return the wood that no point supports, and which segments are mostly such.

    Parameters
    ----------
    wood : Wood
    tubes : Tubes
        Its bark.
    points : (P, 3) array

    Returns
    -------
    Unsupported
    bare : (M,) array of bool
    """
    marks = wood.marks
    taper = (tubes.end_radius - tubes.start_radius)[marks.segment]
    radius = tubes.start_radius[marks.segment] + marks.share * taper
    without = cKDTree(points).query(marks.xyz)[0] >= radius + NEAR_M
    held = np.bincount(marks.segment, minlength=len(wood))
    share = np.bincount(marks.segment, weights=without, minlength=len(wood)) / held
    length = share * wood.length
    total = np.bincount(wood.branch, wood.length)
    lost = np.bincount(wood.branch, length)
    branches = int(((lost > total / 2) & (total > 0)).sum())
    amount = float(length.sum())
    return Unsupported(amount, amount / float(wood.length.sum()), branches), share > 0.5
