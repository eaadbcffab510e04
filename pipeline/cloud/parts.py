"""The points of one cell in a plain LAS file of point format 6: written piece by piece, read at once.

The stored integers are those of the tile. On reading, coordinates are snapped to `SNAP_M` around an
origin of whole metres: they and their differences are then exact in float64 wherever the origin is,
so that what is computed for a tree does not depend on the cell that it is read with.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError
from pipeline.model import Floats, PointCloud

SNAP_M = 2.0**-12
"""Step of all coordinates, 0.24 mm; a power of two, so that sums of them are exact."""

RECORD = np.dtype(
    [
        ("X", "<i4"), ("Y", "<i4"), ("Z", "<i4"), ("intensity", "<u2"), ("bit_fields", "u1"),
        ("classification_flags", "u1"), ("classification", "u1"), ("user_data", "u1"),
        ("scan_angle", "<i2"), ("point_source_id", "<u2"), ("gps_time", "<f8"),
    ]
)  # fmt: skip
"""Point format 6 of LAS 1.4, 30 bytes."""

ATTRIBUTES = {
    "classification": np.uint8, "intensity": np.uint16, "return_number": np.uint8,
    "number_of_returns": np.uint8, "withheld": np.bool_, "gps_time": np.float64,
}  # fmt: skip
"""What a cloud of a cell has beside its coordinates."""

WITHHELD = 4
"""Bit of `classification_flags`."""

HEADER = struct.Struct("<4sHHIHH8sBB32s32sHHHIIBHI5I3d3d6dQQIQ15Q")
HEADER_COUNT = 39
"""Place of the number of points among the values of `HEADER`."""

VLR_HEADER = struct.Struct("<H16sHH32s")
WKT_RECORD = 2112
STANDARD_TIME, WKT = 1, 16  # bits of the global encoding

Records = NDArray[Any]
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Lattice:
    """How stored integers become metres: ``X * scale + offset`` on each axis."""

    scales: Triple
    offsets: Triple

    def world(self, records: Records) -> Floats:
        """Return the (P, 3) coordinates of records, snapped to `SNAP_M`."""
        return np.column_stack([self.along(axis, records) for axis in range(3)])

    def along(self, axis: int, records: Records) -> Floats:
        """Return the coordinates on one axis, snapped to `SNAP_M`.

        Decimal scales divide, so that 0.1 is the number nearest to 0.1.
        """
        scale, stored = self.scales[axis], records["XYZ"[axis]]
        parts = float(round(1.0 / scale)) if scale > 0 else 0.0
        decimal = parts > 0 and abs(parts * scale - 1.0) < 1e-12
        metres = (stored / parts if decimal else stored * scale) + self.offsets[axis]
        return np.asarray(np.rint(metres / SNAP_M) * SNAP_M)


@dataclass(frozen=True)
class Frame:
    """What all points of a run share: their lattice, reference system and kind of time."""

    lattice: Lattice
    wkt: str = ""
    standard_time: bool = False
    """Whether `gps_time` is adjusted standard time (seconds since 1980 less 1e9), not that of the week."""


def start_part(path: Path, frame: Frame) -> None:
    """Begin a file without points."""
    wkt = frame.wkt.encode() + b"\0" if frame.wkt else b""
    record = VLR_HEADER.pack(0, b"LASF_Projection", WKT_RECORD, len(wkt), b"WKT") + wkt if wkt else b""
    encoding = (STANDARD_TIME if frame.standard_time else 0) | WKT
    lattice = (*frame.lattice.scales, *frame.lattice.offsets)
    numbers = (0, encoding, 0, 0, 0, bytes(8), 1, 4, b"treepipe", b"treepipe", 1, 2000)
    places = (HEADER.size, HEADER.size + len(record), bool(record), 6, RECORD.itemsize, 0, *[0] * 5)
    path.write_bytes(
        HEADER.pack(b"LASF", *numbers, *places, *lattice, *[0.0] * 6, 0, 0, 0, 0, *[0] * 15) + record
    )


def append(path: Path, records: Records) -> None:
    """Add points; the file is open only meanwhile, so that any number of cells can be written."""
    with path.open("ab") as stream:
        stream.write(records.tobytes())


def finish_part(path: Path) -> None:
    """Write counts and extent into the header."""
    part = open_part(path, finished=False)
    low = np.full(3, np.iinfo(np.int32).max, dtype=np.int64)
    high, returns = -low, np.zeros(16, dtype=np.int64)
    for records in part.pieces():
        low = np.minimum(low, [records[axis].min() for axis in "XYZ"])
        high = np.maximum(high, [records[axis].max() for axis in "XYZ"])
        returns += np.bincount(records["bit_fields"] & 15, minlength=16)
    ends = [0.0] * 6
    if part.count:
        scales, offsets = np.array(part.frame.lattice.scales), np.array(part.frame.lattice.offsets)
        ends = np.column_stack([high * scales + offsets, low * scales + offsets]).ravel().tolist()
    with path.open("r+b") as stream:
        stream.seek(HEADER.size - struct.calcsize("<6dQQIQ15Q"))
        stream.write(struct.pack("<6dQQIQ15Q", *ends, 0, 0, 0, part.count, *returns[1:].tolist()))


@dataclass(frozen=True)
class Part:
    """A file of points: where they begin, how many there are, and their frame."""

    path: Path
    start: int
    count: int
    frame: Frame

    def pieces(self, most: int = 1_000_000) -> Iterator[Records]:
        """Yield the points, some at a time."""
        with self.path.open("rb") as stream:
            stream.seek(self.start)
            for done in range(0, self.count, most):
                yield np.fromfile(stream, RECORD, min(most, self.count - done))

    def records(self) -> Records:
        """Return all points."""
        return np.concatenate([np.empty(0, RECORD), *self.pieces()])


def open_part(path: Path, *, finished: bool = True) -> Part:
    """Read the header of a file of points.

    Raises
    ------
    InputFormatError
        If the file is not one of ours or is cut short.
    """
    with path.open("rb") as stream:
        head = stream.read(HEADER.size)
        values: tuple[Any, ...] = HEADER.unpack(head) if len(head) == HEADER.size else (b"",) * 55
        at = values[14] if values[0] == b"LASF" and values[16:18] == (6, RECORD.itemsize) else 0
        wkt = stream.read(at - HEADER.size)[VLR_HEADER.size :].rstrip(b"\0").decode() if at else ""
    count, rest = divmod(path.stat().st_size - at, RECORD.itemsize)
    if not at or rest or (finished and count != values[HEADER_COUNT]):
        msg = f"{path}: is no whole file of a cell's points; remove it and run the batch again"
        raise InputFormatError(msg)
    lattice = Lattice(values[24:27], values[27:30])
    return Part(path, at, count, Frame(lattice, wkt, bool(values[2] & STANDARD_TIME)))


def read_part(path: Path, *, crs: str | None = None) -> PointCloud:
    """Read the points of a cell.

    Parameters
    ----------
    path : Path
        A file that the batch wrote: plain LAS of point format 6.
    crs : str, optional
        Reference system of the run; the one in the file where None.

    Returns
    -------
    PointCloud
        Snapped to `SNAP_M` around whole metres, with attributes ``classification``, ``intensity``,
        ``return_number``, ``number_of_returns``, ``withheld``, ``gps_time`` and, in the metadata,
        ``gps_time_standard``.

    Raises
    ------
    InputFormatError
        If the file is not one of ours or is cut short.
    """
    part = open_part(path)
    xyz = np.empty((part.count, 3))
    attributes: dict[str, NDArray[Any]] = {
        name: np.empty(part.count, dtype) for name, dtype in ATTRIBUTES.items()
    }
    done, low = 0, np.full(3, np.inf)
    for records in part.pieces():
        here = slice(done, done + len(records))
        xyz[here] = part.frame.lattice.world(records)
        low = np.minimum(low, xyz[here].min(axis=0))
        for name in ("classification", "intensity", "gps_time"):
            attributes[name][here] = records[name]
        attributes["return_number"][here] = records["bit_fields"] & 15
        attributes["number_of_returns"][here] = records["bit_fields"] >> 4
        attributes["withheld"][here] = (records["classification_flags"] & WITHHELD) > 0
        done += len(records)
    origin = np.floor(low) if part.count else np.zeros(3)
    xyz -= origin  # exact: both are multiples of SNAP_M
    metadata = {"gps_time_standard": part.frame.standard_time}
    return PointCloud(xyz, origin, crs or part.frame.wkt or None, attributes, metadata)


def common_lattice(lattices: Sequence[Lattice], low: Triple, high: Triple) -> Lattice:
    """Return the lattice in which the stored integers of all tiles stay what they are.

    That is the finest one of them, if the others fit into it; else one of steps `SNAP_M`, in which
    every coordinate stands as it is read anyway.

    Parameters
    ----------
    lattices : sequence of Lattice
    low, high : tuple of float
        Extent of all tiles, metres.
    """
    if len(set(lattices)) == 1:
        return lattices[0]
    x, y, z = (min(values) for values in zip(*(each.scales for each in lattices), strict=True))
    scales, offsets = (x, y, z), lattices[0].offsets
    finest = Lattice(scales, offsets)
    reach = max(
        abs(end - offset) / scale
        for ends in (low, high)
        for end, offset, scale in zip(ends, offsets, scales, strict=True)
    )
    if reach < 2**31 - 1 and all(steps(each, finest) is not None for each in lattices):
        return finest
    west, south, bottom = (float(np.floor(value)) for value in low)
    return Lattice((SNAP_M, SNAP_M, SNAP_M), (west, south, bottom))


def steps(inner: Lattice, outer: Lattice) -> list[tuple[int, int]] | None:
    """Return factor and shift per axis that carry stored integers over; None where they do not fit."""
    carried = []
    for axis in range(3):
        factor = inner.scales[axis] / outer.scales[axis]
        shift = (inner.offsets[axis] - outer.offsets[axis]) / outer.scales[axis]
        if abs(factor - round(factor)) > 1e-9 * factor or abs(shift - round(shift)) > 1e-4:
            return None
        carried.append((round(factor), round(shift)))
    return carried


def carry_over(records: Records, inner: Lattice, outer: Lattice) -> None:
    """Write the integers of one lattice as those of another, in place."""
    if inner == outer:
        return
    whole = steps(inner, outer)
    for axis, name in enumerate("XYZ"):
        if whole is not None:
            factor, shift = whole[axis]
            records[name] = records[name].astype(np.int64) * factor + shift
        else:
            metres = inner.along(axis, records) - outer.offsets[axis]
            records[name] = np.rint(metres / outer.scales[axis])
