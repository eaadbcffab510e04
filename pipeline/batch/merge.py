"""From the cells of a run to what inventories use: one table, GeoPackage, PostGIS, statistics and maps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.batch.columns import arrow_schema, completed, floats
from pipeline.batch.folder import tile_extents
from pipeline.batch.merging import geopackage, maps
from pipeline.batch.merging.areas import of_cells, read_areas, within_cells, within_tiles
from pipeline.batch.merging.database import without_password
from pipeline.batch.merging.fieldlist import Stem, read_stems
from pipeline.batch.merging.finished import TABLE, FinishedCell, crs_of, finished_cells, trees_in_order
from pipeline.batch.merging.postgis import PostgisOptions, load
from pipeline.batch.merging.statistics import Statistics, to_csv, to_json, to_table
from pipeline.batch.merging.stems import Joined, join
from pipeline.formats import geoparquet
from pipeline.output import write_text


def merge(  # noqa: PLR0913 (what the command says, each by its name)
    out: Path,
    *,
    gpkg: Path | None = None,
    postgis: str | None = None,
    stems: Path | None = None,
    areas: Path | None = None,
    into: PostgisOptions | None = None,
    drawn: bool = True,
) -> dict[str, Any]:
    """Merge the cells that are done.

    Parameters
    ----------
    out : Path
        Folder of the run. ``trees.parquet``, ``statistics.json``, ``statistics.csv``, ``trees.gpkg``,
        ``map.png`` and ``map.html`` are written there, over those of an earlier merge, and ``stems.json``
        where a field list is given; else that of an earlier merge goes.
    gpkg : Path, optional
        Another place for the GeoPackage.
    postgis : str, optional
        Address of a database that the trees are put into.
    stems : Path, optional
        Field list, see `pipeline.batch.merging.stems`.
    areas : Path, optional
        Polygons that statistics are told of; the cells if not given.
    into : PostgisOptions, optional
        Schema and table of the database.
    drawn : bool
        Whether the maps are made.

    Returns
    -------
    dict
        ``trees``, ``cells``, ``crs``, ``files``, ``notes`` (sentences for people); ``stems`` and ``postgis``
        where they were asked for.

    Raises
    ------
    InputMissingError, InputFormatError
        If no cell is done, or a file cannot be read.
    UsageError, OutputError
        If a result cannot be written, or a database refuses it.
    MissingExtraError
        If a package of the extra ``batch`` is not installed.
    """
    if postgis:
        without_password(postgis)  # a wrong address is told before any work
    cells = finished_cells(out)
    crs = crs_of(cells)
    joined = _joined(cells, read_stems(stems, crs) if stems else ())
    places = [one.cell for one in cells]
    asked = within_cells(read_areas(areas, crs), places) if areas else of_cells(places)
    told = Statistics(within_tiles(asked, tile_extents(out)), out)
    table = out / TABLE
    trees = _write_table(cells, joined, told, table, crs)
    rows = list(told.rows())
    write_text(out / "statistics.json", to_json(rows))
    write_text(out / "statistics.csv", to_csv(rows))
    package = gpkg or out / "trees.gpkg"
    geopackage.write(table, to_table(rows), package, crs=crs)
    files = [table, out / "statistics.json", out / "statistics.csv", package]
    files += maps.write(table, out, crs=crs, cells=places) if drawn else []
    if stems:
        write_text(out / "stems.json", joined.to_json())
        files.append(out / "stems.json")
    else:  # that of an earlier merge would tell of stems that are in no table
        (out / "stems.json").unlink(missing_ok=True)
    summary: dict[str, Any] = {
        "trees": trees,
        "cells": len(cells),
        "crs": crs,
        "files": list(map(str, files)),
        "notes": _notes(cells),
    }
    if stems:
        summary["stems"] = {"file": str(stems), **joined.summary()}
    if postgis:
        done = [(one.cell, one.manifest.get("edition")) for one in cells]
        loaded = load(table, postgis, cells=done, crs=crs, options=into)
        summary["postgis"] = loaded.summary()
    return summary


def _notes(cells: Sequence[FinishedCell]) -> list[str]:
    """Return what people should know of the cells."""
    made = {str(one.manifest.get("config_hash")) for one in cells}
    if len(made) == 1:
        return []
    return [
        f"the cells were made with {len(made)} different settings; run the batch again to make them alike"
    ]


def _joined(cells: Sequence[FinishedCell], stems: Sequence[Stem]) -> Joined:
    """Join a field list to the trees of all cells."""
    return join(stems, _places(cells)) if stems else Joined({}, ())


def _places(cells: Sequence[FinishedCell]) -> Iterator[tuple[list[str], Any]]:
    """Yield names and feet of the trees, cell by cell."""
    for one in cells:
        table = geoparquet.read(one.table, ["tree_id", "x", "y"])
        yield table["tree_id"].to_pylist(), np.column_stack([floats(table, "x"), floats(table, "y")])


def _write_table(
    cells: Sequence[FinishedCell], joined: Joined, told: Statistics, path: Path, crs: str | None
) -> int:
    """Write all trees by tree_id, and gather their statistics; return how many they are."""
    trees = 0
    with geoparquet.GeoparquetWriter(path, arrow_schema(), crs=crs) as file:
        for part in trees_in_order(cells):
            whole = completed(part, joined.by_tree)
            file.write(whole)
            told.add(whole)
            trees += len(whole)
    return trees
