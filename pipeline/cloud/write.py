"""Writing a point cloud to LAS or LAZ, whole or not at all."""

from __future__ import annotations

import os
from pathlib import Path

from pipeline.cloud import las
from pipeline.errors import UsageError
from pipeline.model import PointCloud
from pipeline.output import whole_file


def write_cloud(cloud: PointCloud, path: str | os.PathLike[str]) -> None:
    """Write a cloud so that `read_cloud` gives the same origin, CRS, attributes and metadata.

    Coordinates keep 0.1 um (less where the cloud reaches beyond 214 m from its origin). The same
    cloud gives the same bytes.

    Parameters
    ----------
    cloud : PointCloud
        Finite points; attributes of one to three numbers a point.
    path : path-like
        A name that ends in .las or .laz; an existing file is replaced.

    Raises
    ------
    UsageError
        If the suffix is neither .las nor .laz.
    OutputError
        If the file cannot be written, or the cloud does not fit one.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in {".las", ".laz"}:
        msg = f"{path}: a cloud cannot be written as {suffix!r}; give a name that ends in .laz or .las"
        raise UsageError(msg)
    with whole_file(path) as temporary:
        las.write(cloud, temporary, compressed=suffix == ".laz")
