"""CityJSON files back to trees."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NoReturn

from pipeline.cityjson.graph import decode_graph
from pipeline.errors import InputFormatError, InputMissingError
from pipeline.model import RADIUS_SOURCES, TreeModel, Trunk


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
        document = json.loads(Path(path).read_bytes(), parse_constant=_refused)
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


def from_cityjson(document: Mapping[str, Any]) -> TreeModel:
    """Make the tree of the first city object that carries a skeleton.

    Parameters
    ----------
    document : mapping
        As `to_cityjson` makes it.

    Returns
    -------
    TreeModel
        Parents exact, nodes and radii within half a step; the trunk and the species too.

    Raises
    ------
    InputFormatError
        If no object carries a skeleton, or it is damaged.
    """
    objects = document.get("CityObjects")
    for name, thing in objects.items() if isinstance(objects, Mapping) else ():
        known = thing.get("attributes") if isinstance(thing, Mapping) else None
        if isinstance(known, Mapping) and isinstance(known.get("skeleton"), Mapping):
            try:
                tree = decode_graph(known["skeleton"], crs=crs_of(document))
            except InputFormatError as error:
                msg = f"city object {name!r}: {error}"
                raise InputFormatError(msg) from error
            return _with_trunk(tree, known)
    msg = "no city object carries the attribute `skeleton`; only files that hold it can become a tree again"
    raise InputFormatError(msg)


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
