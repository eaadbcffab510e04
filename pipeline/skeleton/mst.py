"""The papers' skeleton: neighbour graph, minimum spanning tree, centring, Douglas-Peucker."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from pipeline.errors import NotATreeError
from pipeline.geometry.voxels import cell_keys, first_in_cell
from pipeline.model import PointCloud, Skeleton
from pipeline.options import Options
from pipeline.skeleton import graph as graphs
from pipeline.skeleton.centring import Centred, centre
from pipeline.skeleton.pruning import prune
from pipeline.skeleton.rooted import (
    Rooted,
    arrange,
    by_minimum_spanning_tree,
    by_shortest_paths,
    find_root,
    skeleton_of,
)
from pipeline.skeleton.simplification import merge_siblings, simplify

Floats = NDArray[np.float64]
SPARSE_M = 0.07  # spacing beyond which a minimum spanning tree wanders between branches
DELAUNAY_LIMIT = 20_000  # nodes; beyond it qhull is most of the run time


class MstOptions(Options):
    """Options of the minimum-spanning-tree skeleton."""

    graph: Literal["auto", "delaunay", "knn"] = Field(
        "auto", description="neighbour graph: delaunay, knn, or auto (delaunay for small clouds)"
    )
    tree: Literal["auto", "mst", "shortest-path"] = Field(
        "auto",
        description="tree over the graph: mst (minimum spanning tree), shortest-path (from the root), or auto"
        " (shortest paths where the points are sparse)",
    )
    neighbours: int = Field(8, ge=2, le=64, description="neighbours per point in the knn graph")
    resolution_m: float = Field(0.01, gt=0, le=1, description="points are thinned to this spacing, metres")
    centring_rounds: int = Field(2, ge=0, le=10, description="mean-shift steps")
    node_share: float = Field(
        0.5, gt=0, le=2, description="spacing of raw nodes as a share of the local thickness"
    )
    inside: float = Field(
        1.25, ge=0, le=5, description="thicknesses around an axis within which a chain is not a branch"
    )
    protrusion_m: float = Field(
        0.03, ge=0, le=1, description="least length of a branch outside its parent's wood, metres"
    )
    min_support: int = Field(4, ge=1, description="least number of points outside the parent's wood")
    tolerance_share: float = Field(
        0.3, ge=0, le=2, description="Douglas-Peucker tolerance as a share of the local thickness"
    )
    tolerance_m: float = Field(0.005, gt=0, le=1, description="least Douglas-Peucker tolerance, metres")
    sibling_angle_deg: float = Field(
        25.8, ge=0, le=90, description="largest angle between siblings that are merged, degrees"
    )
    sibling_ratio: float = Field(2.0, ge=1, description="largest length ratio of siblings that are merged")
    direction_window_m: float = Field(
        0.2, gt=0, le=5, description="length over which a branch's direction is taken at a fork, metres"
    )


def by_mst(cloud: PointCloud, options: MstOptions) -> Skeleton:
    """Extract a skeleton by a spanning tree over centred points.

    Parameters
    ----------
    cloud : PointCloud
        A cleaned cloud of one tree, in canonical order.
    options : MstOptions

    Returns
    -------
    Skeleton
        Numbered path by path.

    Raises
    ------
    NotATreeError
        If fewer than two nodes remain.

    References
    ----------
    Du, Lindenbergh, Ledoux, Stoter & Nan (2019), "AdTree: accurate, detailed, and automatic
    modelling of laser-scanned trees", Remote Sensing 11(18), 2074. Changed: the graph spans
    centred points, centring has a local bandwidth, the root is voted for, pruning asks what
    stands out of the parent's wood, and simplification is Douglas-Peucker's.
    """
    raw = _grow(cloud.xyz, options)
    tree = prune(
        raw, protrusion_m=options.protrusion_m, inside=options.inside, min_support=options.min_support
    )
    tree = simplify(tree, share=options.tolerance_share, floor_m=options.tolerance_m)
    tree = merge_siblings(
        tree, min_cosine=float(np.cos(np.radians(options.sibling_angle_deg))), max_ratio=options.sibling_ratio
    )
    return skeleton_of(tree, cloud, options.direction_window_m)


def _grow(xyz: Floats, options: MstOptions) -> Rooted:
    """Thin, centre and join the points into a raw rooted tree."""
    thin = xyz[first_in_cell(xyz, options.resolution_m)]
    spacing = max(options.resolution_m, float(np.median(_spacing(thin))))
    centred = centre(thin, spacing_m=spacing, rounds=options.centring_rounds)
    nodes, thickness, support = _condense(centred, options.node_share, spacing)
    if len(nodes) < 2:
        msg = f"the points fall on {len(nodes)} node at a spacing of {spacing:g} m; is the unit metres?"
        raise NotATreeError(msg)
    graph = _graph(nodes, options)
    root = find_root(nodes, thickness, support)
    short = options.tree == "shortest-path" or (options.tree == "auto" and spacing > SPARSE_M)
    walk = by_shortest_paths if short else by_minimum_spanning_tree
    return arrange(*walk(graph, root), nodes, thickness, support)


def _spacing(xyz: Floats) -> Floats:
    """Distance from every point to its nearest neighbour."""
    return np.asarray(cKDTree(xyz).query(xyz, k=min(2, len(xyz)))[0]).reshape(len(xyz), -1)[:, -1]


def _condense(centred: Centred, share: float, spacing: float) -> tuple[Floats, Floats, Floats]:
    """Gather centred points into nodes, as far apart as a share of the local thickness."""
    doubling = np.floor(np.log2(np.maximum(share * centred.thickness / spacing, 1.0)))
    size = spacing * 2.0**doubling
    keys = np.column_stack([doubling.astype(np.int64), cell_keys(centred.xyz, size)])
    _, which = np.unique(keys, axis=0, return_inverse=True)
    which = which.ravel()
    support = np.bincount(which).astype(np.float64)
    mean = [np.bincount(which, values) / support for values in (*centred.xyz.T, centred.thickness)]
    return np.column_stack(mean[:3]), mean[3], support


def _graph(nodes: Floats, options: MstOptions) -> csr_array:
    """Build the chosen neighbour graph; `auto` is Delaunay while qhull is cheap."""
    small = len(nodes) <= DELAUNAY_LIMIT
    if options.graph == "delaunay" or (options.graph == "auto" and small and len(nodes) > 4):
        return graphs.by_delaunay(nodes)
    return graphs.by_neighbours(nodes, options.neighbours)
