"""PLY files, read leniently: ASCII or binary, any number types, an empty line after the header."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError, InputMissingError

TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"},
    **{"float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2"},
    **{"int32": "i4", "uint32": "u4", "float32": "f4", "float64": "f8"},
}

ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}

COMMENT_WIDTH = 200
"""Longest text of a comment; readers in use refuse lines from 256 characters on."""


@dataclass(frozen=True)
class Property:
    """A column of an element: its name, numpy type, and for a list the type of its length."""

    name: str
    kind: str
    length: str | None = None


@dataclass(frozen=True)
class Element:
    """A table of a file."""

    name: str
    count: int
    properties: tuple[Property, ...]

    @property
    def has_lists(self) -> bool:
        """Whether the rows differ in length."""
        return any(p.length for p in self.properties)

    def dtype(self, order: str) -> np.dtype[Any]:
        """Return the type of a binary row without lists; a list counts as its length alone."""
        return np.dtype([(str(k), order + (p.length or p.kind)) for k, p in enumerate(self.properties)])


@dataclass(frozen=True)
class Ply:
    """A file with its header understood and its body as it stands.

    Parameters
    ----------
    path : path-like
    order : str
        Byte order as numpy writes it, empty for ASCII.
    comments : tuple of str
        Without the word ``comment``.
    elements : tuple of Element
    body : bytes
    """

    path: str | os.PathLike[str]
    order: str
    comments: tuple[str, ...]
    elements: tuple[Element, ...]
    body: bytes

    def element(self, name: str) -> Element | None:
        """Return the element of that name."""
        return next((e for e in self.elements if e.name == name), None)

    def columns(self, name: str) -> dict[str, NDArray[Any]]:
        """Return the columns of an element that has no lists.

        Raises
        ------
        InputFormatError
            If the body ends too early, or holds something that is not a number.
        """
        tokens = self.body.split() if not self.order else []
        place = 0
        for element in self.elements:
            if element.name == name:
                return self._table(element, place, tokens)
            place = self._after(element, place, tokens)
        msg = f"{self.path}: has no element {name}"
        raise InputFormatError(msg)

    def require_whole(self) -> None:
        """Raise `InputFormatError` if the body ends before the rows that the header promises."""
        tokens = self.body.split() if not self.order else []
        place = 0
        for element in self.elements:
            place = self._after(element, place, tokens)
            if place > len(tokens if not self.order else self.body):
                raise _short(self, element)

    def _table(self, element: Element, place: int, tokens: list[bytes]) -> dict[str, NDArray[Any]]:
        if element.has_lists:
            msg = f"{self.path}: its element {element.name} has lists, expected plain numbers; write it anew"
            raise InputFormatError(msg)
        names = [p.name for p in element.properties]
        try:
            if self.order:
                rows = np.frombuffer(self.body, element.dtype(self.order), element.count, place)
                return {n: rows[str(k)] for k, n in enumerate(names)}
            size = element.count * len(names)
            if place + size > len(tokens):
                raise _short(self, element)
            values = np.array(tokens[place : place + size], dtype=np.float64).reshape(
                element.count, len(names)
            )
            return {n: values[:, k] for k, n in enumerate(names)}
        except InputFormatError:
            raise
        except ValueError as error:
            raise _short(self, element) from error

    def _after(self, element: Element, place: int, tokens: list[bytes]) -> int:
        """Return where the next element begins."""
        if not element.has_lists:
            return place + element.count * (
                element.dtype("<").itemsize if self.order else len(element.properties)
            )
        for _ in range(element.count):
            for p in element.properties:
                try:
                    if not self.order:
                        place += 1 + int(tokens[place]) if p.length else 1
                        continue
                    kind = np.dtype(self.order + p.kind)
                    if p.length:
                        head = np.dtype(self.order + p.length)
                        place += (
                            head.itemsize + int(np.frombuffer(self.body, head, 1, place)[0]) * kind.itemsize
                        )
                    else:
                        place += kind.itemsize
                except (ValueError, IndexError) as error:
                    raise _short(self, element) from error
        return place


def _short(ply: Ply, element: Element) -> InputFormatError:
    msg = (
        f"{ply.path}: ends within its {element.count} rows of {element.name}, or holds something that is "
        "not a number; copy or write the file anew"
    )
    return InputFormatError(msg)


def open_ply(path: str | os.PathLike[str]) -> Ply:
    """Read a PLY file and understand its header.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    Ply

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If it is no PLY file, or promises more rows than its size can hold.
    """
    try:
        content = Path(path).read_bytes()
    except (FileNotFoundError, IsADirectoryError) as error:
        msg = f"{path}: there is no such file; check the name"
        raise InputMissingError(msg) from error
    except OSError as error:
        msg = f"{path}: cannot be read ({error.strerror}); check that you may read it"
        raise InputFormatError(msg) from error
    if not content:
        msg = f"{path}: is empty (0 bytes); copy or export it again"
        raise InputFormatError(msg)
    end = re.search(rb"^end_header[ \t]*\r?\n?", content, re.MULTILINE)
    if not content.startswith(b"ply") or end is None:
        msg = f"{path}: is not a PLY file (it lacks 'ply' or 'end_header'); give a .ply file"
        raise InputFormatError(msg)
    lines = content[: end.start()].decode("utf-8", errors="replace").splitlines()[1:]
    order, comments, elements = _understood(path, lines)
    ply = Ply(path, order, comments, elements, content[end.end() :])
    for element in elements:
        least = element.dtype("<").itemsize if order else 2 * len(element.properties)
        if element.count < 0 or element.count * least > len(ply.body) + 1:
            msg = (
                f"{path}: promises {element.count} rows of {element.name}, but only {len(ply.body)} bytes "
                "follow its header; copy or write the file anew"
            )
            raise InputFormatError(msg)
    return ply


def _understood(
    path: str | os.PathLike[str], lines: list[str]
) -> tuple[str, tuple[str, ...], tuple[Element, ...]]:
    """Return byte order, comments and elements of a header."""
    order: str | None = None
    comments: list[str] = []
    tables: list[tuple[str, int, list[Property]]] = []
    for line in lines:
        match line.split():
            case ["format", kind, *_] if kind in ORDERS:
                order = ORDERS[kind]
            case ["comment" | "obj_info", *_]:
                comments.append(line.split(" ", 1)[1] if " " in line else "")
            case ["element", name, count] if count.removeprefix("-").isdecimal():
                tables.append((name, int(count), []))
            case ["property", "list", length, kind, name] if tables and length in TYPES and kind in TYPES:
                tables[-1][2].append(Property(name, TYPES[kind], TYPES[length]))
            case ["property", kind, name] if tables and kind in TYPES:
                tables[-1][2].append(Property(name, TYPES[kind]))
            case []:
                pass
            case _:
                msg = f"{path}: its header has the line {line!r}, which means nothing; write the file anew"
                raise InputFormatError(msg)
    if order is None:
        msg = f"{path}: its header names no format that is known ({', '.join(ORDERS)}); write the file anew"
        raise InputFormatError(msg)
    return order, tuple(comments), tuple(Element(name, count, tuple(held)) for name, count, held in tables)


def header(kind: str, comments: Iterable[str], elements: Mapping[str, tuple[int, Iterable[str]]]) -> bytes:
    """Write a header.

    Parameters
    ----------
    kind : {"ascii", "binary_little_endian"}
    comments : iterable of str
        One line each.
    elements : mapping of str to (int, iterable of str)
        Count and properties (``"double x"``) by name, in the order of the body.

    Returns
    -------
    bytes
        Up to and with the line end after ``end_header``.
    """
    lines = ["ply", f"format {kind} 1.0", *(f"comment {text}" for text in comments)]
    for name, (count, properties) in elements.items():
        lines += [f"element {name} {count}", *(f"property {p}" for p in properties)]
    return ("\n".join([*lines, "end_header"]) + "\n").encode("ascii")
