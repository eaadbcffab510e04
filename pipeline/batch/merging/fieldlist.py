"""A field list of stems, read by the usual names of its columns, in the units and the system of the trees."""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from math import pi
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from pipeline.batch.merging.genera import leaf_type_of
from pipeline.batch.merging.packages import package
from pipeline.batch.vectors import read_vector
from pipeline.errors import InputFormatError, InputMissingError
from pipeline.model import Floats

NAMES: Mapping[str, tuple[str, ...]] = {
    "x": ("x", "rdx", "xrd", "xcoord", "xcoordinaat", "xcoordinate", "easting", "oost"),
    "y": ("y", "rdy", "yrd", "ycoord", "ycoordinaat", "ycoordinate", "northing", "noord"),
    "species": (
        "species", "scientificname", "latinname", "soort", "boomsoort", "soortnaam", "wetenschappelijkenaam",
        "soortwetenschappelijk", "latijnsenaam", "boomsoortnaam", "boomsrt", "soortlatijn", "naamlatijn", "s",
    ),
    "leaf_type": ("leaftype", "bladtype", "loofofnaald"),
    "dbh": ("dbh", "stamdiameter", "stemdiameter", "diameter", "stamdiam", "d130", "d13", "bhd", "d"),
    "girth": ("girth", "stamomtrek", "omtrek", "circumference", "stemgirth"),
    "name": (
        "treeid", "boomid", "boomnummer", "boomnr", "nummer", "id", "stemid", "objectid", "guid", "fid", "n",
    ),
}  # fmt: skip
"""Usual names of columns, without case, spaces, dashes and underscores; the first that is there counts."""

UNITS: Mapping[str, float] = {"mm": 0.1, "cm": 1.0, "m": 100.0}
"""Centimetres in what may stand behind the name of a diameter; cm if nothing does."""

UNIT = re.compile(r"[ _\[(]*(mm|cm|m)[\])]?$", flags=re.IGNORECASE)

THINNEST_CM, THICKEST_CM = 3.0, 400.0
"""A list whose thickest stem is thinner, or whose middle one is thicker, is in another unit."""

LEAVES: Mapping[str, str] = {
    "angiosperm": "angiosperm", "broadleaf": "angiosperm", "broadleaved": "angiosperm", "loof": "angiosperm",
    "loofboom": "angiosperm", "deciduous": "angiosperm", "gymnosperm": "gymnosperm", "conifer": "gymnosperm",
    "coniferous": "gymnosperm", "needle": "gymnosperm", "needleleaf": "gymnosperm", "naald": "gymnosperm",
    "naaldboom": "gymnosperm",
}  # fmt: skip


class Stem(NamedTuple):
    """One stem of the list; what is not known is None, a diameter NaN."""

    name: str
    x: float
    y: float
    species: str | None
    leaf_type: str | None
    dbh_cm: float


def read_stems(path: Path, crs: str | None = None) -> tuple[Stem, ...]:
    """Read a field list.

    Parameters
    ----------
    path : Path
        ``.csv`` or ``.txt`` (commas, semicolons or tabs; decimal point or comma), or a vector file of points,
        such as a ``.gpkg``, whose reference system counts.
    crs : str, optional
        Reference system of the trees. Coordinates of a text are taken to be in it.

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If it cannot be read, lacks coordinates, or its diameters are in another unit than their column says.
    """
    if not path.is_file():
        msg = f"{path}: there is no such file; check the name given to --stems"
        raise InputMissingError(msg)
    plain = path.suffix.lower() in {".csv", ".txt", ".tsv"}
    columns = _text(path) if plain else _vector(path, crs)
    found = _found(path, columns)
    numbers = {part: _numbers(columns[found[part]]) for part in ("x", "y")}
    dbh, rows = _diameters(path, columns, found), len(numbers["x"])
    names = columns[found["name"]] if "name" in found else [None] * rows
    species = _texts(columns, found, "species", rows)
    leaves = _texts(columns, found, "leaf_type", rows)
    stems = [
        Stem(str(name) if name not in (None, "") else f"row {k}", x, y, kind, _leaf(leaf, kind), d)
        for k, (name, x, y, kind, leaf, d) in enumerate(
            zip(
                names,
                numbers["x"].tolist(),
                numbers["y"].tolist(),
                species,
                leaves,
                dbh.tolist(),
                strict=True,
            ),
            1,
        )
        if np.isfinite(x) and np.isfinite(y)
    ]
    _check_places(path, stems)
    return tuple(stems)


def _text(path: Path) -> dict[str, list[Any]]:
    """Return the columns of a text file."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        msg = f"{path}: cannot be read as text in UTF-8 ({error}); save the list as CSV in UTF-8"
        raise InputFormatError(msg) from error
    head = text.partition("\n")[0]
    mark = max(";\t,", key=head.count)
    rows = [row for row in csv.reader(text.splitlines(), delimiter=mark) if any(map(str.strip, row))]
    if len(rows) < 2:
        msg = f"{path}: holds no stem; give a list with the names of columns in its first row"
        raise InputFormatError(msg)
    wide = [row + [""] * (len(rows[0]) - len(row)) for row in rows[1:]]
    return {name.strip(): [row[k].strip() for row in wide] for k, name in enumerate(rows[0])}


def _vector(path: Path, crs: str | None) -> dict[str, list[Any]]:
    """Return the columns of a vector file, its points as x and y in the system of the trees."""
    pyogrio, shapely = package("pyogrio"), package("shapely")
    try:
        info, geometry, values = read_vector(path)
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, ValueError) as error:
        reason = str(error).partition("\n")[0]
        msg = f"{path}: cannot be read as a list of stems ({reason}); give a CSV or a GeoPackage of points"
        raise InputFormatError(msg) from error
    if geometry is None:
        msg = f"{path}: has no points; give a layer of points, or a CSV with columns x and y"
        raise InputFormatError(msg)
    points = shapely.centroid(shapely.from_wkb(geometry))
    columns = {str(name): list(column) for name, column in zip(info["fields"], values, strict=True)}
    x, y = _placed(path, shapely.get_x(points), shapely.get_y(points), info["crs"], crs)
    fields = {name: column for name, column in columns.items() if _plain(name) not in NAMES["x"] + NAMES["y"]}
    return {"x": x.tolist(), "y": y.tolist(), **fields}


def _placed(
    path: Path, x: Floats, y: Floats, source: str | None, target: str | None
) -> tuple[Floats, Floats]:
    """Reproject coordinates, if the file names a system and it is another one."""
    if source is None or target is None:
        return x, y
    from pyproj import CRS, Transformer  # noqa: PLC0415 (slow to import)
    from pyproj.exceptions import ProjError  # noqa: PLC0415

    try:
        here, there = CRS.from_user_input(source), CRS.from_user_input(target)
        flat = there.sub_crs_list[0] if there.sub_crs_list else there
        if here.equals(flat, ignore_axis_order=True):
            return x, y
        moved = Transformer.from_crs(here, flat, always_xy=True).transform(x, y)
    except ProjError as error:
        msg = f"{path}: cannot be brought from {source} to {target} ({error}); reproject it first"
        raise InputFormatError(msg) from error
    return np.asarray(moved[0]), np.asarray(moved[1])


def _found(path: Path, columns: Mapping[str, Any]) -> dict[str, str]:
    """Return the name in the file of every part that is there."""
    plain: dict[str, str] = {}
    for name in columns:
        plain.setdefault(_plain(name), name)
        plain.setdefault(_plain(UNIT.sub("", name.strip())), name)
    found = {
        part: plain[known[0]] for part, names in NAMES.items() if (known := [n for n in names if n in plain])
    }
    for part in ("x", "y"):
        if part not in found:
            msg = (
                f"{path}: has no column for {part} among {', '.join(columns)}; name it {part}, or "
                f"one of {', '.join(NAMES[part][1:4])}"
            )
            raise InputFormatError(msg)
    return found


def _diameters(path: Path, columns: Mapping[str, list[Any]], found: Mapping[str, str]) -> Floats:
    """Return the diameters in cm, from the diameter or the girth; NaN where there is none."""
    part = "dbh" if "dbh" in found else "girth"
    if part not in found:
        return np.full(len(columns[found["x"]]), np.nan)
    name = found[part]
    unit = None if _plain(name) in NAMES[part] else UNIT.search(name.strip())
    scale = UNITS[unit[1].lower() if unit else "cm"] / (pi if part == "girth" else 1)
    values = _numbers(columns[name]) * scale
    values[~(values > 0)] = np.nan
    known = values[np.isfinite(values)]
    if len(known) and (known.max() < THINNEST_CM or np.median(known) > THICKEST_CM):
        msg = (
            f"{path}: the middle {part} in column {name} would be {np.median(known):.3g} cm; "
            f"name the column with its unit, such as {part}_m or {part}_mm"
        )
        raise InputFormatError(msg)
    return values


def _numbers(values: Sequence[Any]) -> Floats:
    """Return numbers, NaN for whatever is none; a comma may be the decimal sign."""
    return np.array([_number(value) for value in values], dtype=np.float64)


def _number(value: Any) -> float:
    try:
        return float(str(value).strip().replace(",", "."))
    except ValueError:
        return float("nan")


def _texts(
    columns: Mapping[str, list[Any]], found: Mapping[str, str], part: str, rows: int
) -> list[str | None]:
    held: list[Any] = columns[found[part]] if part in found else [None] * rows
    return [str(value).strip() or None if value is not None else None for value in held]


def _leaf(told: str | None, species: str | None) -> str | None:
    """Return the kind of tree, as the list tells it, or by its species."""
    return LEAVES.get((told or "").lower()) or leaf_type_of(species)


def _check_places(path: Path, stems: Sequence[Stem]) -> None:
    if not stems:
        msg = f"{path}: holds no stem with coordinates; give x and y in the system of the tiles"
        raise InputFormatError(msg)
    if all(abs(stem.x) <= 180 and abs(stem.y) <= 180 for stem in stems) and len(stems) > 1:
        apart = max(stem.x for stem in stems) - min(stem.x for stem in stems)
        if apart < 1:
            msg = f"{path}: has coordinates in degrees; reproject the list to the system of the tiles"
            raise InputFormatError(msg)


def _plain(name: str) -> str:
    """Return a column's name without case and what stands between its words."""
    return re.sub(r"[^a-z0-9]", "", name.lower())
