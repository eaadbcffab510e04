"""What a run consists of: which tiles, which cells, in which reference system, and under which hashes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from pipeline.airborne.grid import Cell, GridOptions, Window, can_split, cells_over, split
from pipeline.batch.area import Area
from pipeline.batch.reference import Reference, reference_of
from pipeline.cloud.parts import Frame, Lattice, Triple, common_lattice
from pipeline.cloud.tiles import Tile, read_tile
from pipeline.errors import InputFormatError, InputMissingError, PipelineError, UsageError

TILE_SUFFIXES = (".las", ".laz")

WIDEST_M = 100_000.0
"""No tile is wider; a header that says so is damaged."""


class NoTileError(PipelineError, ValueError):
    """Not one tile can be read; `failures` says why, tile by tile."""

    def __init__(self, failures: Mapping[str, str]) -> None:
        super().__init__("; ".join(failures.values()))
        self.failures = dict(failures)


@dataclass(frozen=True, eq=False)
class Plan:
    """All that a run shall do.

    Parameters
    ----------
    tiles : tuple of Tile
        By west, south and content.
    reference : Reference
    grid : GridOptions
    cells : tuple of Cell
        By x, then y; none of them split yet.
    input_hash : str
        Of the tiles' content, in any order, and of what else tells which trees are made.
    config_hash : str
    failures : dict of str to str
        Tiles that cannot be read, with the reason.
    warnings : tuple of str
    only : Cell, optional
        The one cell that is asked for.
    """

    tiles: tuple[Tile, ...]
    reference: Reference
    grid: GridOptions
    cells: tuple[Cell, ...]
    input_hash: str
    config_hash: str
    failures: Mapping[str, str]
    warnings: tuple[str, ...] = ()
    only: Cell | None = None

    @cached_property
    def frame(self) -> Frame:
        """What the points of all tiles share once they are exploded."""
        return Frame(_lattice(self.tiles), self.reference.wkt, all(tile.standard_time for tile in self.tiles))

    @cached_property
    def feeders(self) -> dict[Cell, tuple[int, ...]]:
        """For each cell the tiles whose extent meets its window, by number."""
        wanted = {cell: list[int]() for cell in self.cells}
        for number, tile in enumerate(self.tiles):
            for cell in cells_over(_grown(tile.extent, self.grid.buffer_m), self.grid):
                if cell in wanted:
                    wanted[cell].append(number)
        return {cell: tuple(numbers) for cell, numbers in wanted.items()}

    @property
    def points(self) -> float:
        """Points in the cells' cores, as far as headers tell: as if tiles were evenly dense."""
        return sum(_share(tile, cell.core) for cell in self.cells for tile in self._tiles_of(cell))

    @property
    def buffered_points(self) -> float:
        """Points in the cells' windows, as far as headers tell."""
        window = self.grid.buffer_m
        return sum(_share(tile, cell.window(window)) for cell in self.cells for tile in self._tiles_of(cell))

    @property
    def hectares(self) -> float:
        """Area of the tiles in the cells' cores, as far as headers tell."""
        shares = (
            _share(tile, cell.core) / tile.points * _hectares(tile)
            for cell in self.cells
            for tile in self._tiles_of(cell)
        )
        return sum(shares)

    def restricted(self, name: str) -> Plan:
        """Return a plan of one cell, or of a quarter of one.

        Raises
        ------
        UsageError
            If the name is of no cell of this plan.
        """
        only = Cell.named(name)
        if not any(_is_part(only, cell) for cell in self.cells):
            msg = (
                f"--only {name}: is no cell of these tiles; `treepipe batch TILE... --dry-run -v` lists them"
            )
            raise UsageError(msg)
        return replace(self, only=only)

    def _tiles_of(self, cell: Cell) -> Iterable[Tile]:
        return (self.tiles[number] for number in self.feeders[cell])


def make_plan(
    paths: Sequence[Path],
    grid: GridOptions,
    *,
    config_hash: str,
    crs: str | None = None,
    area: Callable[[str], Area] | None = None,
    extra: Mapping[str, str] | None = None,
) -> Plan:
    """Read the headers of all tiles and lay the cells.

    Parameters
    ----------
    paths : sequence of Path
        LAS and LAZ files of any point format, COPC included, and folders of them.
    grid : GridOptions
    config_hash : str
    crs : str, optional
        Reference system of tiles that name none.
    area : callable, optional
        Gives the area that is asked for in a reference system.
    extra : mapping of str to str, optional
        What else belongs to the input: names, and hashes of contents.

    Raises
    ------
    UsageError
        If a file is no tile by its name, or tiles are not in metres or in different systems.
    NoTileError
        If no tile can be read.
    """
    tiles, failures, warnings = _read_all(find_tiles(paths))
    if not tiles:
        raise NoTileError(failures)
    reference = reference_of(tiles, crs)
    where = area(reference.crs) if area else None
    cells = sorted({cell for tile in tiles for cell in cells_over(tile.extent, grid)})
    told = {**(extra or {}), "crs": reference.crs} | ({"area": where.text} if where else {})
    plan = Plan(
        tiles=tiles,
        reference=reference,
        grid=grid,
        cells=tuple(cell for cell in cells if where is None or where.meets(cell)),
        input_hash=_input_hash(tiles, told),
        config_hash=config_hash,
        failures=failures,
        warnings=(*warnings, *reference.warnings),
    )
    if not plan.cells:
        msg = f"{tiles[0].path}: no tile has a part in the area that is asked for; check --bbox or --aoi"
        raise UsageError(msg)
    return plan


def _is_part(only: Cell, cell: Cell) -> bool:
    """Return whether a cell is another one, a quarter of it, a quarter of that, and so on."""
    while cell != only and can_split(cell) and cell.covers(only):
        cell = next((quarter for quarter in split(cell) if quarter.covers(only)), only)
        if not cell.covers(only):
            return False
    return cell == only


def find_tiles(paths: Iterable[Path]) -> list[Path]:
    """Return the files that are meant, those of a folder by name.

    Raises
    ------
    UsageError
        If a file that exists is no LAS or LAZ file by its name.
    """
    files: list[Path] = []
    for path in paths:
        if path.is_dir():
            inside = sorted(file for file in path.iterdir() if file.suffix.lower() in TILE_SUFFIXES)
            files += [file for file in inside if not file.name.startswith(".")] or [path]
        elif path.exists() and path.suffix.lower() not in TILE_SUFFIXES:
            msg = f"{path}: the suffix {path.suffix!r} is not one of a tile; convert it to .laz or .las"
            raise UsageError(msg)
        else:
            files.append(path)
    return files


def _read_all(paths: Iterable[Path]) -> tuple[tuple[Tile, ...], dict[str, str], list[str]]:
    """Read all headers; what cannot be read is a failure, what is there twice is left out."""
    by_content: dict[str, Tile] = {}
    failures: dict[str, str] = {}
    warnings: list[str] = []
    for path in paths:
        try:
            tile = _plausible(read_tile(_no_folder(path)))
        except PipelineError as error:
            failures[str(path)] = " ".join(str(error).split())
            continue
        twin = by_content.setdefault(tile.fingerprint, tile)
        if twin is not tile:
            warnings.append(f"{path}: holds the same as {twin.path}; it is left out")
    order = sorted(by_content.values(), key=lambda tile: (tile.low, tile.high, tile.fingerprint))
    return tuple(order), failures, warnings


def _plausible(tile: Tile) -> Tile:
    """Refuse an extent that no tile has; workers elsewhere need the whole path."""
    west, south, east, north = tile.extent
    if not (0 <= east - west < WIDEST_M and 0 <= north - south < WIDEST_M):
        msg = (
            f"{tile.path}: its header gives an extent of {east - west:g} x {north - south:g}; "
            "write the tile again to mend its header"
        )
        raise InputFormatError(msg)
    return replace(tile, path=tile.path.absolute())


def _no_folder(path: Path) -> Path:
    if path.is_dir():
        msg = f"{path}: no tiles are in this folder; give one that holds .laz or .las files"
        raise InputMissingError(msg)
    return path


def _input_hash(tiles: Iterable[Tile], told: Mapping[str, str]) -> str:
    content = {"tiles": sorted(tile.fingerprint for tile in tiles), **told}
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _lattice(tiles: Sequence[Tile]) -> Lattice:
    low: Triple = _ends([tile.low for tile in tiles], min)
    high: Triple = _ends([tile.high for tile in tiles], max)
    return common_lattice([tile.lattice for tile in tiles], low, high)


def _ends(corners: Sequence[Triple], end: Callable[[Iterable[float]], float]) -> Triple:
    x, y, z = (end(corner[axis] for corner in corners) for axis in range(3))
    return x, y, z


def _grown(extent: Window, by: float) -> Window:
    west, south, east, north = extent
    return west - by, south - by, east + by, north + by


def _hectares(tile: Tile) -> float:
    west, south, east, north = tile.extent
    return (east - west) * (north - south) / 1e4


def _share(tile: Tile, window: Window) -> float:
    """Return how many points of a tile are in a window, if they are spread evenly."""
    west, south, east, north = tile.extent
    wide = (min(east, window[2]) - max(west, window[0])) / max(east - west, 1e-9)
    high = (min(north, window[3]) - max(south, window[1])) / max(north - south, 1e-9)
    return tile.points * max(wide, 0.0) * max(high, 0.0)
