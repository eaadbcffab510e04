"""A tree as a CityJSON 2.0 document that validates and opens everywhere: no extension, only solids."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from pipeline.cityjson.geometry import solids
from pipeline.cityjson.graph import encode_graph
from pipeline.cityjson.options import CityjsonOptions
from pipeline.errors import UsageError
from pipeline.model import TreeModel
from pipeline.output import write_text

BREAST_HEIGHT_M = 1.3


def to_cityjson(tree: TreeModel, *, name: str, options: CityjsonOptions | None = None) -> dict[str, Any]:
    """Make a CityJSON 2.0 document of one tree.

    Parameters
    ----------
    tree : TreeModel
        Its metadata may hold ``species``, ``ground_z``, ``top_z`` and ``crown_area_m2``.
    name : str
        The identifier of the city object.
    options : CityjsonOptions, optional

    Returns
    -------
    dict
        One ``SolitaryVegetationObject`` whose geometry is a list of ``Solid``s, one closed tube per
        branch, and whose attribute ``skeleton`` holds the tree without loss (`from_cityjson`).

    Raises
    ------
    UsageError
        If the name is empty.

    References
    ----------
    CityJSON Specifications 2.0.1, https://www.cityjson.org/specs/2.0.1/
    """
    if not name:
        msg = "a city object needs a name; give the name of the tree or of its file"
        raise UsageError(msg)
    options = options or CityjsonOptions()
    geometry, vertices, translate = solids(tree, options)
    metadata: dict[str, Any] = {
        "geographicalExtent": _extent(tree, vertices, translate, options.vertex_step_m)
    }
    reference = crs_url(tree.skeleton.crs)
    if reference:
        metadata = {"referenceSystem": reference, **metadata}
    attributes = describe(tree)
    if options.skeleton:
        attributes["skeleton"] = encode_graph(tree, options)
    return {
        "type": "CityJSON",
        "version": "2.0",
        "metadata": metadata,
        "transform": {"scale": [options.vertex_step_m] * 3, "translate": translate.tolist()},
        "CityObjects": {
            name: {"type": "SolitaryVegetationObject", "attributes": attributes, "geometry": geometry}
        },
        "vertices": vertices.tolist(),
    }


def write_cityjson(document: Mapping[str, Any], path: str | os.PathLike[str]) -> None:
    """Write a document as compact JSON, whole or not at all.

    Parameters
    ----------
    document : mapping
    path : path-like

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    write_text(path, json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False) + "\n")


def crs_url(crs: str | None) -> str | None:
    """Return the OGC address of ``"EPSG:28992"`` and the like; None where there is no such code.

    Examples
    --------
    >>> crs_url("EPSG:28992")
    'https://www.opengis.net/def/crs/EPSG/0/28992'
    """
    match = re.fullmatch(r"\s*([A-Za-z]+):+(\w+)\s*", crs or "")
    return f"https://www.opengis.net/def/crs/{match[1].upper()}/0/{match[2]}" if match else None


def describe(tree: TreeModel) -> dict[str, Any]:
    """Return what the city object says of the tree: metres, three or four decimals.

    Parameters
    ----------
    tree : TreeModel

    Returns
    -------
    dict
        ``species``, ``height``, ``trunkDiameter`` and ``crownDiameter`` as CityGML names them, and
        ``dbh`` with its interval, arc, source and the height of the ground. What is unknown is absent.
    """
    known, trunk, z = tree.metadata, tree.trunk, tree.skeleton.xyz[:, 2]
    ground = float(_first(trunk.ground_z if trunk else None, known.get("ground_z"), z.min()))
    top = float(_first(known.get("top_z"), z.max()))
    breast = trunk.dbh_m if trunk and trunk.dbh_m else _diameter_at(tree, ground + BREAST_HEIGHT_M)
    found: dict[str, Any] = {
        "species": known.get("species"),
        "height": _rounded(top - ground, 3),
        "trunkDiameter": _rounded(breast, 4),
        "crownDiameter": _rounded(_crown_diameter(tree), 3),
    }
    if trunk:
        found |= {
            "dbh": _rounded(trunk.dbh_m, 4),
            "dbhLow": _rounded(trunk.lo_m, 4),
            "dbhHigh": _rounded(trunk.hi_m, 4),
            "dbhArc": _rounded(trunk.arc_deg, 1),
            "dbhSource": trunk.source,
            "groundHeight": _rounded(trunk.ground_z + float(tree.skeleton.origin[2]), 4),
        }
    return {key: value for key, value in found.items() if value is not None}


def _first(*values: Any) -> Any:
    """Return the first value that is known."""
    return next(value for value in values if value is not None)


def _rounded(value: float | None, decimals: int) -> float | None:
    return None if value is None or not np.isfinite(value) else round(float(value), decimals)


def _diameter_at(tree: TreeModel, height: float) -> float | None:
    """Return the diameter of the stem where it first passes `height`."""
    stem = tree.skeleton.paths[0]
    z, radius = tree.skeleton.xyz[stem, 2], tree.radius[stem]
    for k in np.flatnonzero((z[:-1] <= height) & (z[1:] > height))[:1]:
        share = (height - z[k]) / (z[k + 1] - z[k])
        return float(2 * (radius[k] + share * (radius[k + 1] - radius[k])))
    return None


def _crown_diameter(tree: TreeModel) -> float | None:
    """Return the diameter of the circle with the crown's area in plan."""
    area = tree.metadata.get("crown_area_m2")
    if area is None:
        try:
            area = ConvexHull(tree.skeleton.xyz[:, :2]).volume
        except (QhullError, ValueError):  # too few nodes, or all on one line
            return None
    return float(2 * np.sqrt(float(area) / np.pi))


def _extent(
    tree: TreeModel, vertices: NDArray[np.int64], translate: NDArray[np.int64], step: float
) -> list[float]:
    """Return the least and the greatest world coordinates: of the vertices, else of the nodes."""
    corners = vertices * step + translate if len(vertices) else tree.skeleton.world
    return [round(float(v), 4) for v in (*corners.min(axis=0), *corners.max(axis=0))]
