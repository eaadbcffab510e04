"""Arrow, which the extra `batch` brings, and points as its columns of well-known binary."""

from __future__ import annotations

from importlib import import_module
from typing import Any

import numpy as np

from pipeline.errors import InputFormatError, MissingExtraError
from pipeline.model import Floats

POINT_BYTES = 29
"""A point of three coordinates: byte order, kind, x, y, z."""

_POINT = np.dtype([("order", "u1"), ("kind", "<u4"), ("xyz", "<f8", 3)])


def arrow(module: str = "pyarrow") -> Any:
    """Return pyarrow or one of its modules.

    Raises
    ------
    MissingExtraError
        If it is not installed.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        msg = "tables of trees need pyarrow; install it with `pip install 'treepipe[batch]'`"
        raise MissingExtraError(msg) from error


def points_wkb(points: Floats) -> Any:
    """Return points (N, 3) as an Arrow array of well-known binary.

    Examples
    --------
    >>> column = points_wkb(np.array([[1.0, 2.0, 3.0]]))
    >>> points_of(column).tolist()
    [[1.0, 2.0, 3.0]]
    """
    held = np.empty(len(points), dtype=_POINT)
    held["order"], held["kind"], held["xyz"] = 1, 1001, points
    pa = arrow()
    ends = np.arange(len(points) + 1, dtype=np.int32) * POINT_BYTES
    buffers = [None, pa.py_buffer(ends.tobytes()), pa.py_buffer(held.tobytes())]
    return pa.Array.from_buffers(pa.binary(), len(points), buffers)


def points_of(column: Any) -> Floats:
    """Return the (N, 3) coordinates of a column of points, without those that are missing.

    Raises
    ------
    InputFormatError
        If there is anything else than points of three coordinates in little-endian order.
    """
    blobs = b"".join(blob for blob in column.drop_null().to_pylist())
    held = np.frombuffer(blobs, dtype=_POINT) if len(blobs) % POINT_BYTES == 0 else np.empty(0, _POINT)
    missing = len(column) - column.null_count - len(held)
    # 1001 is the ISO number of a point with heights, the other one that of PostGIS
    if missing or not ((held["order"] == 1) & np.isin(held["kind"], (1001, 0x80000001))).all():
        msg = "a geometry is no POINT Z in little-endian well-known binary; write the points anew"
        raise InputFormatError(msg)
    return np.asarray(held["xyz"], dtype=np.float64).reshape(-1, 3)
