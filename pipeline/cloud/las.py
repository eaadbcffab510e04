"""LAS and LAZ files, in and out; the only file that knows laspy.

Coordinates are taken from the stored integers: ``X * scale + (offset - origin)``, never by way of a
large float. A file that we wrote carries the cloud's metadata as JSON in a record of its own.

References
----------
ASPRS (2019). LAS Specification 1.4 - R15.
"""

from __future__ import annotations

import datetime
import struct
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import laspy
import numpy as np
from laspy.errors import LaspyException
from laspy.vlrs.known import WktCoordinateSystemVlr
from lazrs import LazrsError
from numpy.typing import NDArray
from pyproj import CRS
from pyproj.exceptions import CRSError

from pipeline.cloud.damaged import damaged
from pipeline.cloud.local import whole_metres_below
from pipeline.cloud.notes import notes_from_json, notes_to_json
from pipeline.cloud.units import strange_unit
from pipeline.errors import OutputError
from pipeline.model import Floats, PointCloud

KEPT = ("classification", "intensity", "return_number", "number_of_returns", "withheld")
TAKEN = frozenset("XYZxyz")
SCALE_M = 1e-7
USER_ID = "treepipe"
FIRST_RECORD = 1
RECORD_BYTES = 65535
VLR_HEADER_BYTES, EVLR_HEADER_BYTES = 54, 60
CREATION_DATE = datetime.date(2000, 1, 1)
POINTS_AT_ONCE = 1_000_000  # keeps memory low, and a wrong count in the header from asking for all of it

# What laspy 2.7 and lazrs 0.8 raise on files cut short or with bytes changed, found by trying.
BROKEN = (
    LaspyException, LazrsError, ValueError, struct.error, EOFError, LookupError, OverflowError, MemoryError,
)  # fmt: skip

Columns = dict[str, NDArray[Any]]


def read(path: Path) -> PointCloud:
    """Read a LAS or LAZ file of any point format, COPC included.

    The standard attributes in `KEPT` and all extra dimensions are kept; of several extra dimensions
    with the same name the later ones are numbered (``deviation``, ``deviation_2``).

    Raises
    ------
    InputFormatError
        If the file breaks off or is not a LAS file.
    """
    try:
        _check_header(path)
        with laspy.open(path) as reader:
            _number_twins(reader.header.point_format)
            columns = _columns(reader)
            header = reader.header
            notes = notes_from_json(_record(header), header.point_count)
            crs, unit = _crs(header)
    except BROKEN as error:
        raise damaged(path, "LAS or LAZ file", error) from error
    found = len(columns["X"])
    if found != header.point_count:
        raise damaged(path, "LAS or LAZ file", f"{found} of {header.point_count} points found")
    if notes is None:
        strange = {"unit": unit} if unit else {}
        return replace(_placed(header, columns, None), crs=crs, metadata=strange)
    columns |= {name: columns[name].astype(bool) for name in notes.truths if name in columns}
    columns = {name: columns[name] for name in ("X", "Y", "Z", *notes.attributes) if name in columns}
    return replace(_placed(header, columns, header.offsets), crs=crs, metadata=notes.metadata)


def _check_header(path: Path) -> None:
    """Refuse a header whose records cannot lie in the file; laspy would look for them for minutes."""
    size = path.stat().st_size
    with path.open("rb") as stream:
        head = stream.read(247).ljust(247, b"\0")
    length, points_at, records = struct.unpack_from("<HII", head, 94)
    extended_at, extended = struct.unpack_from("<QI", head, 235) if head[25] >= 4 else (0, 0)
    room = length + records * VLR_HEADER_BYTES
    if head[:4] == b"LASF" and (room > points_at or points_at > size):
        msg = f"{records} records do not fit before the points"
        raise LaspyException(msg)
    if extended and extended_at + extended * EVLR_HEADER_BYTES > size:
        msg = f"{extended} extended records do not fit behind the points"
        raise LaspyException(msg)


def _number_twins(point_format: laspy.PointFormat) -> None:
    """Rename extra dimensions whose name is taken, which numpy would refuse as fields."""
    seen: Counter[str] = Counter()
    for i, dimension in enumerate(point_format.dimensions):
        seen[dimension.name] += 1
        if seen[dimension.name] > 1:
            name = f"{dimension.name}_{seen[dimension.name]}"
            point_format.dimensions[i] = dimension._replace(name=name)


def _columns(reader: laspy.LasReader) -> Columns:
    """Read the stored integers X, Y, Z, the kept attributes and the extra dimensions."""
    names = ("X", "Y", "Z", *KEPT, *reader.header.point_format.extra_dimension_names)
    chunks = [
        {name: np.array(chunk[name]) for name in names} for chunk in reader.chunk_iterator(POINTS_AT_ONCE)
    ]
    if not chunks:
        return {name: np.empty(0, np.int32) for name in names}
    columns = {name: np.concatenate([chunk[name] for chunk in chunks]) for name in names}
    return columns | {"withheld": columns["withheld"].astype(bool)}


def _placed(header: laspy.LasHeader, columns: Columns, origin: Floats | None) -> PointCloud:
    """Turn the stored integers into a cloud around `origin`, or around one of whole metres."""
    stored = [columns.pop(axis) for axis in "XYZ"]
    if origin is None:
        low = [values.min(initial=2**31 - 1) for values in stored]
        origin = whole_metres_below((np.array(low) * header.scales + header.offsets)[np.newaxis])
    shift = header.offsets - origin
    xyz = np.column_stack([_scaled(v, s) + d for v, s, d in zip(stored, header.scales, shift, strict=True)])
    return PointCloud(xyz, origin, attributes=columns)


def _scaled(stored: NDArray[np.int32], scale: float) -> Floats:
    """Stored integers in metres; decimal scales divide, so that 0.1 is the number nearest to 0.1."""
    parts = float(round(1.0 / scale)) if scale > 0 else 0.0
    if parts > 0 and abs(parts * scale - 1.0) < 1e-12:
        return np.asarray(stored / parts)
    return np.asarray(stored * scale)


def _crs(header: laspy.LasHeader) -> tuple[str | None, str | None]:
    """Return "EPSG:N", of the horizontal part where the whole has no code, and a unit other than metres."""
    try:
        crs = header.parse_crs()
    except CRSError:
        return None, None
    if crs is None:
        return None, None
    codes = (part.to_epsg() for part in (crs, *crs.sub_crs_list))
    return next((f"EPSG:{code}" for code in codes if code is not None), None), strange_unit(crs)


def _record(header: laspy.LasHeader) -> bytes:
    """Return the bytes of our own records, joined in order; empty where there are none."""
    ours = [vlr for vlr in header.vlrs if vlr.user_id == USER_ID and vlr.record_id >= FIRST_RECORD]
    return b"".join(vlr.record_data for vlr in sorted(ours, key=lambda vlr: int(vlr.record_id)))


def write(cloud: PointCloud, path: Path, *, compressed: bool) -> None:
    """Write LAS 1.4, point format 6, with fixed dates and names: the same cloud gives the same bytes.

    Coordinates are stored to `SCALE_M` around the cloud's origin (a power of ten coarser where the
    cloud is too large for that); attributes that LAS does not know become extra dimensions.

    Raises
    ------
    OutputError
        If a point is not finite, an attribute does not fit, or the CRS is unknown.
    OSError
        If the disk does not take the file.
    """
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.creation_date = CREATION_DATE
    header.generating_software = header.system_identifier = USER_ID
    header.global_encoding.wkt = True
    header.offsets = np.array(cloud.origin)
    header.scales = np.full(3, _scale(cloud, path))
    header.vlrs.extend(_vlrs(cloud, path))
    extra = set(cloud.attributes) - (set(header.point_format.standard_dimension_names) - set("XYZ"))
    header.add_extra_dims([_extra_dim(name, cloud.attributes[name], path) for name in sorted(extra)])
    las = laspy.LasData(header)
    stored = np.rint(cloud.xyz / header.scales).astype(np.int32)
    las.X, las.Y, las.Z = stored.T
    for name, values in sorted(cloud.attributes.items()):
        las[name] = values if name in extra else _fitting(name, values, path)
    try:
        with path.open("wb") as stream:
            las.write(stream, do_compress=compressed)
    except LazrsError as error:  # what the system said to the compressor does not reach us
        msg = "the compressor could not write; the disk may be full"
        raise OSError(msg) from error


def _scale(cloud: PointCloud, path: Path) -> float:
    """Return the finest power of ten from `SCALE_M` up in which all coordinates fit 32 bits."""
    if not np.isfinite(cloud.xyz).all():
        msg = f"{path}: the cloud has points that are not finite; clean it before writing"
        raise OutputError(msg)
    reach = np.abs(cloud.xyz).max(initial=0.0) / (2**31 - 1)
    return float(SCALE_M if reach <= SCALE_M else 10.0 ** np.ceil(np.log10(reach)))


def _vlrs(cloud: PointCloud, path: Path) -> list[Any]:
    """Return the records that hold the CRS, if any, and our notes in pieces that fit a record."""
    notes = notes_to_json(cloud)
    pieces = [notes[i : i + RECORD_BYTES] for i in range(0, len(notes), RECORD_BYTES)]
    ours = [laspy.VLR(USER_ID, FIRST_RECORD + i, "metadata as JSON", piece) for i, piece in enumerate(pieces)]
    if cloud.crs is None:
        return ours
    try:
        wkt = CRS.from_user_input(cloud.crs).to_wkt("WKT1_GDAL")
    except CRSError as error:
        msg = f"{path}: the CRS {cloud.crs!r} is not known; give it as EPSG:N"
        raise OutputError(msg) from error
    return [WktCoordinateSystemVlr(wkt), *ours]


def _extra_dim(name: str, values: NDArray[Any], path: Path) -> laspy.ExtraBytesParams:
    """Describe an attribute as an extra dimension: numbers, one to three a point."""
    kind = np.dtype(np.uint8) if values.dtype == bool else values.dtype
    width = int(np.prod(values.shape[1:], dtype=int))
    number = kind.kind in "iuf" and kind.itemsize <= 8 and values.ndim <= 2 and 1 <= width <= 3
    if not number or len(name.encode()) > 32 or name in TAKEN:
        msg = (
            f"{path}: the attribute {name!r} ({kind}, {width} a point) does not fit a LAS file; "
            "leave it out, or give it one to three numbers a point and a name of at most 32 letters"
        )
        raise OutputError(msg)
    kind = np.dtype(np.float32) if kind == np.float16 else kind
    return laspy.ExtraBytesParams(name, f"{width}{kind.str[1:]}" if width > 1 else kind)


def _fitting(name: str, values: NDArray[Any], path: Path) -> NDArray[Any]:
    """Return a standard attribute as it is, if it is whole and in the range of LAS."""
    bits = {"classification": 8, "intensity": 16, "return_number": 4, "number_of_returns": 4, "withheld": 1}
    top = 2 ** bits.get(name, 64) - 1
    if values.ndim != 1 or (name in bits and not ((values >= 0) & (values <= top) & (values % 1 == 0)).all()):
        msg = f"{path}: attribute {name!r} must be whole numbers from 0 to {top}; rename or scale it"
        raise OutputError(msg)
    return values
