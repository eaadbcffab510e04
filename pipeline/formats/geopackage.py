"""The bones of a GeoPackage: tables, reference systems and geometries, on plain SQLite.

References
----------
Open Geospatial Consortium (2021). OGC GeoPackage Encoding Standard 1.3.1, OGC 12-128r18, sections 1.1,
2.1 and clause 2.1.3 for the geometries.
"""

from __future__ import annotations

import sqlite3
import struct

import numpy as np

from pipeline.model import Floats

APPLICATION, VERSION = 0x47504B47, 10300
CARTESIAN = -1
"""The reference system that is not known; metres on a plane."""

UNCHANGING = "2000-01-01T00:00:00.000Z"
"""Time of change: the same tree gives the same file."""

POINT_Z, LINESTRING_ZM = 1001, 3002

TABLES = """
CREATE TABLE gpkg_spatial_ref_sys (srs_name TEXT NOT NULL, srs_id INTEGER PRIMARY KEY,
  organization TEXT NOT NULL, organization_coordsys_id INTEGER NOT NULL, definition TEXT NOT NULL,
  description TEXT);
CREATE TABLE gpkg_contents (table_name TEXT NOT NULL PRIMARY KEY, data_type TEXT NOT NULL,
  identifier TEXT UNIQUE, description TEXT DEFAULT '', last_change DATETIME NOT NULL, min_x DOUBLE,
  min_y DOUBLE, max_x DOUBLE, max_y DOUBLE, srs_id INTEGER,
  CONSTRAINT fk_gc_r_srs_id FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id));
CREATE TABLE gpkg_geometry_columns (table_name TEXT NOT NULL, column_name TEXT NOT NULL,
  geometry_type_name TEXT NOT NULL, srs_id INTEGER NOT NULL, z TINYINT NOT NULL, m TINYINT NOT NULL,
  CONSTRAINT pk_geom_cols PRIMARY KEY (table_name, column_name),
  CONSTRAINT uk_gc_table_name UNIQUE (table_name),
  CONSTRAINT fk_gc_tn FOREIGN KEY (table_name) REFERENCES gpkg_contents(table_name),
  CONSTRAINT fk_gc_srs FOREIGN KEY (srs_id) REFERENCES gpkg_spatial_ref_sys(srs_id));
"""


def begin(file: sqlite3.Connection, crs: str | None) -> int:
    """Make an empty file a GeoPackage.

    Parameters
    ----------
    file : sqlite3.Connection
    crs : str or None

    Returns
    -------
    int
        The ``srs_id`` of the reference system; `CARTESIAN` if it has no EPSG number.
    """
    file.execute(f"PRAGMA application_id = {APPLICATION}")
    file.execute(f"PRAGMA user_version = {VERSION}")
    file.executescript(TABLES)
    known = [
        ("Undefined Cartesian SRS", -1, "NONE", -1, "undefined", "metres on a plane"),
        ("Undefined geographic SRS", 0, "NONE", 0, "undefined", "degrees"),
        _system(4326),
    ]
    own = _number(crs)
    if own is not None and own != 4326:
        known.append(_system(own))
    file.executemany("INSERT INTO gpkg_spatial_ref_sys VALUES (?, ?, ?, ?, ?, ?)", known)
    return CARTESIAN if own is None else own


def add_table(file: sqlite3.Connection, name: str, columns: str, kind: str, srs: int, points: Floats) -> None:
    """Add an empty table of geometries.

    Parameters
    ----------
    file : sqlite3.Connection
    name : str
    columns : str
        SQL of the columns after ``fid`` and ``geom``.
    kind : {"POINT", "LINESTRING"}
        A line has heights and measures, a point heights.
    srs : int
        Of `begin`.
    points : (N, 3) array
        For the extent.
    """
    low, high = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    file.execute(
        f"CREATE TABLE {name} (fid INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL, geom {kind}, {columns})"
    )
    row = (name, "features", name, "", UNCHANGING, *low[:2], *high[:2], srs)
    file.execute("INSERT INTO gpkg_contents VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", row)
    column = (name, "geom", kind, srs, 1, int(kind == "LINESTRING"))
    file.execute("INSERT INTO gpkg_geometry_columns VALUES (?, ?, ?, ?, ?, ?)", column)


def geometry(points: Floats, srs: int) -> bytes:
    """Return a geometry: a line of (N, 4) x y z m, or a point of (3,) x y z.

    Examples
    --------
    >>> coordinates(geometry(np.array([[0.0, 1, 2, 3], [4, 5, 6, 7]]), 28992))[1].tolist()
    [4.0, 5.0, 6.0, 7.0]
    """
    flat = np.ascontiguousarray(points, dtype="<f8")
    if points.ndim == 1:
        head = struct.pack("<2sBBi", b"GP", 0, 0b00000001, srs)
        return head + struct.pack("<BI", 1, POINT_Z) + flat.tobytes()
    low, high = points.min(axis=0), points.max(axis=0)
    box = (low[0], high[0], low[1], high[1], low[2], high[2])
    head = struct.pack("<2sBBi6d", b"GP", 0, 0b00000101, srs, *box)
    return head + struct.pack("<BII", 1, LINESTRING_ZM, len(points)) + flat.tobytes()


def coordinates(blob: object) -> Floats:
    """Return the (N, 4) x y z m of a line.

    Raises
    ------
    ValueError
        If it is anything else.
    """
    if not isinstance(blob, bytes) or len(blob) < 8 or blob[:2] != b"GP":
        msg = "it is no geometry of a GeoPackage"
        raise ValueError(msg)
    size = {0: 0, 1: 32, 2: 48, 3: 48, 4: 64}.get(blob[3] >> 1 & 7)
    body = blob[8 + size :] if size is not None else b""
    order = "<" if body[:1] == b"\x01" else ">"
    if len(body) < 9 or struct.unpack(f"{order}I", body[1:5])[0] != LINESTRING_ZM:
        msg = "it is no LINESTRING ZM"
        raise ValueError(msg)
    count = struct.unpack(f"{order}I", body[5:9])[0]
    if len(body) != 9 + 32 * count:
        msg = "it is cut short"
        raise ValueError(msg)
    return np.frombuffer(body, f"{order}f8", 4 * count, 9).astype(np.float64).reshape(count, 4)


def _number(crs: str | None) -> int | None:
    """Return the EPSG number of a reference system, None where it has none."""
    name, _, number = (crs or "").partition(":")
    known = name.strip().upper() == "EPSG" and number.strip().isascii() and number.strip().isdigit()
    return int(number) if known and _definition(int(number)) else None


def _system(number: int) -> tuple[str, int, str, int, str, str | None]:
    """Return the row of an EPSG system."""
    name, definition = _definition(number) or (f"EPSG:{number}", "undefined")
    return name, number, "EPSG", number, definition, None


def _definition(number: int) -> tuple[str, str] | None:
    """Return name and well-known text of an EPSG system, None where there is no such one."""
    from pyproj import CRS  # noqa: PLC0415 (slow to import, and few files need it)
    from pyproj.exceptions import CRSError  # noqa: PLC0415

    try:
        system = CRS.from_epsg(number)
        return system.name, system.to_wkt("WKT1_GDAL")
    except CRSError:
        return None
