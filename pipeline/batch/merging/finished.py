"""Cells that are done, and their trees in one order: that of their names.

Cells are read in the order of their first tree; what is held is at most twice the rows of cells whose
names interleave, a column of cells from south to north, however many cells there are.
"""

from __future__ import annotations

import json
from bisect import bisect_left, insort
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.airborne.grid import Cell
from pipeline.airborne.inventory import COLUMNS
from pipeline.batch.columns import arrow_schema
from pipeline.errors import InputFormatError, InputMissingError
from pipeline.formats import geoparquet
from pipeline.formats.geoparquet import arrow

TABLE = "trees.parquet"
MANIFEST = "manifest.json"

MOST_TABLES = 500
"""Tables that wait to be put in order: one of a few trees takes 50 kB."""


@dataclass(frozen=True)
class FinishedCell:
    """A cell whose manifest, the last file to be written, is there."""

    cell: Cell
    folder: Path
    manifest: dict[str, Any]

    @property
    def table(self) -> Path:
        """Its trees."""
        return self.folder / TABLE


def finished_cells(out: Path) -> tuple[FinishedCell, ...]:
    """Return the cells of a folder of results that are done, by x, then y.

    Raises
    ------
    InputMissingError
        If there is none.
    InputFormatError
        If a manifest is damaged, or two cells overlap.
    """
    manifests = sorted(out.glob(f"cells/*/{MANIFEST}"))
    if not manifests:
        msg = f"{out}: holds no cell that is done; run `treepipe batch TILE... --out {out}` first"
        raise InputMissingError(msg)
    cells = sorted((_cell(path) for path in manifests), key=lambda one: one.cell)
    for one, other in overlaps(cells):
        msg = (
            f"{other.folder}: lies over {one.folder}, so that its trees would be there twice; "
            "remove the folder of the one that is out of date"
        )
        raise InputFormatError(msg)
    return tuple(cells)


def overlaps(cells: Iterable[FinishedCell]) -> Iterator[tuple[FinishedCell, FinishedCell]]:
    """Yield pairs of cells that lie over each other; an earlier cell is in one pair at most.

    Parameters
    ----------
    cells : iterable of FinishedCell
        By x, then y.

    Notes
    -----
    A line sweeps from west to east. The cells that it crosses lie apart and are kept from south to north,
    so that a new cell is compared with its neighbours only, and not with all of them.
    """
    crossed: list[tuple[float, FinishedCell]] = []
    for one in cells:
        west, south, _, north = one.cell.core
        at = max(0, bisect_left(crossed, south, key=_south) - 1)
        while at < len(crossed) and crossed[at][0] < north:
            other = crossed[at][1]
            if other.cell.core[2] > west and other.cell.core[3] > south:
                yield other, one
            if other.cell.core[2] <= west or other.cell.core[3] > south:
                del crossed[at]
            else:
                at += 1
        insort(crossed, (south, one), key=_south)


def _south(crossed: tuple[float, FinishedCell]) -> float:
    return crossed[0]


def crs_of(cells: Sequence[FinishedCell]) -> str | None:
    """Return the reference system of all cells, None where none of them says one.

    Raises
    ------
    InputFormatError
        If cells are in different systems.
    """
    seen: dict[str, Path] = {}
    for one in cells:
        crs = geoparquet.crs_of(one.table) or one.manifest.get("crs")
        if isinstance(crs, str):
            seen.setdefault(crs, one.table)
    if len(seen) > 1:
        (first, here), (second, there) = list(seen.items())[:2]
        msg = f"{there}: is in {second}, but {here} in {first}; run their tiles to folders of their own"
        raise InputFormatError(msg)
    return next(iter(seen), None)


def trees_in_order(cells: Sequence[FinishedCell]) -> Iterator[Any]:
    """Yield tables with the columns of `COLUMNS`, by tree_id.

    Raises
    ------
    InputFormatError
        If a table is damaged or of another version, or a tree is there twice.
    """
    firsts = sorted((first, one.table) for one in cells if (first := _first(one.table)) is not None)
    waiting: list[Any] = []
    fresh, left, last = 0, 0, None
    for k, (_, path) in enumerate(firsts):
        waiting.append(read_cell(path))
        fresh += len(waiting[-1])
        following = firsts[k + 1][0] if k + 1 < len(firsts) else None
        small = fresh < max(geoparquet.ROW_GROUP, left) and len(waiting) < MOST_TABLES
        if following is not None and small:
            continue  # all that wait are looked through when they have doubled, not with every cell
        ready, rest = _before(arrow().concat_tables(waiting), following)
        waiting, fresh, left = [rest], 0, len(rest)
        if not len(ready):
            continue
        ready = ready.sort_by("tree_id").combine_chunks()
        _check_single(ready["tree_id"].to_pylist(), last, path)
        last = ready["tree_id"][-1].as_py()
        yield ready


def read_cell(path: Path) -> Any:
    """Return the trees of a cell with the columns of `COLUMNS`.

    Raises
    ------
    InputFormatError
        If the table is damaged or of another version.
    """
    table = geoparquet.read(path, [column.name for column in COLUMNS])
    try:
        return table.cast(arrow_schema(COLUMNS))
    except ValueError as error:
        msg = f"{path}: its columns are of other kinds ({error}); run the cell again with this version"
        raise InputFormatError(msg) from error


def _cell(path: Path) -> FinishedCell:
    try:
        manifest = json.loads(path.read_bytes())
    except ValueError as error:
        msg = f"{path}: is no JSON ({error}); remove the cell's folder and run the batch again"
        raise InputFormatError(msg) from error
    if not isinstance(manifest, dict):
        msg = f"{path}: is no manifest; remove the cell's folder and run the batch again"
        raise InputFormatError(msg)
    return FinishedCell(Cell.named(path.parent.name), path.parent, manifest)


def _first(path: Path) -> str | None:
    """Return the first name of a cell's trees, None if it has no tree."""
    names = geoparquet.read(path, ["tree_id"])["tree_id"]
    first: str | None = arrow("pyarrow.compute").min(names).as_py()
    return first


def _before(trees: Any, name: str | None) -> tuple[Any, Any]:
    """Part trees into those before a name and the others; all of them are before None."""
    if name is None:
        return trees, trees.slice(0, 0)
    compute = arrow("pyarrow.compute")
    before = compute.less(trees["tree_id"], name)
    return trees.filter(before), trees.filter(compute.invert(before)).combine_chunks()


def _check_single(names: list[str], last: str | None, path: Path) -> None:
    """Make sure that no name is there twice in a sorted list."""
    for one, following in zip([last, *names], names, strict=False):
        if one == following:
            msg = f"{path}: tree {one} is there twice; remove the cells that have it and run the batch again"
            raise InputFormatError(msg)
