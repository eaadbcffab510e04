"""Find what is wrong with a CityJSON 2.0 document, and say how to mend it.

Checked: the official schema where it is given; our own extension where it is declared; identifiers of
parents and children; levels of detail, reference system, types of objects and semantic surfaces; that
every index exists and every vertex is used and stands alone; and that every shell encloses a solid.
Not checked: whether a solid passes through itself.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from pipeline.cityjson.extension import extension_findings
from pipeline.cityjson.finding import Finding
from pipeline.cityjson.geometry_check import geometry_findings
from pipeline.cityjson.nesting import flat, is_nested
from pipeline.cityjson.schema import schema_findings
from pipeline.cityjson.vocabulary import CRS, OBJECT_TYPES
from pipeline.model import Floats

__all__ = ["Finding", "check"]


def check(document: Mapping[str, Any], *, schema: Mapping[str, Any] | None = None) -> list[Finding]:
    """Find the faults of a CityJSON document.

    Parameters
    ----------
    document : mapping
        As `pipeline.cityjson.read_cityjson` reads it.
    schema : mapping, optional
        The official JSON schema (``cityjson.min.schema.json``), to check against as well.

    Returns
    -------
    list of Finding
        Empty where the document is valid.
    """
    found = list(schema_findings(document, schema)) if schema is not None else []
    found += _header_findings(document)
    objects = document.get("CityObjects")
    if not isinstance(objects, Mapping):
        return [*found, Finding("CityObjects", "There are no city objects.", "Add the member CityObjects.")]
    found += extension_findings(document)
    found += _family_findings(objects)
    found += _type_findings(objects, extended=bool(document.get("extensions")))
    points, step, trouble = _points(document)
    if trouble:
        return [*found, trouble]
    used = np.zeros(len(points), dtype=bool)
    for where, geometry in _geometries(objects):
        found += geometry_findings(geometry, where, points, step, used)
    found += _vertex_findings(document["vertices"], used)
    return found


def _header_findings(document: Mapping[str, Any]) -> Iterator[Finding]:
    if document.get("type") != "CityJSON":
        yield Finding(
            "type", f"The type is {document.get('type')!r}, not 'CityJSON'.", "Give a CityJSON file."
        )
    if document.get("version") != "2.0":
        yield Finding(
            "version",
            f"The version is {document.get('version')!r}, not '2.0'.",
            "Upgrade the file: cjio F upgrade.",
        )
    metadata = document.get("metadata")
    crs = metadata.get("referenceSystem") if isinstance(metadata, Mapping) else None
    if crs is not None and not (isinstance(crs, str) and CRS.fullmatch(crs)):
        code = re.search(r"(\w+):+(\d+)$", str(crs))
        better = f"{code[1]}/0/{code[2]}" if code else "EPSG/0/7415 with your own code"
        yield Finding(
            "metadata, referenceSystem",
            f"The reference system is {crs!r}, not an address of the OGC.",
            f"Write https://www.opengis.net/def/crs/{better}.",
        )


def _family_findings(objects: Mapping[str, Any]) -> Iterator[Finding]:
    """Find parents and children that do not know each other."""
    for name, thing in objects.items():
        for role, answer in (("children", "parents"), ("parents", "children")):
            for relative in _listed(thing, role):
                other = objects.get(relative) if isinstance(relative, str) else None
                if other is None:
                    yield Finding(
                        f"{name}, {role}",
                        f"There is no city object {relative!r}.",
                        "Add it, or remove its name here.",
                    )
                elif not isinstance(other, Mapping) or name not in _listed(other, answer):
                    yield Finding(
                        f"{name}, {role}",
                        f"{relative!r} does not name {name!r} among its {answer}.",
                        f"Add {name!r} to the {answer} of {relative!r}.",
                    )


def _listed(thing: Any, role: str) -> list[Any]:
    relatives = thing.get(role) if isinstance(thing, Mapping) else None
    return relatives if isinstance(relatives, list) else []


def _type_findings(objects: Mapping[str, Any], *, extended: bool) -> Iterator[Finding]:
    for name, thing in objects.items():
        kind = thing.get("type") if isinstance(thing, Mapping) else None
        if isinstance(kind, str) and kind.startswith("+"):
            if not extended:
                yield Finding(
                    name,
                    f"The type {kind!r} comes from an extension, but none is declared.",
                    "Declare `extensions`.",
                )
        elif not isinstance(kind, str) or kind not in OBJECT_TYPES:
            yield Finding(
                name,
                f"{kind!r} is not a type of city object.",
                "Use a type of CityJSON 2.0, for a tree SolitaryVegetationObject.",
            )


def _points(document: Mapping[str, Any]) -> tuple[Floats, float, Finding | None]:
    """Return the vertices in metres from the transform's zero, the coarsest step, and what is wrong."""
    nothing = np.zeros((0, 3))
    transform = document.get("transform")
    scale = transform.get("scale") if isinstance(transform, Mapping) else None
    steps = scale if isinstance(scale, list) and len(scale) == 3 else []
    if not steps or not all(type(s) in (int, float) and s > 0 for s in steps):
        remedy = "Add a transform with a scale of three positive numbers and a translate."
        return (
            nothing,
            0.0,
            Finding("transform", "The scale is missing or not three positive numbers.", remedy),
        )
    vertices = document.get("vertices")
    if vertices == []:
        return nothing, float(max(steps)), None
    if not isinstance(vertices, list) or not is_nested(vertices, 2) or {len(v) for v in vertices} != {3}:
        remedy = "Round them to steps of transform.scale, three for each vertex."
        return nothing, 0.0, Finding("vertices", "The vertices are not all three whole numbers.", remedy)
    return np.array(vertices, dtype=np.float64) * np.array(steps), float(max(steps)), None


def _geometries(objects: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield every geometry with its name, the points of addresses too."""
    for name, thing in objects.items():
        if not isinstance(thing, Mapping):
            continue
        geometry = thing.get("geometry", [])
        for number, shape in enumerate(geometry if isinstance(geometry, list) else [geometry]):
            yield f"{name}, geometry {number}", shape
        addresses = thing.get("address", [])
        for number, address in enumerate(addresses if isinstance(addresses, list) else []):
            if isinstance(address, Mapping) and "location" in address:
                yield f"{name}, address {number}", address["location"]


def _vertex_findings(vertices: list[list[int]], used: Any) -> Iterator[Finding]:
    idle = np.flatnonzero(~used)
    if len(idle):
        more = f" ({len(idle)} such vertices)" if len(idle) > 1 else ""
        yield Finding(
            f"vertex {idle[0]}",
            f"The vertex is not used by any geometry{more}.",
            "Remove it: cjio F vertices_clean.",
        )
    if not len(vertices):
        return
    place = np.array(flat(vertices, 2), dtype=np.int64).reshape(-1, 3)
    order = np.lexsort(place.T)
    same = order[1:][(place[order[1:]] == place[order[:-1]]).all(axis=1)]
    if len(same):
        more = f" ({len(same)} such vertices)" if len(same) > 1 else ""
        yield Finding(
            f"vertex {same.min()}",
            f"The vertex stands where an earlier one stands{more}.",
            "Merge the two: cjio F vertices_clean.",
        )
