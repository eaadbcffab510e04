"""The merged table as a GeoPackage: layers of trees and crowns, the statistics, and the Dutch view.

GDAL writes the layers from batches of Arrow, with a spatial index each. The view ``boom`` is added on plain
SQLite, registered as a layer, so that QGIS shows it like any other.

References
----------
Open Geospatial Consortium (2021). OGC GeoPackage Encoding Standard 1.3.1, OGC 12-128r18.
"""

from __future__ import annotations

import sqlite3
import warnings
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from pipeline.airborne import dutch
from pipeline.batch.columns import MERGED
from pipeline.batch.merging.packages import package
from pipeline.errors import OutputError
from pipeline.formats import geoparquet
from pipeline.formats.geopackage import UNCHANGING
from pipeline.formats.geoparquet import arrow
from pipeline.output import whole_file

TREES, CROWNS, STATISTICS = "trees", "crowns", "statistics"

CROWN_COLUMNS = ("tree_id", "height_m", "crown_diam_m", "crown_area_m2", "dbh_cm", "species", "crown")
"""Columns of the layer of crowns."""

READ_BY_ALL = {"VERSION": "1.3"}
"""GDAL 3.6, as QGIS of Debian 12 has it, warns of every layer of a GeoPackage 1.4."""


def write(table: Path, statistics: Any, path: Path, *, crs: str | None) -> None:
    """Write a GeoPackage.

    Parameters
    ----------
    table : Path
        The merged GeoParquet.
    statistics : pyarrow.Table
    path : Path
        Replaced if it is there.
    crs : str or None

    Raises
    ------
    OutputError
        If the file cannot be written.
    MissingExtraError
        If pyogrio is not installed.
    """
    pyogrio = package("pyogrio")
    points = [column.name for column in MERGED if column.name != "crown"]
    with whole_file(path) as temporary, _unchanging_time(pyogrio), warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="'crs' was not provided")  # then there is none to give
        temporary.unlink()  # GDAL makes the file itself
        try:
            layers = ((TREES, points, "geometry", "Point Z"), (CROWNS, CROWN_COLUMNS, "crown", "Polygon"))
            for layer, names, geometry, kind in layers:
                pyogrio.write_arrow(
                    _stream(table, list(names)),
                    temporary,
                    layer=layer,
                    driver="GPKG",
                    geometry_name=geometry,
                    geometry_type=kind,
                    crs=crs,
                    dataset_options=READ_BY_ALL,
                )
            pyogrio.write_arrow(statistics, temporary, layer=STATISTICS, driver="GPKG")
            with closing(sqlite3.connect(temporary)) as file, file:
                _add_view(file)
        except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, sqlite3.Error) as error:
            reason = str(error).partition("\n")[0]
            msg = f"{path}: cannot be written ({reason}); free space or choose another file with --gpkg"
            raise OutputError(msg) from error


def _stream(table: Path, names: list[str]) -> Any:
    """Return a stream of batches of some columns."""
    first = next(geoparquet.batches(table, names, rows=1), None)
    batches = geoparquet.batches(table, names)
    schema = first.schema if first is not None else geoparquet.read(table, names).schema
    return arrow().RecordBatchReader.from_batches(schema.remove_metadata(), _bare(batches))


def _bare(batches: Iterator[Any]) -> Iterator[Any]:
    """Yield batches without what Parquet adds to the schema."""
    for batch in batches:
        yield batch.replace_schema_metadata(None)


def _add_view(file: sqlite3.Connection) -> None:
    """Add the Dutch view, as a layer of the points of the trees."""
    name = dutch.VIEW
    file.execute(f"CREATE VIEW {name} AS {dutch.select(TREES, 'geom', 'fid AS OGC_FID')}")
    file.execute(
        "INSERT INTO gpkg_contents SELECT ?, data_type, ?, '', last_change, min_x, min_y, max_x, max_y, "
        "srs_id FROM gpkg_contents WHERE table_name = ?",
        (name, name, TREES),
    )
    file.execute(
        "INSERT INTO gpkg_geometry_columns SELECT ?, column_name, geometry_type_name, srs_id, z, m "
        "FROM gpkg_geometry_columns WHERE table_name = ?",
        (name, TREES),
    )


@contextmanager
def _unchanging_time(pyogrio: Any) -> Iterator[None]:
    """Let GDAL write the same time always: the same trees give the same file."""
    before = pyogrio.get_gdal_config_option("OGR_CURRENT_DATE")
    pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": UNCHANGING})
    try:
        yield
    finally:
        pyogrio.set_gdal_config_options({"OGR_CURRENT_DATE": before})
