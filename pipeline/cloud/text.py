"""Text clouds (XYZ, TXT, CSV, ASC, PTS): one point a line, whatever the separator or the header."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.cloud.local import localise
from pipeline.errors import InputFormatError
from pipeline.model import Floats, PointCloud

COMMENTS = ("#", "//", "%")
NAMES = ({"x", "easting"}, {"y", "northing"}, {"z", "elevation", "height"})
HEAD_LINES = 1000


@dataclass(frozen=True)
class Layout:
    """How a text cloud is laid out: lines before the first point, separator, columns of x, y, z."""

    skip: int
    separator: str | None
    columns: tuple[int, int, int]


def read(path: Path) -> PointCloud:
    """Read a text cloud with commas, semicolons, tabs or spaces, with or without a header line.

    The columns called x, y, z are used wherever they stand, else the first three. A decimal comma is
    understood where the separator is another character.

    Raises
    ------
    InputFormatError
        If a coordinate is not a number, or there are no columns x, y and z.
    """
    layout = _layout(path)
    return localise(np.empty((0, 3)) if layout is None else _rows(path, layout))


def _lines(path: Path) -> Iterator[str]:
    """Yield the lines; bytes beyond ASCII can only stand in names and remarks, so none is refused."""
    with path.open(encoding="latin-1") as stream:
        for number, line in enumerate(stream):
            yield line.removeprefix("\xef\xbb\xbf") if not number else line


def _layout(path: Path) -> Layout | None:
    """Return how the file is laid out, as its first lines tell; None where it holds no data."""
    names: list[str] = []
    for number, line in enumerate(itertools.islice(_lines(path), HEAD_LINES)):
        text = line.strip()
        fields = _fields(text.lstrip("#/% "))
        if text.startswith(COMMENTS):
            names = fields if _positions(fields) else names
        elif text and not (number == 0 and len(fields) == 1 and text.isdigit()):  # a PTS file's count
            if names or any(map(_is_number, fields)):
                return _checked_layout(path, number, text, names)
            names = fields
            if not _positions(names):
                msg = f"{path}, line {number + 1}: no columns x, y and z in {text[:60]!r}; name them"
                raise InputFormatError(msg)
    return None


def _checked_layout(path: Path, number: int, text: str, names: list[str]) -> Layout:
    """Return the layout that the first data line `text` shows, under a header of `names`."""
    fields = _fields(text)
    columns = _positions(names) or (0, 1, 2)
    if text.startswith('"') and len(fields) == len(names) + 1:  # R writes row names without a heading
        columns = (columns[0] + 1, columns[1] + 1, columns[2] + 1)
    if len(fields) <= max(columns):
        msg = (
            f"{path}, line {number + 1}: {len(fields)} columns in {text[:60]!r} where x, y and z are needed; "
            "export the cloud with three coordinates a line"
        )
        raise InputFormatError(msg)
    return Layout(number, _separator(text), columns)


def _rows(path: Path, layout: Layout) -> Floats:
    """Return the (P, 3) coordinates by NumPy's own parser."""
    lines: Iterator[str] = itertools.islice(_lines(path), layout.skip, None)
    if layout.separator != ",":
        lines = (line.replace(",", ".") for line in lines)
    try:
        return np.loadtxt(
            lines, delimiter=layout.separator, usecols=layout.columns, quotechar='"', comments="#", ndmin=2
        )
    except ValueError as error:
        raise _culprit(path, layout, error) from error


def _culprit(path: Path, layout: Layout, error: ValueError) -> InputFormatError:
    """Find the first line that holds no point and say what is wrong with it."""
    for number, line in enumerate(_lines(path)):
        fields = _fields(line.partition("#")[0].strip(), layout.separator)
        if number < layout.skip or not any(fields):
            continue
        for axis, column in zip("xyz", layout.columns, strict=True):
            value = fields[column] if column < len(fields) else ""
            if not _is_number(value):
                msg = (
                    f"{path}, line {number + 1}: {value[:40]!r} (column {column + 1}, {axis}) "
                    "is not a number; mend or remove the line, or put # before it if it is a remark"
                )
                return InputFormatError(msg)
    return InputFormatError(f"{path}: is not a table of numbers ({error}); export it again as x y z lines")


def _positions(names: list[str]) -> tuple[int, int, int] | None:
    """Return where x, y and z stand among `names`; None unless all do."""
    lower = [name.lower() for name in names]
    found = [next((i for i, name in enumerate(lower) if name in known), -1) for known in NAMES]
    return None if min(found) < 0 else (found[0], found[1], found[2])


def _separator(text: str) -> str | None:
    """Return the separator of a line; None stands for any white space."""
    if ";" in text:
        return ";"
    if text.count("\t") >= 2:
        return "\t"
    words = text.split()
    decimal_commas = len(words) >= 3 and all(map(_is_number, words[:3]))
    return "," if "," in text and not decimal_commas else None


def _fields(text: str, separator: str | None = "") -> list[str]:
    """Split a line at `separator` (by default the one that it seems to have) and unquote its fields."""
    parts = text.split(_separator(text) if separator == "" else separator)
    return [part.strip().strip('"').strip() for part in parts]


def _is_number(text: str) -> bool:
    try:
        float(text.replace(",", "."))
    except ValueError:
        return False
    return True
