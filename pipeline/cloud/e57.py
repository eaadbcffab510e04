"""E57, the exchange format of terrestrial scanners: all scans of a file in their common frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.cloud.damaged import damaged
from pipeline.cloud.local import localise
from pipeline.errors import MissingExtraError
from pipeline.model import Floats, PointCloud

_AXES = ("cartesianX", "cartesianY", "cartesianZ")


def read(path: Path) -> PointCloud:
    """Read the points of all scans of an E57 file.

    Raises
    ------
    MissingExtraError
        If the optional package pye57 is not installed.
    InputFormatError
        If the file is damaged.
    """
    try:
        import pye57  # noqa: PLC0415  an optional package
    except ImportError as error:
        msg = f'{path}: reading .e57 needs the package pye57; pip install "treepipe[e57]"'
        raise MissingExtraError(msg) from error
    try:
        file = pye57.E57(str(path))
        scans = [_scan(file.read_scan(i, ignore_missing_fields=True)) for i in range(file.scan_count)]
    except (pye57.libe57.E57Exception, ValueError, KeyError, RuntimeError) as error:
        raise damaged(path, "E57 file", error) from error
    return localise(np.concatenate([np.empty((0, 3)), *scans]))


def _scan(columns: dict[str, Floats]) -> Floats:
    """Put the coordinates of one scan side by side: (P, 3)."""
    return np.column_stack([np.asarray(columns[axis], dtype=np.float64) for axis in _AXES])
