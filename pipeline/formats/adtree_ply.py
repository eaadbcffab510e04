"""Skeletons as AdTree saves them in PLY, read only: nodes with a radius, edges as lists of two nodes.

AdTree saves every smoothed branch by itself: where a branch begins on another, two nodes share a place.
They become one here, with the larger radius.

References
----------
Du, S., Lindenbergh, R., Ledoux, H., Stoter, J. and Nan, L. (2019). AdTree: accurate, detailed, and
automatic modelling of laser-scanned trees. Remote Sensing 11(18). https://github.com/tudelft3d/AdTree
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from pipeline.errors import InputFormatError, ModelError
from pipeline.formats.lines import FAR
from pipeline.formats.nodes import Nodes, untold
from pipeline.formats.ply import Element, Ply, open_ply
from pipeline.geometry.numbering import from_edges
from pipeline.model import Floats, Skeleton, TreeModel

SAME_M = 1e-4
"""Nodes closer than this are one: AdTree computes in single precision."""

KIND = "the _skeleton.ply of AdTree"


def read(path: str | os.PathLike[str]) -> TreeModel | Skeleton:
    """Read a tree; a skeleton where the nodes have no radius.

    Nodes are numbered path by path, on along the child that carries the most length. The root is the
    first node to which no edge leads.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    TreeModel or Skeleton
        Its origin is the lowest corner of the nodes in whole metres.

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If it is no such file, or its edges make no tree.
    """
    ply = open_ply(path)
    world, radius = _nodes(ply)
    edges = _edges(ply)
    try:
        wrong = np.flatnonzero(((edges < 0) | (edges >= len(world))).any(axis=1))
        if len(wrong):
            msg = f"edge {wrong[0]} names a node that is not there, nodes run from 0 to {len(world) - 1}"
            raise ModelError(msg)
        world, radius, edges = _welded(world, radius, edges)
        node, parent = from_edges(world, edges)
    except ModelError as error:
        msg = f"{path}: {error}; save the skeleton anew (AdTree -s)"
        raise InputFormatError(msg) from error
    origin = np.asarray(np.floor(world.min(axis=0)))
    skeleton = Nodes(world[node], parent.astype(np.int64), origin=origin, keep=True).skeleton()
    return skeleton if radius is None else untold(skeleton, radius[node])


def _nodes(ply: Ply) -> tuple[Floats, Floats | None]:
    """Return the places and radii of the nodes, checked."""
    element = ply.element("vertex")
    names = {p.name for p in element.properties} if element else set()
    if element is None or not {"x", "y", "z"} <= names:
        msg = f"{ply.path}: has no nodes with x, y and z; give {KIND}"
        raise InputFormatError(msg)
    columns = ply.columns("vertex")
    with np.errstate(invalid="ignore"):  # NaN in single precision may be one that signals
        table = np.column_stack([columns[name] for name in ("x", "y", "z")]).astype(np.float64)
        radius = columns["radius"].astype(np.float64) if "radius" in columns else None
    for name, values in (("a coordinate", table), ("a radius", radius)):
        if values is not None and not (np.abs(values) < FAR).all():
            wrong = np.argwhere(~(np.abs(values) < FAR))[0][0]
            msg = f"{ply.path}: node {wrong} has {name} that is not finite; mend it"
            raise InputFormatError(msg)
    if radius is not None and (radius < 0).any():
        msg = f"{ply.path}: node {int(np.argmin(radius))} has a negative radius; mend it"
        raise InputFormatError(msg)
    return table, radius


def _edges(ply: Ply) -> NDArray[np.int64]:
    """Return the two nodes of every edge, from lists or from two columns."""
    edge = ply.element("edge")
    if edge is None:
        msg = f"{ply.path}: has no edges, it is a cloud or a mesh; give {KIND}"
        raise InputFormatError(msg)
    if not edge.has_lists:
        columns = list(ply.columns("edge").values())[:2]
        if len(columns) < 2:
            msg = f"{ply.path}: its edges name fewer than two nodes; give {KIND}"
            raise InputFormatError(msg)
        return _whole(ply, np.column_stack(columns))
    return _pairs(ply, edge)


def _whole(ply: Ply, pairs: NDArray[Any]) -> NDArray[np.int64]:
    """Return the two nodes of every edge as whole numbers."""
    with np.errstate(invalid="ignore"):
        numbers = pairs.astype(np.float64)
        wrong = np.flatnonzero(~((numbers == np.rint(numbers)) & (np.abs(numbers) < FAR)).all(axis=1))
    if len(wrong):
        msg = (
            f"{ply.path}: edge {wrong[0]} names a node by something that is not a whole number; save it anew"
        )
        raise InputFormatError(msg)
    return numbers.astype(np.int64)


def _pairs(ply: Ply, edge: Element) -> NDArray[np.int64]:
    """Return the lists of two of an element, which must be its first column."""
    first, *others = edge.properties
    if first.length is None or any(p.length for p in others) or first.kind[0] not in "iu":
        msg = f"{ply.path}: its edges hold other than a list of two nodes; give {KIND}"
        raise InputFormatError(msg)
    place = _before(ply, edge)
    kinds = [("size", first.length), ("a", first.kind), ("b", first.kind)]
    kinds += [(f"{k} {p.name}", p.kind) for k, p in enumerate(others)]
    try:
        if ply.order:
            dtype = np.dtype([(name, ply.order + kind) for name, kind in kinds])
            rows = np.frombuffer(ply.body, dtype, edge.count, place)
            size, pairs = rows["size"], np.column_stack([rows["a"], rows["b"]])
        else:
            tokens = ply.body.split()[place : place + edge.count * len(kinds)]
            table = np.array(tokens, dtype=np.float64).reshape(edge.count, len(kinds))
            size, pairs = table[:, 0], table[:, 1:3]
    except ValueError as error:
        msg = f"{ply.path}: ends within its {edge.count} edges, or an edge is no list of two; save it anew"
        raise InputFormatError(msg) from error
    if (size != 2).any():
        msg = f"{ply.path}: edge {int(np.argmax(size != 2))} does not join two nodes; save it anew"
        raise InputFormatError(msg)
    return _whole(ply, pairs)


def _before(ply: Ply, edge: Element) -> int:
    """Return where the edges begin: bytes, or words in a text file."""
    place = 0
    for element in ply.elements[: ply.elements.index(edge)]:
        if element.has_lists:
            msg = f"{ply.path}: its element {element.name} before the edges has lists; give {KIND}"
            raise InputFormatError(msg)
        place += element.count * (element.dtype("<").itemsize if ply.order else len(element.properties))
    return place


def _welded(
    world: Floats, radius: Floats | None, edges: NDArray[np.int64]
) -> tuple[Floats, Floats | None, NDArray[np.int64]]:
    """Make nodes at the same place one, with the largest radius; edges that vanish go."""
    pairs = cKDTree(world).query_pairs(SAME_M, output_type="ndarray") if len(world) else np.empty((0, 2), int)
    count = len(world)
    graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    _, group = connected_components(graph, directed=False) if count else (0, np.empty(0, int))
    first, new = np.unique(group, return_index=True)[1], group
    order = np.argsort(first)
    rank = np.empty(len(first), dtype=np.int64)
    rank[order] = np.arange(len(first))
    new = rank[new]
    largest = None
    if radius is not None:
        largest = np.zeros(len(first))
        np.maximum.at(largest, new, radius)
    joined = new[edges]
    return world[first[order]], largest, joined[joined[:, 0] != joined[:, 1]]
