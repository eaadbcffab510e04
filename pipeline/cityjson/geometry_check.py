"""Find what is wrong with one geometry: its level of detail, indices, semantics, surfaces, shells."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.cityjson.finding import Finding
from pipeline.cityjson.nesting import flat, is_nested
from pipeline.cityjson.shell import Surfaces, shell_findings, surface_findings
from pipeline.cityjson.vocabulary import DEPTH, LOD, SURFACE_TYPES
from pipeline.model import Floats


def geometry_findings(
    geometry: Any, where: str, points: Floats, step: float, used: NDArray[np.bool_]
) -> Iterator[Finding]:
    """Find the faults of one geometry.

    Parameters
    ----------
    geometry : object
        What stands in the document, whatever it is.
    where : str
        Name of the geometry.
    points : (V, 3) array of float64
        Vertices of the document, metres.
    step : float
        Coarsest step of the coordinates, metres.
    used : (V,) array of bool
        Marked here for the vertices that the geometry names.

    Yields
    ------
    Finding
    """
    kind = geometry.get("type") if isinstance(geometry, Mapping) else None
    if not isinstance(kind, str) or kind not in DEPTH:
        yield Finding(
            where, f"{kind!r} is not a type of geometry.", f"Use one of {', '.join(sorted(DEPTH))}."
        )
        return
    yield from _lod_findings(geometry, where)
    boundaries = geometry.get("boundaries")
    if not is_nested(boundaries, DEPTH[kind]):
        yield Finding(
            where,
            f"The boundaries are not indices nested {DEPTH[kind]} deep without empty lists.",
            f"Nest them as a {kind} wants: solids, shells, surfaces, rings, vertices.",
        )
        return
    index = np.array(flat(boundaries, DEPTH[kind]), dtype=np.int64)
    outside = np.flatnonzero((index < 0) | (index >= len(points)))
    used[index[(index >= 0) & (index < len(points))]] = True
    if len(outside):
        yield Finding(
            where + _surface_of(boundaries, DEPTH[kind], int(outside[0])),
            f"Vertex {index[outside[0]]} does not exist, there are {len(points)}.",
            "Name a vertex that exists, counted from 0.",
        )
        return
    yield from _semantic_findings(geometry, where, DEPTH[kind])
    if DEPTH[kind] >= 3:
        for name, hollow, shell in _shells(boundaries, DEPTH[kind]):
            surfaces = Surfaces.of(shell, points)
            yield from surface_findings(surfaces, where + name, step)
            if DEPTH[kind] > 3:
                yield from shell_findings(surfaces, where + name, hollow=hollow)


def _lod_findings(geometry: Mapping[str, Any], where: str) -> Iterator[Finding]:
    if geometry["type"] == "GeometryInstance":
        return
    lod = geometry.get("lod")
    if not isinstance(lod, str):
        said = f"The lod is {lod!r}, not a string." if lod is not None else "There is no lod."
        good = f"{lod:g}" if type(lod) in (int, float) and LOD.fullmatch(f"{lod:g}") else "3"
        yield Finding(where, said, f'Write "lod": "{good}".')
    elif not LOD.fullmatch(lod):
        yield Finding(
            where, f"The lod {lod!r} is not a level of CityJSON.", 'Write "0" to "3", or as in "2.1".'
        )


def _shells(boundaries: list[Any], depth: int) -> Iterator[tuple[str, bool, list[Any]]]:
    """Yield every list of surfaces with its name, and whether it is an inner shell."""
    if depth == 3:
        yield "", False, boundaries
        return
    for number, solid in enumerate([boundaries] if depth == 4 else boundaries):
        prefix = f", solid {number}" if depth == 5 else ""
        for k, shell in enumerate(solid):
            yield f"{prefix}, shell {k}", k > 0, shell


def _surface_of(boundaries: list[Any], depth: int, position: int) -> str:
    """Return the name of the surface (or line) to which the leaf at `position` belongs."""
    seen = 0
    for name, _, shell in (
        _shells(boundaries, depth) if depth >= 3 else [("", False, [[b] for b in boundaries])]
    ):
        for number, surface in enumerate(shell):
            seen += len(flat([surface], 3)) if depth > 1 else 1
            if position < seen:
                return f"{name}, {'surface' if depth >= 3 else 'part'} {number}"
    return ""


def _semantic_findings(geometry: Mapping[str, Any], where: str, depth: int) -> Iterator[Finding]:
    semantics = geometry.get("semantics")
    if semantics is None:
        return
    surfaces = semantics.get("surfaces") if isinstance(semantics, Mapping) else None
    if not isinstance(surfaces, list) or "values" not in semantics:
        yield Finding(
            f"{where}, semantics",
            "It lacks surfaces or values.",
            "Give a list of surfaces and one value for each.",
        )
        return
    for number, surface in enumerate(surfaces):
        kind = surface.get("type") if isinstance(surface, Mapping) else None
        if not isinstance(kind, str) or (kind not in SURFACE_TYPES and not re.fullmatch(r"\+\w+", kind)):
            yield Finding(
                f"{where}, semantic surface {number}",
                f"{kind!r} is not a type of semantic surface.",
                "Use a type of CityJSON 2.0, or declare an extension and begin the name with '+'.",
            )
    yield from _value_findings(
        semantics["values"], geometry["boundaries"], max(depth - 2, 1), len(surfaces), where
    )


def _value_findings(values: Any, boundaries: Any, depth: int, count: int, where: str) -> Iterator[Finding]:
    """Find semantic values that do not go with the surfaces; null stands for none at any level."""
    if values is None:
        return
    if not isinstance(values, list) or len(values) != len(boundaries):
        have = len(values) if isinstance(values, list) else repr(values)
        yield Finding(
            f"{where}, semantics",
            f"There are {have} semantic values for {len(boundaries)} parts.",
            "Give one value (or null) for each surface, nested as the boundaries are.",
        )
    elif depth > 1:
        for value, part in zip(values, boundaries, strict=True):
            yield from _value_findings(value, part, depth - 1, count, where)
    else:
        wrong = [v for v in values if v is not None and not (type(v) is int and 0 <= v < count)]
        if wrong:
            yield Finding(
                f"{where}, semantics",
                f"The semantic value {wrong[0]!r} is none of the {count} surfaces.",
                "Count the semantic surfaces from 0, or write null.",
            )
