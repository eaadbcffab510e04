"""One tree of a CityJSON text sequence by its name, and what such a file holds as a whole."""

from __future__ import annotations

import difflib
import os
from collections.abc import Mapping
from typing import Any

import numpy as np

from pipeline.cityjson.read import crs_of, from_cityjson
from pipeline.cityjson.seq import SUFFIX, features, first_line
from pipeline.errors import InputFormatError, InputMissingError
from pipeline.model import Floats, TreeModel

SHOWN = 3
"""Names that an error tells."""


def split_feature(name: str) -> tuple[str, str | None]:
    """Split `x.city.jsonl#oak` into the file and the tree; without a tree, or elsewhere, `None`.

    Examples
    --------
    >>> split_feature("park.city.jsonl#oak#2"), split_feature("tree#1.city.json")
    (('park.city.jsonl', 'oak#2'), ('tree#1.city.json', None))
    """
    path, mark, feature = name.partition(f"{SUFFIX}#")
    return (path + SUFFIX, feature) if mark else (name, None)


def read_feature(path: str | os.PathLike[str]) -> TreeModel:
    """Read one tree of a text sequence: the one that is named behind the file, or the only one.

    Parameters
    ----------
    path : path-like
        ``park.city.jsonl#oak``, or ``oak.city.jsonl`` of one tree.

    Raises
    ------
    InputMissingError
        If there is no such file, or no tree of this name; the error names those that come near.
    InputFormatError
        If a line is damaged, carries no tree, or there are several trees and none is named.
    """
    source, name = split_feature(os.fspath(path))
    kept, names = None, []
    for number, feature, document in features(source):
        names.append(str(feature["id"]))
        if name in (None, names[-1]):
            kept = kept or (number, document)
            if name is not None:
                break
    if kept is None or (name is None and len(names) > 1):
        raise _unclear(source, name, names)
    try:
        return from_cityjson(kept[1])
    except InputFormatError as error:
        msg = f"{source}, line {kept[0]}: {error}"
        raise InputFormatError(msg) from error


def _unclear(source: str, name: str | None, names: list[str]) -> InputMissingError | InputFormatError:
    """Return what to say where it is not clear which tree is meant."""
    if not names:
        msg = f"{source}: holds no tree; give a {SUFFIX} file with trees"
        return InputFormatError(msg)
    if name is None:
        told = ", ".join(names[:SHOWN]) + (", ..." if len(names) > SHOWN else "")
        msg = f"{source}: holds {len(names):,} trees ({told}); name one, as in {source}#{names[0]}"
        return InputFormatError(msg)
    near = difflib.get_close_matches(name, names, SHOWN)
    guess = f"near it are {', '.join(map(repr, near))}" if near else f"the first is {names[0]!r}"
    msg = f"{source}: has no tree {name!r} among its {len(names):,} ({guess}); give one of its ids"
    return InputMissingError(msg)


def describe_seq(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return what a text sequence holds, whether its trees can be read back or not.

    Returns
    -------
    dict
        ``trees``, ``crs``, ``version`` (of CityJSON), ``extensions`` (names), ``extent`` (lowest x, y, z,
        then highest, of all vertices; None without any).

    Raises
    ------
    InputMissingError, InputFormatError
        If there is no such file, or a line is damaged.
    """
    head = first_line(path)
    extensions = head.get("extensions")
    low, high, trees = np.full(3, np.inf), np.full(3, -np.inf), 0
    for number, _, document in features(path):
        trees += 1
        try:
            vertices = _vertices(document)
        except (KeyError, TypeError, ValueError) as error:
            msg = f"{path}, line {number}: vertices or transform are damaged ({error}); write the file anew"
            raise InputFormatError(msg) from error
        low = np.minimum(low, vertices.min(axis=0, initial=np.inf))
        high = np.maximum(high, vertices.max(axis=0, initial=-np.inf))
    return {
        "trees": trees,
        "crs": crs_of(head),
        "version": head.get("version"),
        "extensions": sorted(extensions) if isinstance(extensions, Mapping) else [],
        "extent": [*low.tolist(), *high.tolist()] if np.isfinite(low).all() else None,
    }


def _vertices(document: Mapping[str, Any]) -> Floats:
    """Return (N, 3) coordinates of the vertices."""
    transform = document["transform"]
    scale, zero = (np.asarray(transform[key], float).reshape(3) for key in ("scale", "translate"))
    vertices: Floats = np.asarray(document["vertices"], float).reshape(-1, 3) * scale + zero
    return vertices
