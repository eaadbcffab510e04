"""MATLAB files of version 5 to 7.2: structures, cells and arrays of numbers, read with bounds checked.

A damaged file is an error here; the reader of scipy ends the whole program at some of them. What
is neither structure, cell nor numbers (text, functions, sparse arrays) is passed over.

References
----------
The MathWorks (2024). MAT-File Format, version 5 (R2024a).
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np

HEADER = 128
MATRIX, COMPRESSED = 14, 15
CELL, STRUCTURE, OBJECT = 1, 2, 3
NUMBERS = range(6, 16)
"""Classes of arrays that hold numbers."""

KINDS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
DEEPEST = 12
LARGEST = 1 << 31
"""Most bytes that a compressed variable may become."""


def variables(content: bytes) -> Iterator[Any]:
    """Yield the variables of a file.

    Parameters
    ----------
    content : bytes

    Yields
    ------
    list of dict, list, array or None
        The structures of an array of them by field; the cells; the numbers; None for the rest.

    Raises
    ------
    ValueError
        If it is no such file, or damaged.
    """
    mark = content[126:128]
    if len(content) < HEADER or mark not in {b"IM", b"MI"}:
        msg = "it does not begin as a MATLAB 5.0 MAT-file"
        raise ValueError(msg)
    order = "<" if mark == b"IM" else ">"
    try:
        for kind, body in _elements(content[HEADER:], order):
            if kind == COMPRESSED:
                inner = zlib.decompressobj().decompress(body, LARGEST)
                yield from (
                    _matrix(part, order, 0) for what, part in _elements(inner, order) if what == MATRIX
                )
            elif kind == MATRIX:
                yield _matrix(body, order, 0)
    except (struct.error, zlib.error) as error:
        msg = f"it is cut short or damaged: {error}"
        raise ValueError(msg) from error


def _elements(content: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Yield type and body of the data elements that follow each other."""
    place = 0
    while place + 8 <= len(content):
        kind, size = struct.unpack_from(f"{order}II", content, place)
        if kind >> 16:  # a small element: size and type share a word, the body is the next
            kind, size = kind & 0xFFFF, kind >> 16
            yield kind, content[place + 4 : place + 4 + min(size, 4)]
            place += 8
            continue
        if place + 8 + size > len(content):
            msg = f"it is cut short: {size} bytes are promised, {len(content) - place - 8} are left"
            raise ValueError(msg)
        yield kind, content[place + 8 : place + 8 + size]
        place += 8 + (size if kind == COMPRESSED else -(-size // 8) * 8)


def _matrix(content: bytes, order: str, depth: int) -> Any:
    """Return an array."""
    parts = list(_elements(content, order))
    if len(parts) < 3 or depth > DEEPEST:
        return None
    flags, dims, _name, *rest = (body for _, body in parts)
    shape = tuple(np.frombuffer(dims[: len(dims) // 4 * 4], f"{order}i4").tolist())
    kind = struct.unpack_from(f"{order}I", flags)[0] & 0xFF
    if kind in NUMBERS and rest:
        return _numbers(parts[3], shape, order)
    if kind == CELL:
        return [_matrix(body, order, depth + 1) for body in rest]
    if kind == OBJECT:
        rest = rest[1:]
    if kind in {STRUCTURE, OBJECT} and len(rest) >= 2:
        return _structures(rest, order, depth)
    return None


def _numbers(part: tuple[int, bytes], shape: tuple[int, ...], order: str) -> Any:
    """Return an array of numbers, which may be stored in a smaller type than they have."""
    kind, body = part
    if kind not in KINDS:
        return None
    flat = np.frombuffer(body[: len(body) // int(KINDS[kind][1]) * int(KINDS[kind][1])], order + KINDS[kind])
    count = 1
    for side in shape:
        count *= side
    if count != len(flat) or min(shape, default=0) < 0:
        msg = f"an array of shape {shape} has {len(flat)} numbers"
        raise ValueError(msg)
    return flat.reshape(shape, order="F")


def _structures(rest: list[bytes], order: str, depth: int) -> list[dict[str, Any]]:
    """Return the structures of an array, by field."""
    size = struct.unpack_from(f"{order}i", rest[0])[0]
    if size < 1:
        msg = f"the names of fields have {size} letters"
        raise ValueError(msg)
    text = rest[1]
    names = [text[k : k + size].split(b"\0")[0].decode("latin-1") for k in range(0, len(text), size)]
    values = rest[2:]
    if not names:
        return []
    return [
        {name: _matrix(body, order, depth + 1) for name, body in zip(names, values[k:], strict=False)}
        for k in range(0, len(values), len(names))
    ]
