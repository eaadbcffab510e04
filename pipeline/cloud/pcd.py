"""PCD, the format of the Point Cloud Library: ascii, binary and binary_compressed."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from pipeline.cloud.damaged import damaged
from pipeline.cloud.local import localise
from pipeline.errors import InputFormatError
from pipeline.model import PointCloud

_DAMAGE = (ValueError, TypeError, KeyError, IndexError, EOFError, OverflowError, struct.error, RuntimeError)
"""What the parser is known to raise on a damaged file."""


def read(path: Path) -> PointCloud:
    """Read the points of a PCD file.

    Raises
    ------
    InputFormatError
        If the file is damaged or has no fields x, y and z.
    """
    from pypcd4.pypcd4 import PointCloud as Pcd  # noqa: PLC0415  0.4 s to import, for this format alone

    try:
        table = Pcd.from_path(path)
        missing = {"x", "y", "z"} - set(table.fields)
        points = table.numpy(("x", "y", "z")) if not missing else np.empty((0, 3))
        announced = table.metadata.points
    except _DAMAGE as error:
        raise damaged(path, "PCD file", error) from error
    if missing:
        have = ", ".join(table.fields)
        msg = f"{path}: has no x, y and z fields (it has {have}); export it with them"
        raise InputFormatError(msg)
    if len(points) < announced:
        raise damaged(path, "PCD file", f"{len(points)} of {announced} points found")
    return localise(np.asarray(points, dtype=np.float64))
