"""Neighbour graphs over points: Delaunay, or k nearest with the bridges that join its parts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import Delaunay, QhullError, cKDTree

from pipeline.errors import NotATreeError
from pipeline.geometry.spanning import distinct_edges, euclidean_tree

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def by_delaunay(xyz: Floats) -> csr_array:
    """Edges of the Delaunay tetrahedra, as a symmetric sparse matrix of lengths in metres.

    Raises
    ------
    NotATreeError
        If the points lie in one plane, where no tetrahedra exist.

    References
    ----------
    Du et al. (2019), "AdTree", section 2.1.
    """
    try:
        corners = Delaunay(xyz, qhull_options="Qbb Qc Qz Q12").simplices
    except QhullError as error:
        msg = f"no Delaunay graph over {len(xyz)} points (are they in one plane?); use skeleton.graph = knn"
        raise NotATreeError(msg) from error
    sides = [corners[:, [i, j]] for i in range(4) for j in range(i + 1, 4)]
    return _matrix(xyz, np.vstack(sides).astype(np.int64))


def by_neighbours(xyz: Floats, neighbours: int) -> csr_array:
    """The k nearest neighbours of every point, and the bridges that join what they leave apart.

    The bridges are the edges of the Euclidean minimum spanning tree, so the minimum spanning tree
    of this graph equals that of the Delaunay graph (ties aside), whatever `neighbours` is.

    Parameters
    ----------
    xyz : (P, 3) array
        Points in metres.
    neighbours : int
        How many neighbours each point is joined to.
    """
    count = min(neighbours + 1, len(xyz))
    near = cKDTree(xyz).query(xyz, k=count)[1].reshape(len(xyz), -1)[:, 1:]
    pairs = np.column_stack([np.repeat(np.arange(len(xyz)), near.shape[1]), near.ravel()])
    return _matrix(xyz, np.vstack([pairs, euclidean_tree(xyz)[0]]))


def _matrix(xyz: Floats, pairs: Ints) -> csr_array:
    """Symmetric matrix of the edge lengths of `pairs`, each once; equal points stay joined."""
    a, b = distinct_edges(pairs, len(xyz)).T
    length = np.maximum(np.linalg.norm(xyz[a] - xyz[b], axis=1), 1e-9)
    both = (np.concatenate([a, b]), np.concatenate([b, a]))
    return csr_array((np.concatenate([length, length]), both), shape=(len(xyz), len(xyz)))
