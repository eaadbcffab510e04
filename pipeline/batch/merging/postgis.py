"""The merged table in PostGIS: copied to a stage, then put in place of what was there, in one transaction.

A tree that is there already, by its ``tree_id``, is replaced. So are all trees of the same edition whose
apex lies in a cell that the run has done: what a newer run finds no more is gone. Trees of other editions,
and of cells that are not done, stay.

The stage is filled by COPY from CSV, which Arrow writes. No message shows a password.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import Field

from pipeline.airborne import dutch
from pipeline.airborne.grid import Cell
from pipeline.batch.columns import MERGED
from pipeline.batch.merging.database import connected, quoted, srid_of
from pipeline.errors import OutputError
from pipeline.formats import geoparquet
from pipeline.formats.geoparquet import GEOMETRIES, arrow
from pipeline.options import Options

KINDS = {
    "string": "text",
    "float64": "double precision",
    "int32": "integer",
    "bool": "boolean",
    "date32": "date",
    "binary": "bytea",
}
"""Types of PostgreSQL by those of the columns."""

STAGE = "treepipe_stage"
DONE = "treepipe_done"


class PostgisOptions(Options):
    """Where the trees go."""

    schema_name: str = Field("treepipe", min_length=1, max_length=63, description="schema of the database")
    table: str = Field("trees", min_length=1, max_length=50, description="table of the trees")


@dataclass(frozen=True)
class Loaded:
    """What became of the trees: new ones, those replaced, and those that are gone."""

    inserted: int
    replaced: int
    removed: int

    def summary(self) -> dict[str, int]:
        """Return the figures by name."""
        return {"inserted": self.inserted, "replaced": self.replaced, "removed": self.removed}


def load(
    table: Path,
    url: str,
    *,
    cells: Sequence[tuple[Cell, str | None]],
    crs: str | None,
    options: PostgisOptions | None = None,
) -> Loaded:
    """Put the trees of a merged table into a database.

    Parameters
    ----------
    table : Path
        The merged GeoParquet.
    url : str
        ``postgresql://user@host:port/database``.
    cells : sequence of (Cell, edition)
        Those that are done; without an edition those of the trees count.
    crs : str or None
        It needs an EPSG number.
    options : PostgisOptions, optional

    Raises
    ------
    UsageError
        If the address is none, or the reference system has no EPSG number.
    OutputError
        If the database cannot be reached, has no PostGIS, refuses the rights, or the table that is there
        is another one.
    MissingExtraError
        If psycopg is not installed.
    """
    chosen = options or PostgisOptions()
    with connected(url) as cursor:
        srid = srid_of(cursor, crs)
        name = _prepare(cursor, chosen, srid)
        _stage(cursor, table)
        _tell_done(cursor, cells)
        return _put(cursor, name, srid)


def _prepare(cursor: Any, options: PostgisOptions, srid: int) -> str:
    """Make schema, table, indexes and view where they are not there; return the table's quoted name."""
    schema, name = quoted(options.schema_name), f"{quoted(options.schema_name)}.{quoted(options.table)}"
    if not _there(cursor, "to_regnamespace", schema):
        cursor.execute(f"CREATE SCHEMA {schema}")
    if not _there(cursor, "to_regclass", name):
        columns = ", ".join(f"{quoted(column)} {kind}" for column, kind in _columns(srid))
        cursor.execute(f"CREATE TABLE {name} ({columns}, PRIMARY KEY (tree_id))")
        for column in GEOMETRIES:
            index = quoted(f"{options.table}_{column}")
            cursor.execute(f"CREATE INDEX {index} ON {name} USING gist ({quoted(column)})")
        index = quoted(f"{options.table}_place")
        cursor.execute(f"CREATE INDEX {index} ON {name} (edition, apex_x, apex_y)")
        view = (
            f"{schema}.{quoted(dutch.VIEW if options.table == 'trees' else f'{options.table}_{dutch.VIEW}')}"
        )
        cursor.execute(f"CREATE OR REPLACE VIEW {view} AS {dutch.select(name, 'geometry')}")
        return name
    _fit(cursor, options, name, srid)
    return name


def _fit(cursor: Any, options: PostgisOptions, name: str, srid: int) -> None:
    """Make sure that a table that is there can take the trees; add columns that it lacks."""
    cursor.execute(
        "SELECT column_name FROM information_schema.columns WHERE table_schema = %s AND table_name = %s",
        (options.schema_name, options.table),
    )
    held = {row[0] for row in cursor.fetchall()}
    if not {"tree_id", "edition", "apex_x", "apex_y", *GEOMETRIES} <= held:
        msg = f"{name}: is a table of something else than trees; give another schema or table, or drop it"
        raise OutputError(msg)
    cursor.execute(
        "SELECT srid FROM geometry_columns WHERE f_table_schema = %s AND f_table_name = %s "
        "AND f_geometry_column = 'geometry'",
        (options.schema_name, options.table),
    )
    found = cursor.fetchone()
    if found and found[0] != srid:
        msg = (
            f"{name}: is in the reference system {found[0]}, the trees are in {srid}; give another table, or "
            f"bring the table over with ST_Transform"
        )
        raise OutputError(msg)
    for column, kind in _columns(srid):
        if column not in held:
            cursor.execute(f"ALTER TABLE {name} ADD COLUMN {quoted(column)} {kind}")


def _columns(srid: int) -> Iterator[tuple[str, str]]:
    """Yield name and type of the columns of the table."""
    for column in MERGED:
        shape = GEOMETRIES.get(column.name)
        kind = f"geometry({shape.replace(' ', '')}, {srid})" if shape else KINDS[column.dtype]
        yield column.name, kind


def _stage(cursor: Any, table: Path) -> None:
    """Copy the trees to a table that is gone when the transaction ends."""
    columns = ", ".join(f"{quoted(column.name)} {KINDS[column.dtype]}" for column in MERGED)
    cursor.execute(f"CREATE TEMP TABLE {STAGE} ({columns}) ON COMMIT DROP")
    names = [column.name for column in MERGED]
    with cursor.copy(f"COPY {STAGE} FROM STDIN (FORMAT csv)") as copy:
        for batch in geoparquet.batches(table, names):
            copy.write(_csv(batch))
    cursor.execute(f"CREATE UNIQUE INDEX ON {STAGE} (tree_id)")
    cursor.execute(f"ANALYZE {STAGE}")


def _tell_done(cursor: Any, cells: Sequence[tuple[Cell, str | None]]) -> None:
    """Write the cells that are done, and their editions, to a table that is gone with the transaction."""
    corner = "x0 float8, y0 float8, size_m float8"
    cursor.execute(f"CREATE TEMP TABLE {DONE} ({corner}, edition text) ON COMMIT DROP")
    rows = [(cell.x0, cell.y0, cell.size_m, edition) for cell, edition in cells]
    cursor.executemany(f"INSERT INTO {DONE} VALUES (%s, %s, %s, %s)", rows)
    cursor.execute(
        f"INSERT INTO {DONE} SELECT x0, y0, size_m, seen.edition FROM {DONE} AS done, "
        f"(SELECT DISTINCT edition FROM {STAGE}) AS seen WHERE done.edition IS NULL"
    )
    cursor.execute(f"DELETE FROM {DONE} WHERE edition IS NULL")
    cursor.execute(f"ANALYZE {DONE}")


def _csv(batch: Any) -> bytes:
    """Return rows as CSV: all that is known in quotes, binary as hexadecimal digits."""
    pa, out = arrow(), io.BytesIO()
    columns = [
        _hexadecimal(column) if pa.types.is_binary(column.type) else column for column in batch.columns
    ]
    csv = arrow("pyarrow.csv")
    options = csv.WriteOptions(include_header=False, quoting_style="all_valid")
    csv.write_csv(pa.table(columns, names=batch.schema.names), out, options)
    return out.getvalue()


def _hexadecimal(column: Any) -> Any:
    """Return binary as PostgreSQL reads it."""
    texts = [None if blob is None else "\\x" + blob.hex() for blob in column.to_pylist()]
    return arrow().array(texts, arrow().string())


def _put(cursor: Any, name: str, srid: int) -> Loaded:
    """Replace what is there by the stage.

    A tree finds its cell by the corner, which is a multiple of the cell's size: it is not compared with all.
    """
    cursor.execute(f"LOCK TABLE {name} IN SHARE ROW EXCLUSIVE MODE")
    cursor.execute(
        f"DELETE FROM {name} AS old USING (SELECT DISTINCT size_m FROM {DONE}) AS grid, {DONE} AS done "
        "WHERE done.size_m = grid.size_m AND done.edition = old.edition "
        "AND done.x0 = floor(old.apex_x / grid.size_m) * grid.size_m "
        "AND done.y0 = floor(old.apex_y / grid.size_m) * grid.size_m "
        f"AND NOT EXISTS (SELECT 1 FROM {STAGE} AS new WHERE new.tree_id = old.tree_id)"
    )
    removed = cursor.rowcount
    cursor.execute(f"SELECT count(*) FROM {name} JOIN {STAGE} USING (tree_id)")
    replaced = cursor.fetchone()[0]
    plain = [column.name for column in MERGED]
    values = [f"ST_GeomFromWKB({quoted(one)}, {srid})" if one in GEOMETRIES else quoted(one) for one in plain]
    renewed = ", ".join(f"{quoted(one)} = EXCLUDED.{quoted(one)}" for one in plain if one != "tree_id")
    cursor.execute(
        f"INSERT INTO {name} ({', '.join(map(quoted, plain))}) SELECT {', '.join(values)} FROM {STAGE} "
        f"ORDER BY tree_id ON CONFLICT (tree_id) DO UPDATE SET {renewed}"
    )
    return Loaded(cursor.rowcount - replaced, replaced, removed)


def _there(cursor: Any, function: str, name: str) -> bool:
    cursor.execute(f"SELECT {function}(%s) IS NOT NULL", (name,))
    return bool(cursor.fetchone()[0])
