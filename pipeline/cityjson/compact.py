"""The compact profile: axes as lines, radii in a few classes, as trees were stored in 2021.

The nodes are the vertices. Lines follow the numbers of the nodes and break where the next node is no
child of the one before, or where its radius falls into another class; so the order in which nodes
first appear is their number. Standard readers draw the lines only.

References
----------
The form goes back to the semi-explicit storage of tree models in CityJSON of the L-system study of
2021 (section 3.4): a MultiLineString whose semantics hold ten classes of radius.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.cityjson.attributes import describe
from pipeline.cityjson.grid import Whole, merged, steps
from pipeline.cityjson.options import CityjsonOptions
from pipeline.model import RADIUS_SOURCES, Floats, TreeModel

LOD = "2"


def compact_object(
    tree: TreeModel, options: CityjsonOptions, translate: Floats
) -> tuple[dict[str, Any], Whole]:
    """Make the city object of a tree in the compact profile.

    Parameters
    ----------
    tree : TreeModel
    options : CityjsonOptions
        `node_step_m` and `radius_classes`.
    translate : (3,) array of float64
        World coordinates of the vertices' zero.

    Returns
    -------
    thing : dict
        A ``SolitaryVegetationObject`` with one ``MultiLineString``.
    vertices : (V, 3) array of int64
        Steps of `node_step_m` from `translate`; one a node, save where two nodes coincide.
    """
    skeleton = tree.skeleton
    points = steps(skeleton.xyz, skeleton.origin, translate, options.node_step_m)
    vertices, vertex = merged(points)
    surfaces, of_node = radius_classes(tree, options.radius_classes)
    lines, nodes = _lines(tree, of_node)
    axes: dict[str, Any] = {"root": int(of_node[0])}
    feet = unclear_feet(lines, vertex)
    if feet:
        axes["feet"] = feet
    shape = {
        "type": "MultiLineString",
        "lod": LOD,
        "boundaries": [vertex[line].tolist() for line in lines],
        "semantics": {"surfaces": surfaces, "values": of_node[nodes].tolist()},
    }
    attributes = describe(tree) | {"+treeskel-axes": axes}
    return {"type": "SolitaryVegetationObject", "attributes": attributes, "geometry": [shape]}, vertices


def radius_classes(tree: TreeModel, count: int) -> tuple[list[dict[str, Any]], NDArray[np.int64]]:
    """Sort the radii into classes, evenly from the thinnest (a tip) to the thickest (the trunk).

    Parameters
    ----------
    tree : TreeModel
    count : int
        Classes, >= 2; the first and the last are the extremes themselves.

    Returns
    -------
    surfaces : list of dict
        A ``+RadiusClass`` for every class and source of radius that occurs.
    number : (N,) array of int64
        The surface of each node. Its radius is off by at most half the step between classes.
    """
    low, high = float(tree.radius.min()), float(tree.radius.max())
    step = (high - low) / (count - 1)
    rank = (
        np.rint((tree.radius - low) / step).astype(np.int64) if step else np.zeros(len(tree), dtype=np.int64)
    )
    key, number = np.unique(rank * len(RADIUS_SOURCES) + tree.radius_source, return_inverse=True)
    classes, source = np.divmod(key, len(RADIUS_SOURCES))
    surfaces = [
        {"type": "+RadiusClass", "radius": radius, "radiusSource": origin}
        for radius, origin in zip((low + classes * step).tolist(), source.tolist(), strict=True)
    ]
    return surfaces, number.astype(np.int64)


def _lines(tree: TreeModel, of_node: NDArray[np.int64]) -> tuple[list[NDArray[np.int64]], NDArray[np.int64]]:
    """Return the nodes of every line, its foot first, and for every line a node of its class."""
    parent = tree.skeleton.parent.astype(np.int64)
    if len(parent) == 1:
        return [np.zeros(1, dtype=np.int64)], np.zeros(1, dtype=np.int64)
    node = np.arange(1, len(parent))
    new = (parent[1:] != node - 1) | (of_node[1:] != of_node[:-1])
    new[0] = True
    runs = np.split(node, np.flatnonzero(new)[1:])
    return [np.concatenate([parent[run[:1]], run]) for run in runs], node[new]


def unclear_feet(lines: list[NDArray[np.int64]], vertex: NDArray[np.int64]) -> list[list[int]]:
    """Return [line, node] where a reader would take another node for the foot of the line.

    A reader takes the node before, if it has the line's first vertex, else the first node that has it.
    """
    first = np.full(int(vertex.max()) + 1, len(vertex))
    np.minimum.at(first, vertex, np.arange(len(vertex)))
    unclear = []
    for number, line in enumerate(lines):
        foot, here = int(line[0]), int(vertex[line[0]])
        before = int(line[1]) - 1 if len(line) > 1 else 0
        taken = before if vertex[before] == here else int(first[here])
        if taken != foot:
            unclear.append([number, foot])
    return unclear
