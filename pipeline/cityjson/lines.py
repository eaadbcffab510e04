"""City objects that hold a tree as lines: their radii, and the checks that these need."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from pipeline.cityjson.axes import Grown, grown, values_of
from pipeline.cityjson.nesting import flat, is_nested
from pipeline.errors import InputFormatError, ModelError
from pipeline.model import ALLOMETRIC, MEASURED, RADIUS_SOURCES, Floats, Skeleton, TreeModel

ANEW = "write the file anew from its tree"


def has_classes(thing: Mapping[str, Any]) -> bool:
    """Tell whether a city object holds lines with classes of radius, as the compact profile and 2021 have."""
    return any("radius" in known for shape in _lines(thing) for known in _classes(shape))


def has_radii(thing: Mapping[str, Any]) -> bool:
    """Tell whether a city object holds lines and the radii at their vertices."""
    attributes = thing.get("attributes")
    return isinstance(attributes, Mapping) and "radii" in attributes and bool(_lines(thing))


def tree_of_classes(thing: Mapping[str, Any], vertices: Any, transform: Any, *, crs: str | None) -> TreeModel:
    """Make a tree of lines with classes of radius.

    Parameters
    ----------
    thing : mapping
        A city object; its first geometry of lines with classes counts.
    vertices : object
        Of the document: steps of the transform, or metres where there is none (2021).
    transform : object
        Of the document; None for metres.
    crs : str or None

    Returns
    -------
    TreeModel
        Without trunk and metadata.

    Raises
    ------
    InputFormatError
        If a member is missing or damaged, or the lines make no tree.
    """
    shape = next(s for s in _lines(thing) if any("radius" in known for known in _classes(s)))
    points, origin = _points(vertices, transform)
    lines = _boundaries(shape, points)
    classes = _classes(shape)
    axes = (thing.get("attributes") or {}).get("+treeskel-axes")
    numbers = _numbers(shape, classes, lines)
    radius = [_number(known, "radius") for known in classes]
    unknown = ALLOMETRIC if axes is None else MEASURED
    source = [_source(known, unknown) for known in classes]
    root, feet = _axes(axes, len(classes))
    made = grown(lines, points, feet=feet)
    of_node = values_of(made, [[float(k) for k in row] for row in numbers], root).astype(np.int64)
    return _model(made, points, origin, np.array(radius)[of_node], np.array(source)[of_node], crs)


def tree_of_radii(thing: Mapping[str, Any], vertices: Any, transform: Any, *, crs: str | None) -> TreeModel:
    """Make a tree of lines with a radius at every vertex; parameters as for `tree_of_classes`.

    Returns
    -------
    TreeModel
        All radii count as measured; without trunk and metadata.

    Raises
    ------
    InputFormatError
        If a member is missing or damaged, or the lines make no tree.
    """
    points, origin = _points(vertices, transform)
    lines = _boundaries(_lines(thing)[0], points)
    radii, scale = thing["attributes"]["radii"], _number(thing["attributes"], "radiusScale")
    if not _like(radii, lines):
        msg = f"the radii are not one whole number for every vertex of every line; {ANEW}"
        raise InputFormatError(msg)
    if "nodes" in thing["attributes"]:
        lines, points = _told_apart(thing["attributes"]["nodes"], lines, points)
    made = grown(lines, points, feet={})
    radius = values_of(made, [row[1:] or row for row in radii], radii[0][0]) * scale
    return _model(made, points, origin, radius, np.full(len(radius), MEASURED), crs)


def _like(values: Any, lines: list[list[int]]) -> bool:
    """Tell whether values are whole numbers, one for every vertex of every line."""
    return is_nested(values, 2) and [len(row) for row in values] == [len(line) for line in lines]


def _told_apart(nodes: Any, lines: list[list[int]], points: Floats) -> tuple[list[list[int]], Floats]:
    """Return lines of nodes instead of vertices, and the place of every node."""
    place = dict(zip(flat(nodes, 2), flat(lines, 2), strict=True)) if _like(nodes, lines) else {}
    if sorted(place) != list(range(len(place))) or not place:
        msg = f"the nodes are not numbered from 0, one for every vertex of every line; {ANEW}"
        raise InputFormatError(msg)
    return nodes, points[[place[number] for number in range(len(place))]]


def _lines(thing: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    geometry = thing.get("geometry")
    shapes = geometry if isinstance(geometry, list) else []
    return [s for s in shapes if isinstance(s, Mapping) and s.get("type") == "MultiLineString"]


def _classes(shape: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the semantic surfaces, which the files of 2021 call types."""
    semantics = shape.get("semantics")
    if not isinstance(semantics, Mapping):
        return []
    known = semantics.get("surfaces", semantics.get("types"))
    return [c for c in known if isinstance(c, Mapping)] if isinstance(known, list) else []


def _points(vertices: Any, transform: Any) -> tuple[Floats, Floats]:
    """Return the vertices in metres from an origin, and the origin."""
    try:
        points = np.array(vertices, dtype=np.float64).reshape(-1, 3)
        if not isinstance(transform, Mapping):
            return points, np.zeros(3)
        scale, zero = (np.array(transform[key], dtype=np.float64) for key in ("scale", "translate"))
        return points * scale.reshape(3), zero.reshape(3)
    except (KeyError, TypeError, ValueError) as error:
        msg = f"the vertices or the transform are not three numbers each ({error}); {ANEW}"
        raise InputFormatError(msg) from error


def _boundaries(shape: Mapping[str, Any], points: Floats) -> list[list[int]]:
    lines = shape.get("boundaries")
    if not isinstance(lines, list) or not is_nested(lines, 2):
        msg = f"the boundaries are not lists of indices without empty ones; {ANEW}"
        raise InputFormatError(msg)
    if min(map(min, lines)) < 0 or max(map(max, lines)) >= len(points):
        msg = f"the boundaries name a vertex that is not there, there are {len(points)}; {ANEW}"
        raise InputFormatError(msg)
    return lines


def _numbers(
    shape: Mapping[str, Any], classes: Sequence[Mapping[str, Any]], lines: list[list[int]]
) -> list[list[int]]:
    """Return the class of every segment of every line; values are one a line, or one a segment."""
    values = shape["semantics"].get("values")
    edges = [max(len(line) - 1, 1) for line in lines]
    if isinstance(values, list) and len(values) == len(lines):
        rows = [v if isinstance(v, list) else [v] * n for v, n in zip(values, edges, strict=True)]
    elif isinstance(values, list) and len(values) == sum(edges):
        cuts = np.cumsum([0, *edges]).tolist()
        rows = [values[a:b] for a, b in pairwise(cuts)]
    else:
        rows = []
    if [len(row) for row in rows] != edges or not all(type(v) is int for row in rows for v in row):
        msg = f"the semantic values are not one class for every line or segment; {ANEW}"
        raise InputFormatError(msg)
    rows = _from_zero(rows, classes)
    if not all(0 <= v < len(classes) for row in rows for v in row):
        msg = f"a semantic value is none of the {len(classes)} classes of radius; {ANEW}"
        raise InputFormatError(msg)
    return rows


def _from_zero(rows: list[list[int]], classes: Sequence[Mapping[str, Any]]) -> list[list[int]]:
    """Count classes from 0 where the values are the numbers that the classes of 2021 give themselves."""
    named = {known.get("class"): k for k, known in enumerate(classes)}
    used = {v for row in rows for v in row}
    if len(named) == len(classes) and 0 not in used and used <= set(named):
        return [[named[v] for v in row] for row in rows]
    return rows


def _number(known: Mapping[str, Any], key: str) -> float:
    value = known.get(key)
    if type(value) not in (int, float) or not isinstance(value, int | float) or not 0 <= value < 1e6:
        msg = f"{key} is {value!r}, not a number of metres; {ANEW}"
        raise InputFormatError(msg)
    return float(value)


def _source(known: Mapping[str, Any], unknown: int) -> int:
    value = known.get("radiusSource", unknown)
    return value if type(value) is int and 0 <= value < len(RADIUS_SOURCES) else unknown


def _axes(axes: Any, count: int) -> tuple[int | None, dict[int, int] | None]:
    """Return the class of the root and the feet that vertices do not tell, of the compact profile."""
    if axes is None:
        return None, None
    root, feet = (axes.get("root"), axes.get("feet", [])) if isinstance(axes, Mapping) else (None, [])
    pairs = feet == [] or (is_nested(feet, 2) and {len(pair) for pair in feet} == {2})
    if type(root) is not int or not 0 <= root < count or not pairs:
        msg = f"+treeskel-axes does not hold the class of the root; {ANEW}"
        raise InputFormatError(msg)
    return root, dict(feet)


def _model(
    made: Grown, points: Floats, origin: Floats, radius: Floats, source: Any, crs: str | None
) -> TreeModel:
    try:
        skeleton = Skeleton(points[made.vertex], np.array(made.parent, dtype=np.int32), origin, crs)
        return TreeModel(skeleton, radius, source.astype(np.uint8), np.full(len(radius), np.nan))
    except ModelError as error:
        msg = f"the lines make no tree: {error}"
        raise InputFormatError(msg) from error
