"""Text tables of other programs, read leniently; what is wrong in them is named with its line.

A byte order mark, any line end, spaces around fields and ``#`` comments are taken. A number that is
none, is not finite or has a decimal comma is not: each error says file, line and remedy.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError, InputMissingError
from pipeline.model import Floats

FAR = 1e12
"""No coordinate, radius or number of a row is larger; beyond it squares lose their meaning."""

SHOWN = 40
"""Characters of a bad field that an error shows: a line may be a hundred megabytes long."""


class Row(NamedTuple):
    """A row of a table: its line in the file, from 1, or a word for its place, and its fields."""

    line: int | str
    fields: Sequence[str]


def read_bytes(path: str | os.PathLike[str], kind: str) -> bytes:
    """Return the content of a file.

    Parameters
    ----------
    path : path-like
    kind : str
        What the file should be, for the error.

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If it cannot be read.
    """
    try:
        return Path(path).read_bytes()
    except (FileNotFoundError, IsADirectoryError) as error:
        msg = f"{path}: there is no such file; check the name"
        raise InputMissingError(msg) from error
    except OSError as error:
        msg = f"{path}: cannot be read ({error.strerror}); check that you may read it, or give {kind}"
        raise InputFormatError(msg) from error


def read_lines(path: str | os.PathLike[str], kind: str) -> list[str]:
    """Return the lines of a text file without their ends.

    Parameters
    ----------
    path : path-like
    kind : str
        What the file should be, for the error.

    Returns
    -------
    list of str
        Line k + 1 of the file at k.

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If it is no text, or empty.
    """
    content = read_bytes(path, kind)
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise bad(path, line, "is no UTF-8 text", f"give {kind}") from error
    if not text.strip():
        msg = f"{path}: is empty; give {kind}"
        raise InputFormatError(msg)
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def bad(path: str | os.PathLike[str], line: int | str, what: str, remedy: str) -> InputFormatError:
    """Return the error that says where, what and the remedy."""
    msg = f"{path}: {_place(line)} {what}; {remedy}"
    return InputFormatError(msg)


def _place(line: int | str) -> str:
    return f"line {line}" if isinstance(line, int) else line


def comments(lines: Iterable[str]) -> dict[str, Row]:
    """Return what the ``# key: value`` comments say: value and line by key, the first of equals.

    Examples
    --------
    >>> comments(["# units: m", "1 0 0", "# crs: EPSG:28992"])["crs"].fields[0]
    'EPSG:28992'
    """
    said: dict[str, Row] = {}
    for number, line in enumerate(lines, 1):
        if line.lstrip().startswith("#"):
            key, _, value = line.lstrip(" \t#").partition(":")
            said.setdefault(key.strip().lower(), Row(number, (value.strip(),)))
    return said


def crs_of(said: dict[str, Row]) -> str | None:
    """Return the reference system that the comments name."""
    text = said["crs"].fields[0] if "crs" in said else ""
    return text if text not in {"", "unknown"} else None


def origin_of(path: str | os.PathLike[str], said: dict[str, Row]) -> Floats | None:
    """Return the local origin that the comments name.

    Raises
    ------
    InputFormatError
        If it is not three numbers.
    """
    if "origin" not in said:
        return None
    line, (text,) = said["origin"]
    fields = text.split()
    if len(fields) != 3:
        raise bad(path, line, f"names an origin of {len(fields)} numbers", "give x, y and z")
    return np.asarray(numbers(path, [Row(line, fields)], ("origin x", "origin y", "origin z"))[0])


def heading(crs: str | None, origin: Floats | None = None) -> list[str]:
    """Return the comment lines of a file of ours: units, reference system, origin."""
    lines = ["# treepipe: numbered path by path", "# units: m"]
    lines.append(f"# crs: {' '.join((crs or 'unknown').split())}")
    if origin is not None:
        lines.append("# origin: " + " ".join(map(repr, origin.tolist())))
    return lines


def numbers(path: str | os.PathLike[str], rows: Sequence[Row], names: Sequence[str]) -> Floats:
    """Return a table as numbers.

    Parameters
    ----------
    path : path-like
    rows : sequence of Row
        Each with as many fields as there are names.
    names : sequence of str
        Of the columns, for the error.

    Returns
    -------
    (R, C) array of float64
        All finite.

    Raises
    ------
    InputFormatError
        If a field is no finite number.
    """
    values = np.empty((len(rows), len(names)))
    for k, row in enumerate(rows):
        try:
            values[k] = [float(field) for field in row.fields]
        except ValueError as error:
            raise _no_number(path, row, names) from error
    wrong = np.argwhere(~(np.abs(values) < FAR))
    if len(wrong):
        raise _no_number(path, rows[wrong[0, 0]], names)
    return values


def whole(path: str | os.PathLike[str], rows: Sequence[Row], column: Floats, name: str) -> NDArray[np.int64]:
    """Return a column of `numbers` as whole ones.

    Raises
    ------
    InputFormatError
        If one is not whole.
    """
    wrong = np.flatnonzero(column != np.rint(column))
    if len(wrong):
        what = f"has the {name} {column[wrong[0]]:g}, which is not whole"
        raise bad(path, rows[wrong[0]].line, what, "mend it")
    return column.astype(np.int64)


def not_negative(path: str | os.PathLike[str], rows: Sequence[Row], column: Floats, name: str) -> Floats:
    """Return a column of `numbers` that holds no negative one.

    Raises
    ------
    InputFormatError
        If there is one.
    """
    wrong = np.flatnonzero(column < 0)
    if len(wrong):
        raise bad(path, rows[wrong[0]].line, f"has the {name} {column[wrong[0]]:g}", "give it as 0 or more")
    return column


def linked(
    path: str | os.PathLike[str],
    lines: Sequence[int | str],
    number: NDArray[np.int64],
    above: NDArray[np.int64],
    *,
    none: int = -1,
) -> NDArray[np.int64]:
    """Return the row of every row's parent after checking that the rows make one tree.

    Parameters
    ----------
    path : path-like
    lines : sequence of int or str
        Line of each row, or a word for its place.
    number, above : (R,) array of int64
        Number of each row and of its parent, in any order.
    none : int, optional
        Parents below or at this are none.

    Returns
    -------
    (R,) array of int64
        -1 at the one root.

    Raises
    ------
    InputFormatError
        If a number occurs twice or a parent is not there, or there are two roots or a cycle.
    """
    row_of: dict[int, int] = {}
    for k, value in enumerate(number.tolist()):
        if value in row_of:
            what = f"has the number {value}, which {_place(lines[row_of[value]])} has already"
            raise bad(path, lines[k], what, "number every row once")
        row_of[value] = k
    parent: list[int] = []
    for k, value in enumerate(above.tolist()):
        if value > none and value not in row_of:
            raise bad(path, lines[k], f"names the parent {value}, which is not there", "mend its parent")
        parent.append(row_of[value] if value > none else -1)
    roots = [k for k, p in enumerate(parent) if p < 0]
    if len(roots) > 1:
        what = f"has no parent, but neither has {_place(lines[roots[0]])}"
        raise bad(path, lines[roots[1]], what, "keep one tree a file")
    lost = _lost(parent)
    if lost is not None:
        raise bad(path, lines[lost], "is its own ancestor", "break the cycle by mending a parent")
    return np.array(parent, dtype=np.int64)


def _lost(parent: list[int]) -> int | None:
    """Return the first row from which no root is reached."""
    seen = [0] * len(parent)  # 0 unknown, 1 on the way, 2 reaches a root
    for start in range(len(parent)):
        way, k = [], start
        while k >= 0 and seen[k] == 0:
            seen[k] = 1
            way.append(k)
            k = parent[k]
        if k >= 0 and seen[k] == 1:
            return k
        for k in way:
            seen[k] = 2
    return None


def _no_number(path: str | os.PathLike[str], row: Row, names: Sequence[str]) -> InputFormatError:
    """Return the error of the first field that is no finite number."""
    for name, field in zip(names, row.fields, strict=True):
        try:
            value = float(field)
        except ValueError:
            remedy = "write decimals with a point" if "," in field else "mend the field"
            shown = field.strip()[:SHOWN]
            return bad(path, row.line, f"has the {name} {shown!r}, which is no number", remedy)
        if not math.isfinite(value) or abs(value) >= FAR:
            return bad(path, row.line, f"has the {name} {value:g}, no finite number of metres", "mend it")
    return bad(path, row.line, "has a field that is no number", "mend the field")
