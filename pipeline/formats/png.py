"""Pictures as PNG: a writer of a few lines, and a check of pictures that are given."""

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError, InputMissingError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
KINDS = {3: 2, 4: 6}
"""The PNG colour type of so many channels."""


def packed(pixels: NDArray[np.uint8]) -> bytes:
    """Return a picture as PNG.

    Parameters
    ----------
    pixels : (H, W, 3 or 4) array of uint8
        Red, green, blue and opacity, the top row first.
    """
    height, width, channels = pixels.shape
    head = struct.pack(">IIBBBBB", width, height, 8, KINDS[channels], 0, 0, 0)
    rows = np.zeros((height, 1 + width * channels), dtype=np.uint8)  # each begins with its filter, none
    rows[:, 1:] = pixels.reshape(height, -1)
    content = zlib.compress(rows.tobytes(), 9)
    return SIGNATURE + _chunk(b"IHDR", head) + _chunk(b"IDAT", content) + _chunk(b"IEND", b"")


def read(path: str | os.PathLike[str]) -> bytes:
    """Return the bytes of a PNG file, once it is sure that it is one.

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If it cannot be read, is no PNG, or is damaged.
    """
    file = Path(path)
    if not file.is_file():
        msg = f"{file}: there is no such file; give a PNG picture"
        raise InputMissingError(msg)
    try:
        data = file.read_bytes()
    except OSError as error:
        msg = f"{file}: cannot be read ({error.strerror}); give a PNG picture that may be read"
        raise InputFormatError(msg) from error
    if not data.startswith(SIGNATURE):
        msg = f"{file}: is no PNG picture; save it as PNG"
        raise InputFormatError(msg)
    try:
        chunks = list(_chunks(data))
        zlib.decompress(b"".join(content for kind, content in chunks if kind == b"IDAT"))
        whole = chunks[0][0] == b"IHDR" and chunks[-1][0] == b"IEND"
    except (struct.error, zlib.error, IndexError, ValueError):
        whole = False
    if not whole:
        msg = f"{file}: is a damaged PNG picture; save it anew"
        raise InputFormatError(msg)
    return data


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield kind and content of every chunk.

    Raises
    ------
    ValueError
        If a checksum is wrong.
    """
    at = len(SIGNATURE)
    while at < len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        content = data[at + 8 : at + 8 + length]
        if struct.unpack_from(">I", data, at + 8 + length) != (zlib.crc32(kind + content),):
            raise ValueError
        yield kind, content
        at += 12 + length
