"""From tiles to cells: every point streamed once into all cells whose core and buffer hold it.

A tile is exploded in slices, so that several workers share a large one; each slice leaves a part for
every cell that it met. What a cell's worker reads is gathered from the parts, in the order of tiles and
slices, and from COPC tiles by a query of its own (`gather`).
"""

from __future__ import annotations

import json
import uuid
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.airborne.grid import Cell, GridOptions
from pipeline.cloud.parts import (
    Frame,
    append,
    carry_over,
    finish_part,
    start_part,
)
from pipeline.cloud.tiles import POINTS_AT_ONCE, Tile, chunks
from pipeline.model import Floats
from pipeline.output import write_text

SLICE_POINTS = 40 * POINTS_AT_ONCE
"""Points that are exploded by one task: half a minute."""

TEMPORARY = ".tmp-"


@dataclass(frozen=True)
class Slice:
    """A run of points of a tile."""

    tile: Tile
    number: int

    @property
    def name(self) -> str:
        """Name of its parts: of the tile's content, not of its file."""
        return f"{self.tile.fingerprint[:16]}-{self.number:04d}"

    @property
    def first(self) -> int:
        """Its first point."""
        return self.number * SLICE_POINTS


def slices_of(tile: Tile) -> list[Slice]:
    """Cut a tile into slices; COPC is not exploded."""
    count = 0 if tile.copc else -(-tile.points // SLICE_POINTS)
    return [Slice(tile, number) for number in range(count)]


def part_path(work: Path, cell: Cell, piece: Slice) -> Path:
    """Return where the points that a slice has for a cell are."""
    return work / cell.name / f"{piece.name}.las"


def marker_path(work: Path, piece: Slice) -> Path:
    """Return the file that says that a slice is exploded, and how many points each cell got."""
    return work / "slices" / f"{piece.name}.json"


def explode(
    piece: Slice, cells: Sequence[Cell], grid: GridOptions, frame: Frame, work: Path
) -> dict[str, Any]:
    """Stream the points of a slice into the parts of cells.

    Parameters
    ----------
    piece : Slice
    cells : sequence of Cell
        All of size `grid.core_m`.
    grid : GridOptions
    frame : Frame
        In which the parts are written.
    work : Path
        Folder of parts.

    Returns
    -------
    dict
        ``cells`` {name: points}, zero included, and ``strays``: points outside the extent that the
        tile's header gives. It is written to the slice's marker, too, last of all.
    """
    router = Router(cells, grid)
    temporary = f"{TEMPORARY}{uuid.uuid4().hex}.las"
    counts = np.zeros(len(cells), dtype=np.int64)
    strays = 0
    try:
        for records in chunks(piece.tile, piece.first, SLICE_POINTS):
            carry_over(records, piece.tile.lattice, frame.lattice)
            x, y = frame.lattice.along(0, records), frame.lattice.along(1, records)
            strays += _strays(x, y, piece.tile)
            for number, chosen in router.route(x, y):
                path = work / cells[number].name / temporary
                if not counts[number]:
                    path.parent.mkdir(parents=True, exist_ok=True)
                    start_part(path, frame)
                append(path, records[chosen])
                counts[number] += len(chosen)
        for number in np.flatnonzero(counts).tolist():
            path = work / cells[number].name / temporary
            finish_part(path)
            path.replace(part_path(work, cells[number], piece))
    finally:
        for number in np.flatnonzero(counts).tolist():
            (work / cells[number].name / temporary).unlink(missing_ok=True)
    by_name = {cell.name: count for cell, count in zip(cells, counts.tolist(), strict=True)}
    done = {"cells": by_name, "strays": strays}
    write_text(marker_path(work, piece), json.dumps(done) + "\n")
    return done


def exploded(piece: Slice, cells: Sequence[Cell], work: Path) -> dict[str, Any] | None:
    """Return what `explode` returned earlier, if its parts for these cells are still there."""
    try:
        done: dict[str, Any] = json.loads(marker_path(work, piece).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    for cell in cells:
        count = done["cells"].get(cell.name)
        if count is None or (count and not part_path(work, cell, piece).is_file()):
            return None
    return done


class Router:
    """Finds for every point the cells whose window holds it."""

    def __init__(self, cells: Sequence[Cell], grid: GridOptions) -> None:
        self.core, self.buffer = grid.core_m, grid.buffer_m
        places = np.array([(cell.x0, cell.y0) for cell in cells]) / self.core
        places = np.rint(places).astype(np.int64)
        self.low = places.min(axis=0)
        self.table = np.full(places.max(axis=0) - self.low + 1, -1, dtype=np.int32)
        self.table[tuple((places - self.low).T)] = np.arange(len(cells))

    def route(self, x: Floats, y: Floats) -> Iterator[tuple[int, NDArray[np.int64]]]:
        """Yield number of the cell and positions of its points, for each cell that has some."""
        west, columns = self._first_and_more(x)
        south, rows = self._first_and_more(y)
        for right in range(int(columns.max(initial=-1)) + 1):
            for up in range(int(rows.max(initial=-1)) + 1):
                chosen = np.flatnonzero((columns >= right) & (rows >= up))
                cell = self._numbers(west[chosen] + right, south[chosen] + up)
                yield from _groups(cell, chosen)

    def _first_and_more(self, values: Floats) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
        """Return the first column whose window holds a point, and how many more do."""
        first = np.floor((values - self.buffer) / self.core).astype(np.int32)
        last = np.floor((values + self.buffer) / self.core).astype(np.int32)
        return first, last - first

    def _numbers(self, columns: NDArray[np.int32], rows: NDArray[np.int32]) -> NDArray[np.int32]:
        """Return the number of the cell in each place, -1 where none is wanted."""
        i, j = columns - self.low[0], rows - self.low[1]
        good = (i >= 0) & (j >= 0) & (i < self.table.shape[0]) & (j < self.table.shape[1])
        return np.where(good, self.table[np.where(good, i, 0), np.where(good, j, 0)], np.int32(-1))


def _groups(number: NDArray[np.int32], chosen: NDArray[np.int64]) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """Share out positions by number, those of -1 to nobody; the order within a group stays."""
    if not len(number):
        return
    order = np.argsort(number, kind="stable")
    ordered = number[order]
    starts = np.flatnonzero(np.diff(ordered, prepend=-2))
    for start, end in zip(starts.tolist(), [*starts[1:].tolist(), len(ordered)], strict=True):
        if ordered[start] >= 0:
            yield int(ordered[start]), chosen[order[start:end]]


def _strays(x: Floats, y: Floats, tile: Tile) -> int:
    """Count points outside the extent in the header; a step of the coordinates is no matter."""
    west, south, east, north = tile.extent
    slack = 2 * max(tile.lattice.scales[:2])
    good = (x >= west - slack) & (x <= east + slack) & (y >= south - slack) & (y <= north + slack)
    return len(x) - int(good.sum())
