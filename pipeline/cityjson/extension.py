"""The extension TreeSkeleton: where it is declared, and whether a document keeps to it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from pipeline.cityjson.finding import Finding
from pipeline.cityjson.options import CityjsonOptions
from pipeline.cityjson.schema import schema_findings
from pipeline.output import write_text

NAME = "TreeSkeleton"
FILE = "treeskeleton.ext.json"


@cache
def _shipped() -> str:
    return files("pipeline.cityjson").joinpath(FILE).read_text(encoding="utf-8")


def extension() -> dict[str, Any]:
    """Return the extension file that ships with the package, to publish it or to check against it."""
    document: dict[str, Any] = json.loads(_shipped())
    return document


def write_beside(document: Mapping[str, Any], folder: Path) -> None:
    """Write the extension into the folder of a document that says it stands there.

    Parameters
    ----------
    document : mapping
        A document, or the first line of a sequence.
    folder : Path

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    if document.get("extensions", {}).get(NAME, {}).get("url") == FILE:
        write_text(folder / FILE, _shipped())


def declaration(options: CityjsonOptions) -> dict[str, Any]:
    """Return the member of a document that declares the extension."""
    return {"extensions": {NAME: {"url": options.extension_url, "version": extension()["version"]}}}


def extension_findings(document: Mapping[str, Any]) -> Iterator[Finding]:
    """Find where a document that declares the extension departs from it.

    Parameters
    ----------
    document : mapping

    Yields
    ------
    Finding
        Members that begin with ``+treeskel-``, attributes of ``+TreeSkeleton`` objects, and our
        semantic surfaces.
    """
    declared, objects = document.get("extensions"), document.get("CityObjects")
    if not (isinstance(declared, Mapping) and NAME in declared and isinstance(objects, Mapping)):
        return
    ours = extension()
    for where, rule, value in _members(objects, ours):
        for found in schema_findings(value, {"definitions": ours["definitions"], "allOf": [rule]}):
            at = where if found.where == "document" else f"{where}, {found.where}"
            said = found.what.replace("Against the schema", f"Against the extension {NAME}")
            yield Finding(at, said, found.remedy.replace("CityJSON schema", FILE))


def _members(objects: Mapping[str, Any], ours: Mapping[str, Any]) -> Iterator[tuple[str, Any, Any]]:
    """Yield what the extension rules: its place, its rule, itself."""
    known = ours["extraAttributes"]["SolitaryVegetationObject"]
    for name, thing in objects.items():
        if not isinstance(thing, Mapping):
            continue
        attributes = thing.get("attributes")
        if thing.get("type") == "+TreeSkeleton":
            yield f"{name}, attributes", {"$ref": "#/definitions/lines"}, attributes
        for key, value in attributes.items() if isinstance(attributes, Mapping) else ():
            if key in known:
                yield f"{name}, attributes, {key}", known[key], value
        geometry = thing.get("geometry")
        for number, shape in enumerate(geometry if isinstance(geometry, list) else ()):
            for k, surface in enumerate(_surfaces(shape)):
                rule = ours["extraSemanticSurfaces"].get(str(surface.get("type")))
                if rule is not None:
                    yield f"{name}, geometry {number}, semantic surface {k}", rule, surface


def _surfaces(shape: Any) -> list[Mapping[str, Any]]:
    semantics = shape.get("semantics") if isinstance(shape, Mapping) else None
    surfaces = semantics.get("surfaces") if isinstance(semantics, Mapping) else None
    return [s for s in surfaces if isinstance(s, Mapping)] if isinstance(surfaces, list) else []
