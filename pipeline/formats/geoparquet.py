"""GeoParquet: tables of trees as columns, streamed by row groups; the same rows give the same bytes.

Geometries are well-known binary. The reference system stands as PROJJSON in the key ``geo`` of the
file, beside the kinds of geometry and the box around the first geometry column. pyarrow is needed, which
the extra ``batch`` brings.

References
----------
Open Geospatial Consortium (2024). GeoParquet specification 1.1.0. https://geoparquet.org/releases/v1.1.0/
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np

from pipeline.errors import InputFormatError, InputMissingError, UsageError
from pipeline.formats.arrow_points import arrow, points_of, points_wkb
from pipeline.output import whole_file

__all__ = [
    "GEOMETRIES", "ROW_GROUP", "GeoparquetWriter", "arrow", "batches", "crs_of", "points_of", "points_wkb",
    "read", "rows_of", "write",
]  # fmt: skip

VERSION = "1.1.0"

ROW_GROUP = 65_536
"""Rows of a group: what a writer holds and a reader may skip."""

GEOMETRIES: Mapping[str, str] = {"geometry": "Point Z", "crown": "Polygon"}
"""Columns of geometries and what they hold, the first one being the primary."""


class GeoparquetWriter:
    """Write a file table by table, whole or not at all, in the memory of one row group.

    Parameters
    ----------
    path : path-like
        Replaced when the last row is written; left alone where something fails before.
    schema : pyarrow.Schema
        Columns named in `GEOMETRIES` are geometries, in well-known binary.
    crs : str or None
        ``"EPSG:7415"`` and the like; None where unknown.
    """

    def __init__(self, path: str | os.PathLike[str], schema: Any, *, crs: str | None) -> None:
        self.path, self._schema, self._crs = Path(path), schema, crs
        self._waiting: list[Any] = []
        self._low, self._high = np.full(3, np.inf), np.full(3, -np.inf)
        self._stack = ExitStack()
        self._file: Any = None  # open inside `with`

    def __enter__(self) -> GeoparquetWriter:
        parquet = arrow("pyarrow.parquet")
        plain = [name for name in self._schema.names if name not in GEOMETRIES]
        with ExitStack() as stack:
            temporary = stack.enter_context(whole_file(self.path))
            self._file = stack.enter_context(
                parquet.ParquetWriter(
                    temporary, self._schema, compression="zstd", use_dictionary=plain, write_statistics=plain
                )
            )
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        with self._stack:
            if error is not None:
                raise error  # so that what is half written goes
            self._flush(last=True)
            self._file.add_key_value_metadata({"geo": json.dumps(self._geo(), sort_keys=True)})
            self._file = None

    def write(self, table: Any) -> None:
        """Add the rows of a table; its columns are those of the schema.

        Parameters
        ----------
        table : pyarrow.Table

        Raises
        ------
        UsageError
            Outside ``with``, or if a column is missing or of another kind.
        """
        if self._file is None:
            msg = f"{self.path}: is not open; write tables inside `with GeoparquetWriter(...) as file:`"
            raise UsageError(msg)
        try:
            fitting = table.select(self._schema.names).cast(self._schema)
        except (KeyError, ValueError) as error:  # errors of Arrow are ValueErrors
            msg = f"{self.path}: the rows do not fit the columns of the file ({error}); give the same columns"
            raise UsageError(msg) from error
        self._widen(fitting)
        self._waiting.append(fitting)
        if sum(len(one) for one in self._waiting) >= ROW_GROUP:
            self._flush(last=False)

    def _flush(self, *, last: bool) -> None:
        """Write whole row groups, and the rest as well if it is the last."""
        if not self._waiting:
            return
        held = arrow().concat_tables(self._waiting)
        whole = len(held) if last else len(held) // ROW_GROUP * ROW_GROUP
        for start in range(0, whole, ROW_GROUP):
            group = held.slice(start, min(ROW_GROUP, whole - start)).combine_chunks()
            self._file.write_table(group, row_group_size=ROW_GROUP)
        self._waiting = [held.slice(whole)] if whole < len(held) else []

    def _widen(self, table: Any) -> None:
        """Widen the box by the points of the primary column."""
        name = next((name for name in GEOMETRIES if name in self._schema.names), None)
        if name is None or GEOMETRIES[name] != "Point Z" or not len(table):
            return
        points = points_of(table[name])
        if len(points):
            self._low = np.minimum(self._low, points.min(axis=0))
            self._high = np.maximum(self._high, points.max(axis=0))

    def _geo(self) -> dict[str, Any]:
        """Return what the key ``geo`` says."""
        names = [name for name in GEOMETRIES if name in self._schema.names]
        columns: dict[str, Any] = {
            name: {
                "encoding": "WKB",
                "geometry_types": [GEOMETRIES[name]],
                "crs": _projjson(self._crs, flat=not GEOMETRIES[name].endswith("Z")),
                "edges": "planar",
            }
            for name in names
        }
        if names and np.isfinite(self._low).all():
            columns[names[0]]["bbox"] = [*self._low.tolist(), *self._high.tolist()]
        return {"version": VERSION, "primary_column": names[0] if names else "geometry", "columns": columns}


def write(table: Any, path: str | os.PathLike[str], *, crs: str | None) -> None:
    """Write a whole table; see `GeoparquetWriter`.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    with GeoparquetWriter(path, table.schema.remove_metadata(), crs=crs) as file:
        file.write(table)


def read(path: str | os.PathLike[str], columns: Iterable[str] | None = None) -> Any:
    """Read a whole file.

    Parameters
    ----------
    path : path-like
    columns : iterable of str, optional
        All if not given.

    Returns
    -------
    pyarrow.Table

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If it is no Parquet file, or lacks a column.
    """
    with _opened(path) as file:
        wanted = _known(path, file, columns)
        try:
            return file.read(columns=wanted).replace_schema_metadata(None)
        except (OSError, ValueError) as error:
            raise _damaged(path, error) from error


def batches(
    path: str | os.PathLike[str], columns: Iterable[str] | None = None, *, rows: int = ROW_GROUP
) -> Iterator[Any]:
    """Yield record batches of at most `rows` rows; raises what `read` raises."""
    with _opened(path) as file:
        wanted = _known(path, file, columns)
        try:
            yield from file.iter_batches(batch_size=rows, columns=wanted)
        except (OSError, ValueError) as error:
            raise _damaged(path, error) from error


def rows_of(path: str | os.PathLike[str]) -> int:
    """Return the number of rows; raises what `read` raises."""
    with _opened(path) as file:
        return int(file.metadata.num_rows)


def crs_of(path: str | os.PathLike[str]) -> str | None:
    """Return the reference system, ``"EPSG:7415"`` and the like; None where it says none.

    One that has no EPSG number is returned as PROJJSON. Raises what `read` raises.
    """
    with _opened(path) as file:
        held = (file.metadata.metadata or {}).get(b"geo")
    try:
        geo = json.loads(held) if held else {}
        crs = geo["columns"][geo["primary_column"]].get("crs") if geo else None
        identity = (crs or {}).get("id")
        if identity:
            return f"{identity['authority']}:{identity['code']}"
        return json.dumps(crs) if crs else None
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        msg = f"{path}: the key geo of the file is damaged ({error!r}); write the file anew"
        raise InputFormatError(msg) from error


def _projjson(crs: str | None, *, flat: bool) -> dict[str, Any] | None:
    """Return a reference system as PROJJSON; its horizontal part for a flat geometry."""
    if crs is None:
        return None
    from pyproj import CRS  # noqa: PLC0415 (slow to import)
    from pyproj.exceptions import CRSError  # noqa: PLC0415

    try:
        system = CRS.from_user_input(crs)
    except CRSError as error:
        msg = f"{crs!r} is no reference system that pyproj knows; give for example EPSG:7415"
        raise UsageError(msg) from error
    parts = system.sub_crs_list
    chosen: dict[str, Any] = (parts[0] if flat and parts else system).to_json_dict()
    return chosen


def _opened(path: str | os.PathLike[str]) -> Any:
    """Return an open Parquet file."""
    if not Path(path).is_file():
        msg = f"{path}: there is no such file; check the name"
        raise InputMissingError(msg)
    try:
        return arrow("pyarrow.parquet").ParquetFile(path)
    except (OSError, ValueError) as error:
        raise _damaged(path, error) from error


def _known(path: str | os.PathLike[str], file: Any, columns: Iterable[str] | None) -> list[str] | None:
    """Return the columns that are wanted, all of which are there."""
    if columns is None:
        return None
    wanted = list(columns)
    held = set(file.schema_arrow.names)
    absent = [name for name in wanted if name not in held]
    if absent:
        msg = f"{path}: has no column {', '.join(absent)}; write it anew with this version of treepipe"
        raise InputFormatError(msg)
    return wanted


def _damaged(path: str | os.PathLike[str], error: Exception) -> InputFormatError:
    reason = str(error).splitlines()[0] if str(error) else type(error).__name__
    msg = f"{path}: cannot be read as Parquet ({reason}); write the file anew"
    return InputFormatError(msg)
