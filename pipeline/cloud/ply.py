"""PLY clouds, ascii or binary; a PLY with edges or faces is a model, not a cloud."""

from __future__ import annotations

import io
import re
import struct
from pathlib import Path

import numpy as np
from plyfile import PlyData, PlyElement, PlyParseError

from pipeline.cloud.damaged import damaged
from pipeline.cloud.local import localise
from pipeline.errors import InputFormatError
from pipeline.model import PointCloud

HEADER_BYTES = 1 << 16
EMPTY_LINES = re.compile(rb"\n\s*\n")
BROKEN = (PlyParseError, ValueError, struct.error, EOFError, LookupError, OverflowError, MemoryError)
MODELS = {
    "edge": "is a skeleton (it has edges); use the cloud that it was made of",
    "face": "is a mesh (it has faces); export its vertices alone, or sample points on it",
}


def read(path: Path) -> PointCloud:
    """Read the vertices of a PLY file; empty lines after the header are forgiven.

    Raises
    ------
    InputFormatError
        If the file breaks off, is no PLY file, or is a skeleton or a mesh.
    """
    try:
        elements = {element.name: element for element in _parsed(path)}
    except BROKEN as error:
        raise damaged(path, "PLY file", error) from error
    for name, what in MODELS.items():
        if name in elements and elements[name].count:
            msg = f"{path}: {what}"
            raise InputFormatError(msg)
    rows = elements["vertex"].data if "vertex" in elements else np.empty(0, [])
    if not {"x", "y", "z"} <= set(rows.dtype.names or ()):
        msg = f"{path}: has no vertex properties x, y and z; rename its properties"
        raise InputFormatError(msg)
    return localise(np.column_stack([rows[axis].astype(np.float64) for axis in "xyz"]))


def _parsed(path: Path) -> list[PlyElement]:
    """Return the elements of the file; only text is read as a whole, to take out empty lines."""
    with path.open("rb") as stream:
        head = stream.read(HEADER_BYTES)
    if b"format ascii" not in head.partition(b"end_header")[0]:
        return list(PlyData.read(str(path)))
    text = path.read_bytes().replace(b"\r\n", b"\n")
    header, end, body = text.partition(b"end_header\n")
    return list(PlyData.read(io.BytesIO(header + end + EMPTY_LINES.sub(b"\n", body).lstrip())))
