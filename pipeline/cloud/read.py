"""Reading a point cloud: one registry by suffix, one file a format, the same errors for all."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable
from pathlib import Path

from pipeline.cloud import e57, las, pcd, ply, text
from pipeline.errors import InputFormatError, InputMissingError, UsageError
from pipeline.model import PointCloud

READERS: dict[str, Callable[[Path], PointCloud]] = {
    ".las": las.read,
    ".laz": las.read,
    ".ply": ply.read,
    ".xyz": text.read,
    ".txt": text.read,
    ".csv": text.read,
    ".asc": text.read,
    ".pts": text.read,
    ".pcd": pcd.read,
    ".e57": e57.read,
}
"""Suffix (lower case) to reader. A new format is one new file and one line here."""

CLOUD_SUFFIXES: tuple[str, ...] = (".copc.laz", *READERS)
"""What `read_cloud` takes; longest first, so that the first match gives the stem of a name."""

MODEL_SUFFIXES: tuple[str, ...] = (
    ".skeleton.ply",
    ".mesh.ply",
    ".qsm.csv",
    ".treeqsm.txt",
    ".simpleforest.csv",
    ".treefile.txt",
)
"""Models of trees whose last suffix is that of a cloud."""


def read_cloud(path: str | os.PathLike[str]) -> PointCloud:
    """Read a point cloud; the format is told by the suffix.

    Coordinates are float64 metres relative to a local origin (`PointCloud.origin`): the minimum
    rounded down to whole metres. Rows that are not finite are kept as they are; `clean` drops and
    counts them.

    Parameters
    ----------
    path : path-like
        A ``.las``, ``.laz``, ``.copc.laz``, ``.ply``, ``.xyz``, ``.txt``, ``.csv``, ``.asc``,
        ``.pts``, ``.pcd`` or ``.e57`` file.

    Returns
    -------
    PointCloud
        With `metadata` ``source`` {path, sha256, points} and ``crs_assumed``. A cloud written by
        `write_cloud` comes back with the metadata, origin and CRS that it was written with.

    Raises
    ------
    InputMissingError
        If there is no such file, or it is a directory or may not be read.
    UsageError
        If the suffix is not that of a cloud.
    InputFormatError
        If the file is empty, cut off, corrupt, without points, or something else than a cloud.
    MissingExtraError
        If the format needs an optional package that is not installed.
    """
    file = Path(path)
    reader = _reader(file)
    try:
        if not file.stat().st_size:
            msg = f"{file}: is empty (0 bytes); copy or export it again"
            raise InputFormatError(msg)
        digest = _sha256(file)
        cloud = reader(file)
    except FileNotFoundError as error:
        raise _missing(file) from error
    except OSError as error:
        reason = error.strerror or str(error)
        msg = f"{file}: cannot be opened ({reason}); check the permissions and the disk"
        raise InputMissingError(msg) from error
    if not len(cloud):
        msg = f"{file}: holds no points; export it again with its points"
        raise InputFormatError(msg)
    source = {"path": str(file), "sha256": digest, "points": len(cloud)}
    metadata = {"source": source, "crs_assumed": False, **cloud.metadata}
    return PointCloud(cloud.xyz, cloud.origin, cloud.crs, cloud.attributes, metadata)


def _reader(file: Path) -> Callable[[Path], PointCloud]:
    """Choose the reader by suffix, refusing directories, unknown suffixes and models."""
    if file.is_dir():
        msg = f"{file}: is a directory; give the name of a file in it"
        raise InputMissingError(msg)
    if not file.exists():
        raise _missing(file)
    name = file.name.lower()
    model = next((suffix for suffix in MODEL_SUFFIXES if name.endswith(suffix)), None)
    if model:
        msg = f"{file}: {model} is a model of a tree, not a cloud; see it with `treepipe info`"
        raise InputFormatError(msg)
    reader = READERS.get(file.suffix.lower())
    if reader is None:
        known = " ".join(CLOUD_SUFFIXES)
        msg = f"{file}: {file.suffix or 'no suffix'} is not that of a point cloud; known are {known}"
        raise UsageError(msg)
    return reader


def _missing(file: Path) -> InputMissingError:
    return InputMissingError(f"{file}: there is no such file; check the name and the folder")


def _sha256(file: Path) -> str:
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
