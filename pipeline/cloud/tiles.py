"""Airborne tiles, LAS 1.2 to 1.4 of any point format: their headers, and their points in chunks.

A tile is never in memory as a whole: plain LAS and LAZ are streamed, COPC is asked for a window.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import laspy
import numpy as np
from laspy.copc import Bounds, CopcReader
from pyproj import CRS
from pyproj.exceptions import CRSError

from pipeline.cloud.damaged import damaged
from pipeline.cloud.las import BROKEN
from pipeline.cloud.parts import RECORD, Lattice, Records, Triple
from pipeline.errors import InputFormatError, InputMissingError

POINTS_AT_ONCE = 1_000_000
"""Points decoded at a time: about 150 MB with all temporary arrays."""

SINGLE = laspy.LazBackend.Lazrs
"""On one thread: there is a worker on every core."""

_LAYER = laspy.DecompressionSelection
LAYERS = (
    _LAYER.XY_RETURNS_CHANNEL | _LAYER.Z | _LAYER.CLASSIFICATION | _LAYER.FLAGS | _LAYER.INTENSITY
    | _LAYER.SCAN_ANGLE | _LAYER.USER_DATA | _LAYER.POINT_SOURCE_ID | _LAYER.GPS_TIME
)  # fmt: skip
"""What new point formats are decoded of: no colours, no extra dimensions."""

SAMPLE_BYTES, SAMPLES = 65_536, 96
"""A fingerprint reads all of a file of up to 6 MiB, of a larger one this many blocks."""

FINEST_RANK_DEG, RANK_DEG = 0.006, 1.0
"""Steps of the scan angle in new and in old point formats."""

AS_THEY_ARE = ("X", "Y", "Z", "intensity", "user_data", "point_source_id")
FLAGS = {"synthetic": 1, "key_point": 2, "withheld": 4}


@dataclass(frozen=True)
class Tile:
    """What the header of a tile says.

    Parameters
    ----------
    path : Path
    fingerprint : str
        Of the file's content (`fingerprint`).
    points : int
    point_format : int
    low, high : tuple of float
        Extent.
    lattice : Lattice
        Of the stored integers.
    crs : str or None
        ``"EPSG:N"``, of the horizontal part where the whole has no code; WKT where none has; None where the
        file names none.
    units : tuple of str
        Units of its axes, metres left out.
    standard_time : bool
        Whether gps_time is adjusted standard time.
    copc : bool
        Whether the file can be asked for a window.
    size : int
        Bytes.
    """

    path: Path
    fingerprint: str
    points: int
    point_format: int
    low: Triple
    high: Triple
    lattice: Lattice
    crs: str | None
    units: tuple[str, ...]
    standard_time: bool
    copc: bool
    size: int

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """West, south, east and north."""
        return (*self.low[:2], *self.high[:2])


def read_tile(path: Path) -> Tile:
    """Read the header of a tile, and its first point to see that it can be decoded.

    Raises
    ------
    InputMissingError
        If there is no such file or it may not be read.
    InputFormatError
        If it is no LAS file, is cut short, or holds no points.
    """
    try:
        with laspy.open(path, laz_backend=SINGLE) as reader:
            header = reader.header
            count = int(header.point_count)
            found = len(reader.read_points(1)) if count else 0
            tile = _tile(path, header)
    except FileNotFoundError as error:
        msg = f"{path}: there is no such file; check the name and the folder"
        raise InputMissingError(msg) from error
    except BROKEN as error:
        raise damaged(path, "LAS or LAZ tile", error) from error
    except OSError as error:
        msg = f"{path}: cannot be opened ({error.strerror or error}); check the permissions and the disk"
        raise InputMissingError(msg) from error
    if not count:
        msg = f"{path}: holds no points; export the tile again with its points"
        raise InputFormatError(msg)
    least = 0 if header.are_points_compressed else count * header.point_format.size
    if not found or tile.size < header.offset_to_point_data + least:
        raise damaged(path, "LAS or LAZ tile", "it is cut short")
    return tile


def _tile(path: Path, header: laspy.LasHeader) -> Tile:
    crs = _crs(header)
    return Tile(
        path=path,
        fingerprint=fingerprint(path),
        points=int(header.point_count),
        point_format=int(header.point_format.id),
        low=_triple(header.mins),
        high=_triple(header.maxs),
        lattice=Lattice(_triple(header.scales), _triple(header.offsets)),
        crs=_name(crs) if crs is not None else None,
        units=_units(crs) if crs is not None else (),
        standard_time=int(header.global_encoding.gps_time_type) == 1,
        copc=any(vlr.user_id == "copc" and vlr.record_id == 1 for vlr in header.vlrs),
        size=path.stat().st_size,
    )


def _triple(values: Any) -> Triple:
    x, y, z = (float(value) + 0.0 for value in values)  # + 0.0 turns -0 into 0
    return x, y, z


def _crs(header: laspy.LasHeader) -> CRS | None:
    try:
        crs: CRS | None = header.parse_crs()
    except CRSError:
        return None
    return crs


def _name(crs: CRS) -> str:
    codes = [part.to_epsg() for part in (crs, *crs.sub_crs_list)]
    return next((f"EPSG:{code}" for code in codes if code is not None), crs.to_wkt())


def _units(crs: CRS) -> tuple[str, ...]:
    axes = [axis for part in (crs, *crs.sub_crs_list) for axis in part.axis_info]
    return tuple(sorted({axis.unit_name for axis in axes if axis.unit_conversion_factor != 1.0}))


def fingerprint(path: Path) -> str:
    """Return the SHA-256 of a file's size and content; of a large file, of blocks all over it.

    Tiles have gigabytes; reading them once more only to see that they are the same would cost as
    much as decoding them. Every block of a small file is read.
    """
    size = path.stat().st_size
    digest = hashlib.sha256(str(size).encode())
    places = np.linspace(0, max(size - SAMPLE_BYTES, 0), SAMPLES).astype(int)
    whole = size <= SAMPLES * SAMPLE_BYTES
    with path.open("rb") as stream:
        for place in range(0, size, SAMPLE_BYTES) if whole else places.tolist():
            stream.seek(place)
            digest.update(stream.read(SAMPLE_BYTES))
    return digest.hexdigest()


def chunks(tile: Tile, first: int = 0, count: int | None = None) -> Iterator[Records]:
    """Yield points of a tile as `RECORD`, as they are stored, `POINTS_AT_ONCE` at a time.

    Parameters
    ----------
    tile : Tile
    first, count : int
        Which points; all of them where nothing is said.

    Raises
    ------
    InputFormatError
        If the file breaks off or cannot be decoded.
    """
    left = tile.points - first if count is None else min(count, tile.points - first)
    try:
        with laspy.open(tile.path, laz_backend=SINGLE, decompression_selection=LAYERS) as reader:
            reader.seek(first)
            while left > 0:
                points = reader.read_points(min(POINTS_AT_ONCE, left))
                if not len(points):
                    raise damaged(tile.path, "LAS or LAZ tile", f"{left} points are missing at its end")
                left -= len(points)
                yield _records(points)
    except InputFormatError:
        raise
    except BROKEN as error:
        raise damaged(tile.path, "LAS or LAZ tile", error) from error
    except OSError as error:
        msg = f"{tile.path}: cannot be read ({error.strerror or error}); check the disk and the permissions"
        raise InputMissingError(msg) from error


def query(tile: Tile, window: tuple[float, float, float, float]) -> Records:
    """Return the points of a COPC tile around a window: all that are in it, and some beside.

    Raises
    ------
    InputFormatError
        If the file breaks off or cannot be decoded.
    """
    margin = 2 * max(tile.lattice.scales[:2])
    low, high = np.array(window[:2]) - margin, np.array(window[2:]) + margin
    west, south, east, north = tile.extent
    low, high = np.maximum(low, (west, south)), np.minimum(high, (east, north))
    if (low > high).any():
        return np.empty(0, RECORD)
    try:
        with CopcReader.open(str(tile.path), decompression_selection=LAYERS) as reader:
            return _records(reader.query(Bounds(mins=low, maxs=high)))
    except BROKEN as error:
        raise damaged(tile.path, "COPC tile", error) from error


def _records(points: Any) -> Records:
    """Turn points of any format into those of format 6; colours and extra dimensions are left out."""
    names = set(points.point_format.dimension_names)
    if points.point_format.id >= 6:
        return _of_new_format(points.array)
    records = np.zeros(len(points), RECORD)
    for name in AS_THEY_ARE:
        records[name] = points.array[name]
    returns = np.array(points["return_number"]), np.array(points["number_of_returns"])
    records["bit_fields"] = returns[0] | returns[1] << 4
    records["classification"] = points["classification"]
    for name, bit in FLAGS.items():
        records["classification_flags"] |= np.array(points[name], np.uint8) * np.uint8(bit)
    angle = np.array(points["scan_angle_rank"], np.float64) * (RANK_DEG / FINEST_RANK_DEG)
    records["scan_angle"] = np.rint(angle)
    if "gps_time" in names:
        records["gps_time"] = points.array["gps_time"]
    return records


def _of_new_format(stored: Records) -> Records:
    records = np.empty(len(stored), RECORD)
    for name in RECORD.names or ():
        records[name] = stored[name]
    return records
