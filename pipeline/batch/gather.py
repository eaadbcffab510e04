"""The points of one cell: from the parts that its tiles were exploded into, and from COPC tiles."""

from __future__ import annotations

import uuid
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.airborne.grid import Cell, Window, inside
from pipeline.batch.explode import TEMPORARY
from pipeline.cloud.parts import (
    Frame,
    Lattice,
    Records,
    append,
    carry_over,
    finish_part,
    open_part,
    start_part,
)
from pipeline.cloud.tiles import Tile, query


@dataclass(frozen=True)
class Sources:
    """Where the points of a cell come from.

    Parameters
    ----------
    tiles : tuple of Tile
        Those that meet its window, in order.
    parts : tuple of tuple of Path
        For each tile the parts of its slices; empty for COPC.
    frame : Frame
    whole : bool
        Whether the parts are those of this very cell, not of one that it is a quarter of.
    """

    tiles: tuple[Tile, ...]
    parts: tuple[tuple[Path, ...], ...]
    frame: Frame
    whole: bool


@dataclass(frozen=True)
class Gathered:
    """The points of a cell: their file, and how many they are."""

    path: Path
    points: int


def gather(sources: Sources, cell: Cell, buffer_m: float, target: Path) -> Gathered:
    """Bring the points of a cell into one file.

    Points that several tiles share (the same coordinates and time) are taken once, from the first.

    Parameters
    ----------
    sources : Sources
    cell : Cell
    buffer_m : float
    target : Path
        Written, unless there is a part that is just what is needed.
    """
    parts = [path for parts in sources.parts for path in parts]
    if sources.whole and len(parts) == 1 and not any(tile.copc for tile in sources.tiles):
        return Gathered(parts[0], open_part(parts[0]).count)
    temporary = target.with_name(f"{TEMPORARY}{uuid.uuid4().hex}.las")
    temporary.parent.mkdir(parents=True, exist_ok=True)
    try:
        start_part(temporary, sources.frame)
        for records in _deduplicated(sources, cell.window(buffer_m)):
            append(temporary, records)
        finish_part(temporary)
        temporary.replace(target)
    finally:
        temporary.unlink(missing_ok=True)
    return Gathered(target, open_part(target).count)


def _deduplicated(sources: Sources, window: Window) -> Iterator[Records]:
    """Yield the points in a window, tile by tile, without those that an earlier tile had."""
    seen: list[tuple[Window, Records]] = []
    for number, tile in enumerate(sources.tiles):
        later = [_overlap(tile, other, window) for other in sources.tiles[number + 1 :]]
        mine: list[tuple[Window, Records]] = []
        for records in _in_window(sources, number, window):
            fresh = records
            for overlap, keys in seen:
                near = _inside(fresh, sources.frame.lattice, overlap)
                fresh = fresh[~_among(fresh, near, keys)]
            yield fresh
            mine += [
                (overlap, records[_inside(records, sources.frame.lattice, overlap)])
                for overlap in later
                if overlap is not None
            ]
        seen += mine  # what the tiles to come may hold once more; an overlap is small


def _in_window(sources: Sources, number: int, window: Window) -> Iterator[Records]:
    """Yield the points of one tile in a window."""
    tile, lattice = sources.tiles[number], sources.frame.lattice
    if tile.copc:
        records = query(tile, window)
        carry_over(records, tile.lattice, lattice)
        yield records[_inside(records, lattice, window)]
    for path in sources.parts[number]:
        for piece in open_part(path).pieces():
            yield piece if sources.whole else piece[_inside(piece, lattice, window)]


def _overlap(tile: Tile, other: Tile, window: Window) -> Window | None:
    """Return the part of a window that two tiles share, a little wider; None where there is none."""
    low = np.max([tile.extent[:2], other.extent[:2], window[:2]], axis=0)
    high = np.min([tile.extent[2:], other.extent[2:], window[2:]], axis=0)
    if (low > high).any():
        return None
    (west, south), (east, north) = (low - 0.01).tolist(), (high + 0.01).tolist()
    return west, south, east, north


def _among(records: Records, near: NDArray[np.bool_], keys: Records) -> NDArray[np.bool_]:
    """Return which records have the coordinates and time of one of `keys`; only `near` ones can."""
    found = np.zeros(len(records), dtype=bool)
    places = np.flatnonzero(near)
    if not len(places) or not len(keys):
        return found
    both = np.concatenate([keys, records[places]])
    columns = [both[name] for name in ("X", "Y", "Z", "gps_time")]
    order = np.lexsort(columns)
    change = np.any([np.diff(column[order]) != 0 for column in columns], axis=0)
    group = np.empty(len(both), dtype=np.int64)
    group[order] = np.concatenate([[0], np.cumsum(change)])
    known = np.zeros(len(both), dtype=bool)
    known[group[: len(keys)]] = True
    found[places] = known[group[len(keys) :]]
    return found


def _inside(records: Records, lattice: Lattice, window: Window) -> NDArray[np.bool_]:
    xy = np.column_stack([lattice.along(0, records), lattice.along(1, records)])
    return inside(window, xy)
