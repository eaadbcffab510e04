"""A tree as a CityJSON 2.0 document, in one of three profiles."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.cityjson.attributes import describe
from pipeline.cityjson.compact import compact_object
from pipeline.cityjson.extension import declaration, write_beside
from pipeline.cityjson.geometry import Drawing, draw
from pipeline.cityjson.graph import encode_graph
from pipeline.cityjson.grid import Whole
from pipeline.cityjson.options import CityjsonOptions
from pipeline.errors import UsageError
from pipeline.model import Floats, TreeModel
from pipeline.output import write_text


@dataclass(frozen=True, eq=False)
class Objects:
    """City objects of one tree and the vertices they name.

    Parameters
    ----------
    members : dict
        What stands under ``CityObjects``, the tree first.
    vertices : (V, 3) array of int64
        Steps of `step` from `translate`.
    step : float
        Metres.
    translate : (3,) array of float64
        World coordinates of the vertices' zero.
    """

    members: dict[str, Any]
    vertices: Whole
    step: float
    translate: Floats


def to_cityjson(tree: TreeModel, *, name: str, options: CityjsonOptions | None = None) -> dict[str, Any]:
    """Make a CityJSON 2.0 document of one tree.

    Parameters
    ----------
    tree : TreeModel
        Its metadata may hold ``species``, ``ground_z``, ``top_z`` and ``crown_area_m2``.
    name : str
        The identifier of the city object.
    options : CityjsonOptions, optional
        Its `profile` decides what is written; the default needs no extension.

    Returns
    -------
    dict
        One ``SolitaryVegetationObject`` whose geometry is a list of ``Solid``s, one closed tube per
        branch, and whose attribute ``skeleton`` holds the tree without loss (`from_cityjson`). The
        compact profile has axes and classes of radius instead.

    Raises
    ------
    UsageError
        If the name is empty.

    References
    ----------
    CityJSON Specifications 2.0.1, https://www.cityjson.org/specs/2.0.1/
    """
    options = options or CityjsonOptions()
    made = city_objects(tree, name, options)
    document = header(tree.skeleton.crs, options, made.step, made.translate)
    document["metadata"]["geographicalExtent"] = extent(tree, made)
    return document | {"CityObjects": made.members, "vertices": made.vertices.tolist()}


def header(crs: str | None, options: CityjsonOptions, step: float, translate: Floats) -> dict[str, Any]:
    """Return what stands before the city objects.

    Parameters
    ----------
    crs : str or None
    options : CityjsonOptions
    step : float
        Of the vertices, metres.
    translate : (3,) array of float64

    Returns
    -------
    dict
        Type, version, metadata (empty where the reference system is unknown), transform, and the
        extension where the profile needs it.
    """
    reference = crs_url(crs)
    metadata: dict[str, Any] = {"referenceSystem": reference} if reference else {}
    zero = [int(v) if v == int(v) else v for v in translate.tolist()]
    document: dict[str, Any] = {
        "type": "CityJSON",
        "version": "2.0",
        "metadata": metadata,
        "transform": {"scale": [step] * 3, "translate": zero},
    }
    return document if options.profile == "default" else document | declaration(options)


def city_objects(
    tree: TreeModel, name: str, options: CityjsonOptions, translate: Floats | None = None
) -> Objects:
    """Make the city objects of one tree.

    Parameters
    ----------
    tree : TreeModel
    name : str
    options : CityjsonOptions
    translate : (3,) array of float64, optional
        World coordinates of the vertices' zero; where none is given, one near the tree.

    Returns
    -------
    Objects

    Raises
    ------
    UsageError
        If the name is empty.
    """
    if not name:
        msg = "a city object needs a name; give the name of the tree or of its file"
        raise UsageError(msg)
    if options.profile == "compact":
        translate = tree.skeleton.origin if translate is None else translate
        members, vertices = compact_object(tree, options, translate)
        return Objects({name: members}, vertices, options.node_step_m, translate)
    lines = options.skeleton_object or options.profile == "extension"
    drawing = draw(tree, options, translate=translate, lines=lines)
    members = {name: _tree_object(tree, drawing, options)}
    if lines:
        members[name]["children"] = [f"{name}-skeleton"]
        members[f"{name}-skeleton"] = _skeleton_object(tree, name, drawing, options)
    return Objects(members, drawing.vertices, options.vertex_step_m, drawing.translate)


def extent(tree: TreeModel, made: Objects) -> list[float]:
    """Return the least and the greatest world coordinates: of the vertices, else of the nodes."""
    steps = made.vertices
    corners = steps * made.step + made.translate if len(steps) else tree.skeleton.world
    return [round(float(v), 4) for v in (*corners.min(axis=0), *corners.max(axis=0))]


def write_cityjson(document: Mapping[str, Any], path: str | os.PathLike[str]) -> None:
    """Write a document as compact JSON, whole or not at all; beside it the extension, where it says so.

    Parameters
    ----------
    document : mapping
    path : path-like

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    write_text(path, as_line(document))
    write_beside(document, Path(path).parent)


def as_line(document: Mapping[str, Any]) -> str:
    """Return a document as one line of JSON."""
    return json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False) + "\n"


def crs_url(crs: str | None) -> str | None:
    """Return the OGC address of ``"EPSG:28992"`` and the like; None where there is no such code.

    Examples
    --------
    >>> crs_url("EPSG:28992")
    'https://www.opengis.net/def/crs/EPSG/0/28992'
    """
    match = re.fullmatch(r"\s*([A-Za-z]+):+(\w+)\s*", crs or "")
    return f"https://www.opengis.net/def/crs/{match[1].upper()}/0/{match[2]}" if match else None


def _tree_object(tree: TreeModel, drawing: Drawing, options: CityjsonOptions) -> dict[str, Any]:
    attributes = describe(tree)
    extended = options.profile == "extension"
    if options.skeleton:
        attributes["+treeskel-graph" if extended else "skeleton"] = encode_graph(tree, options)
    geometry: list[dict[str, Any]] = []
    first = [int(path[-1]) for path in tree.skeleton.paths]  # any node that lies on the branch itself
    for lod, branch, faces in drawing.shells:
        solid: dict[str, Any] = {"type": "Solid", "lod": lod, "boundaries": [_surfaces(faces)]}
        if extended and branch >= 0:
            order = int(tree.skeleton.order[first[branch]])
            wood = {"type": "+WoodSurface", "branch": branch, "order": order}
            solid["semantics"] = {"surfaces": [wood], "values": [[0] * len(faces)]}
        geometry.append(solid)
    return {"type": "SolitaryVegetationObject", "attributes": attributes, "geometry": geometry}


def _surfaces(faces: Whole) -> list[list[list[int]]]:
    """Nest triangles as surfaces of one ring, a little faster than by `tolist`."""
    return [[[a, b, c]] for a, b, c in zip(*faces.T.tolist(), strict=True)]


def _skeleton_object(
    tree: TreeModel, name: str, drawing: Drawing, options: CityjsonOptions
) -> dict[str, Any]:
    """Return the axes: one line per branch from its foot, and as many radii, the first its own."""
    step = options.radius_step_m
    radii = [tree.radius[path] for path in tree.skeleton.paths]
    for radius, path in zip(radii, tree.skeleton.paths, strict=True):
        radius[:1] = tree.start_radius[path[:2][-1]]
    attributes: dict[str, Any] = {
        "tree": name,
        "radiusScale": step,
        "radii": [np.rint(radius / step).astype(np.int64).tolist() for radius in radii],
    }
    if not drawing.lines_tell_nodes:
        attributes["nodes"] = [path.tolist() for path in tree.skeleton.paths]
    lines = [line.tolist() for line in drawing.lines]
    return {
        "type": "+TreeSkeleton" if options.profile == "extension" else "GenericCityObject",
        "parents": [name],
        "attributes": attributes,
        "geometry": [{"type": "MultiLineString", "lod": "0", "boundaries": lines}],
    }
