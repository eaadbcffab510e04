"""Many trees in one file: CityJSON text sequences (``.city.jsonl``), written and read one by one.

The first line holds what all share (reference system, transform, extension), every other line is a
``CityJSONFeature`` of one tree with vertices of its own. Neither end ever holds more than one tree.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Self

import numpy as np

from pipeline.cityjson.check import check
from pipeline.cityjson.document import as_line, city_objects, extent, header
from pipeline.cityjson.extension import write_beside
from pipeline.cityjson.finding import Finding
from pipeline.cityjson.options import CityjsonOptions
from pipeline.cityjson.read import from_cityjson, parsed
from pipeline.cityjson.schema import schema_findings
from pipeline.errors import InputFormatError, InputMissingError, UsageError
from pipeline.model import Floats, TreeModel
from pipeline.output import NO_TEXT, whole_file

SUFFIX = ".city.jsonl"


class SeqWriter:
    """Write trees to a CityJSON text sequence, whole or not at all.

    Parameters
    ----------
    path : path-like
        Ends in ``.city.jsonl``; replaced when the block ends without an error.
    options : CityjsonOptions, optional
        One profile for all trees.
    zero : (3,) array, optional
        What vertices are counted from, in the coordinates of the trees; that of the first tree by itself.

    Raises
    ------
    OutputError
        On entry or exit, if the file cannot be written.

    Notes
    -----
    The first tree decides the reference system and, unless it is given, the zero of all vertices, so the file
    depends on the order of the trees. Of the trees themselves only the names are remembered.

    Examples
    --------
    >>> with SeqWriter("forest.city.jsonl") as forest:  # doctest: +SKIP
    ...     for name, tree in trees:
    ...         forest.add(tree, name)
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        *,
        options: CityjsonOptions | None = None,
        zero: Floats | None = None,
    ) -> None:
        self._given_zero = zero
        self._path = Path(path)
        self._options = options or CityjsonOptions()
        self._stack = ExitStack()
        self._file: IO[str] | None = None
        self._names: set[str] = set()
        self._crs: str | None = None
        self._zero: Floats | None = None

    def __enter__(self) -> Self:
        temporary = self._stack.enter_context(whole_file(self._path))
        self._file = self._stack.enter_context(
            temporary.open("w", encoding="utf-8", errors=NO_TEXT, newline="\n")
        )
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is None and self._file is not None and self._zero is None:
            self._begin(None, 1e-3, np.zeros(3))
        self._file = None
        self._stack.__exit__(kind, error, trace)
        if kind is None:
            write_beside(header(None, self._options, 1e-3, np.zeros(3)), self._path.parent)

    def add(self, tree: TreeModel, name: str) -> None:
        """Write one tree.

        Parameters
        ----------
        tree : TreeModel
            In the reference system of the first tree.
        name : str
            Its identifier, which no other tree of the file has.

        Raises
        ------
        UsageError
            If the name is empty or taken, the reference system is another, or the file is not open.
        """
        if self._file is None:
            msg = f"{self._path}: is not open; add trees inside `with SeqWriter(...) as writer`"
            raise UsageError(msg)
        if name in self._names:
            msg = f"{self._path}: has a tree {name!r} already; give every tree a name of its own"
            raise UsageError(msg)
        crs = tree.skeleton.crs
        if self._zero is not None and crs != self._crs:
            msg = f"{self._path}: is in {self._crs}, but tree {name!r} in {crs}; write one file for each"
            raise UsageError(msg)
        zero = self._zero if self._zero is not None else self._given_zero
        made = city_objects(tree, name, self._options, zero)
        if self._zero is None:
            self._begin(crs, made.step, made.translate)
        made.members[name]["geographicalExtent"] = extent(tree, made)
        feature = {"type": "CityJSONFeature", "id": name, "CityObjects": made.members}
        self._file.write(as_line(feature | {"vertices": made.vertices.tolist()}))
        self._names.add(name)

    def _begin(self, crs: str | None, step: float, zero: Floats) -> None:
        """Write the first line."""
        self._crs, self._zero = crs, zero
        first = header(crs, self._options, step, zero) | {"CityObjects": {}, "vertices": []}
        if self._file is not None:
            self._file.write(as_line(first))


def read_seq(path: str | os.PathLike[str]) -> Iterator[tuple[str, TreeModel]]:
    """Read the trees of a CityJSON text sequence one by one.

    Parameters
    ----------
    path : path-like

    Yields
    ------
    name : str
        Identifier of the feature.
    tree : TreeModel
        As `from_cityjson` makes it.

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If a line is no feature, or carries no tree; the message has its number.
    """
    for number, feature, document in features(path):
        try:
            tree = from_cityjson(document)
        except InputFormatError as error:
            msg = f"{path}, line {number}: {error}"
            raise InputFormatError(msg) from error
        yield str(feature["id"]), tree


def check_seq(path: str | os.PathLike[str], *, schema: Mapping[str, Any] | None = None) -> Iterator[Finding]:
    """Find the faults of a CityJSON text sequence, tree by tree.

    Parameters
    ----------
    path : path-like
    schema : mapping, optional
        The official JSON schema of a feature (``cityjsonfeature.min.schema.json``).

    Yields
    ------
    Finding
        Its place begins with the number of the line. Faults of the first line show in the first tree.

    Raises
    ------
    InputMissingError, InputFormatError
        As for `read_seq`.
    """
    seen: set[str] = set()
    for number, feature, document in features(path):
        name = str(feature["id"])
        found = list(schema_findings(feature, schema)) if schema is not None else []
        if name in seen:
            found.append(Finding("id", f"There is a feature {name!r} already.", "Give it a name of its own."))
        elif name not in document["CityObjects"]:
            found.append(Finding("id", f"There is no city object {name!r}.", "Name the feature as its tree."))
        seen.add(name)
        for fault in [*found, *check(document)]:
            yield Finding(f"line {number}, {fault.where}", fault.what, fault.remedy)


def features(path: str | os.PathLike[str]) -> Iterator[tuple[int, dict[str, Any], dict[str, Any]]]:
    """Yield every feature with the number of its line, and as a document with the first line's members."""
    head: dict[str, Any] | None = None
    for number, line in _objects(path):
        if head is None:
            head = _checked_head(path, number, line)
            continue
        objects, vertices = line.get("CityObjects"), line.get("vertices")
        if line.get("type") != "CityJSONFeature" or not isinstance(objects, dict) or "id" not in line:
            msg = f"{path}, line {number}: is no CityJSONFeature with id and CityObjects; write it anew"
            raise InputFormatError(msg)
        yield number, line, head | {"CityObjects": objects, "vertices": vertices}
    if head is None:
        msg = f"{path}: is empty; give a {SUFFIX} file"
        raise InputFormatError(msg)


def first_line(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return what all trees of a file share: version, reference system, transform, extensions.

    Raises
    ------
    InputMissingError, InputFormatError
        As for `read_seq`.
    """
    for number, line in _objects(path):
        return _checked_head(path, number, line)
    msg = f"{path}: is empty; give a {SUFFIX} file"
    raise InputFormatError(msg)


def _checked_head(path: str | os.PathLike[str], number: int, line: dict[str, Any]) -> dict[str, Any]:
    """Return the first line, if it is one."""
    if line.get("type") != "CityJSON":
        msg = f"{path}, line {number}: is not of type CityJSON; begin the file with its transform"
        raise InputFormatError(msg)
    return line


def _objects(path: str | os.PathLike[str]) -> Iterator[tuple[int, dict[str, Any]]]:
    """Yield the JSON objects of a file of lines with their numbers, counted from 1."""
    number = 0
    try:
        with Path(path).open("rb") as file:
            for number, line in enumerate(file, 1):
                thing = parsed(line) if line.strip() else {}
                if not isinstance(thing, dict):
                    msg = f"{path}, line {number}: is JSON but no object; give a {SUFFIX} file"
                    raise InputFormatError(msg)
                if thing:
                    yield number, thing
    except (FileNotFoundError, IsADirectoryError) as error:
        msg = f"{path}: there is no such file; check the name"
        raise InputMissingError(msg) from error
    except OSError as error:
        msg = f"{path}: cannot be read ({error.strerror}); check that you may read it"
        raise InputFormatError(msg) from error
    except (ValueError, RecursionError) as error:
        msg = f"{path}, line {number}: is not JSON ({error}); the file may have been cut off, write it anew"
        raise InputFormatError(msg) from error
