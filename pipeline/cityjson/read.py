"""CityJSON files back to trees, whichever profile they are in."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NoReturn

from pipeline.cityjson.graph import decode_graph
from pipeline.cityjson.lines import has_classes, has_radii, tree_of_classes, tree_of_radii
from pipeline.errors import InputFormatError, InputMissingError
from pipeline.model import RADIUS_SOURCES, TreeModel, Trunk

GRAPHS = ("skeleton", "+treeskel-graph")
"""Attributes that hold a tree as whole numbers."""


def read_cityjson(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a CityJSON file as it stands.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    dict
        The document, for `from_cityjson` or `check`.

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If it is not JSON, or not a CityJSON object.
    """
    try:
        document = parsed(Path(path).read_bytes())
    except (FileNotFoundError, IsADirectoryError) as error:
        msg = f"{path}: there is no such file; check the name"
        raise InputMissingError(msg) from error
    except OSError as error:
        msg = f"{path}: cannot be read ({error.strerror}); check that you may read it"
        raise InputFormatError(msg) from error
    except (ValueError, RecursionError) as error:
        msg = f"{path}: is not JSON ({error}); give a CityJSON file"
        raise InputFormatError(msg) from error
    if not isinstance(document, dict) or document.get("type") != "CityJSON":
        msg = f"{path}: is JSON but not CityJSON (no type CityJSON); give a .city.json file"
        raise InputFormatError(msg)
    return document


def parsed(text: bytes) -> Any:
    """Return what JSON text says.

    Raises
    ------
    ValueError, RecursionError
        If it is not JSON; NaN and Infinity are not either.
    """
    return json.loads(text, parse_constant=_refused)


def from_cityjson(document: Mapping[str, Any]) -> TreeModel:
    """Make the tree of the first city object that carries a skeleton.

    Parameters
    ----------
    document : mapping
        As `to_cityjson` makes it in any profile, or a file of 2021, whose lines have classes of radius.

    Returns
    -------
    TreeModel
        Parents exact, nodes and radii within half a step (half a class in the compact profile); the
        trunk and the species too.

    Raises
    ------
    InputFormatError
        If no object carries a skeleton, or it is damaged.

    Notes
    -----
    A skeleton as whole numbers is taken before lines, since lines alone do not always tell nodes apart
    that stand in one place. Lines of 2021 do not say where their radii come from: these count as allometric.
    """
    objects = document.get("CityObjects")
    named = {
        name: thing
        for name, thing in (objects.items() if isinstance(objects, Mapping) else ())
        if isinstance(thing, Mapping)
    }
    for name, kind, held in _skeletons(named):
        try:
            tree = _tree(kind, held, document)
        except InputFormatError as error:
            msg = f"city object {name!r}: {error}"
            raise InputFormatError(msg) from error
        return _with_trunk(tree, _told(named, name))
    msg = (
        "no city object carries the attribute `skeleton`, nor lines with radii; "
        "only files that hold it can become a tree again"
    )
    raise InputFormatError(msg)


def _skeletons(named: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[str, str, Mapping[str, Any]]]:
    """Yield what a tree can be made of: name, kind, and the part that holds it; the best first."""
    for name, thing in named.items():
        for key in GRAPHS:
            if isinstance(_attributes(thing).get(key), Mapping):
                yield name, "graph", _attributes(thing)[key]
    for kind, holds in (("classes", has_classes), ("radii", has_radii)):
        for name, thing in named.items():
            if holds(thing):
                yield name, kind, thing


def _tree(kind: str, held: Mapping[str, Any], document: Mapping[str, Any]) -> TreeModel:
    crs = crs_of(document)
    if kind == "graph":
        return decode_graph(held, crs=crs)
    make = tree_of_classes if kind == "classes" else tree_of_radii
    return make(held, document.get("vertices"), document.get("transform"), crs=crs)


def _attributes(thing: Mapping[str, Any]) -> Mapping[str, Any]:
    known = thing.get("attributes")
    return known if isinstance(known, Mapping) else {}


def _told(named: Mapping[str, Mapping[str, Any]], name: str) -> Mapping[str, Any]:
    """Return the attributes of the tree: of the object itself, or of the one whose skeleton it is."""
    known = _attributes(named[name])
    whole = named.get(str(known.get("tree")))
    return _attributes(whole) if whole is not None else known


def crs_of(document: Mapping[str, Any]) -> str | None:
    """Return the reference system of a document as ``"EPSG:28992"``, None where there is none."""
    metadata = document.get("metadata")
    reference = metadata.get("referenceSystem") if isinstance(metadata, Mapping) else None
    match = (
        re.search(r"def[/:]crs[/:](\w+)[/:][^/:]*[/:](\w+)$", reference)
        if isinstance(reference, str)
        else None
    )
    return f"{match[1]}:{match[2]}" if match else None


def _with_trunk(tree: TreeModel, known: Mapping[str, Any]) -> TreeModel:
    """Add the diameter at breast height and the species, where the attributes tell them."""
    numbers = {key: value for key, value in known.items() if type(value) in (int, float)}
    trunk = None
    if "dbhArc" in numbers and "groundHeight" in numbers:
        trunk = Trunk(
            dbh_m=numbers.get("dbh"),
            lo_m=numbers.get("dbhLow"),
            hi_m=numbers.get("dbhHigh"),
            arc_deg=numbers["dbhArc"],
            source=next((s for s in RADIUS_SOURCES if s == known.get("dbhSource")), None),
            ground_z=numbers["groundHeight"] - float(tree.skeleton.origin[2]),
        )
    metadata = {"species": known["species"]} if isinstance(known.get("species"), str) else {}
    return TreeModel(tree.skeleton, tree.radius, tree.radius_source, tree.radius_rmse, trunk, metadata)


def _refused(constant: str) -> NoReturn:
    msg = f"{constant} is not a JSON number"
    raise ValueError(msg)
