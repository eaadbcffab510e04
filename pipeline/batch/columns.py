"""The columns of the merged table: those of the cells, and what is known once all trees are together."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pipeline.airborne.allometry import AllometryOptions, Biome, breast_height_diameter
from pipeline.airborne.biomass import ROWS, biomass
from pipeline.airborne.inventory import COLUMNS, Column
from pipeline.formats.geoparquet import arrow
from pipeline.model import Floats

ALLOMETRIC = "allometric"
"""Value of dbh_method where height and crown tell the diameter."""

LITRE_ML = 6  # decimals of a cubic metre

BIOME: Biome = "palearctic-temperate-mixed"
"""Whose rows a joined stem's kind of leaf chooses from."""

ADDED: tuple[Column, ...] = (
    Column("crown_vol_m3", "float64", "m3", "volume of the ellipsoid with the crown's area and depth"),
    Column("agb_kg", "float64", "kg", "dry mass above the ground, from height and crown diameter"),
    Column("agb_lo_kg", "float64", "kg", "lower end of its 90 % interval"),
    Column("agb_hi_kg", "float64", "kg", "upper end of its 90 % interval"),
    Column("carbon_kg", "float64", "kg", "carbon in that mass"),
    Column("species", "string", "", "of the field list; null where no stem of it was joined"),
    Column("leaf_type", "string", "", "angiosperm or gymnosperm, of the field list; null where unknown"),
    Column(
        "dbh_row", "string", "", "allometry that the leaf type chose for dbh_cm; null where it chose none"
    ),
    Column("stem_dbh_cm", "float64", "cm", "diameter of the stem in the field list, beside dbh_cm"),
    Column("stem_distance_m", "float64", "m", "from the foot of the tree to the stem of the field list"),
)
"""Columns that merging adds."""

MERGED: tuple[Column, ...] = (*COLUMNS[:-2], *ADDED, *COLUMNS[-2:])
"""All columns of the merged table; the geometries stand last."""


def arrow_schema(columns: tuple[Column, ...] = MERGED) -> Any:
    """Return the Arrow schema of columns."""
    pa = arrow()
    kinds = {
        "string": pa.string(),
        "float64": pa.float64(),
        "int32": pa.int32(),
        "bool": pa.bool_(),
        "date32": pa.date32(),
        "binary": pa.binary(),
    }
    return pa.schema([(column.name, kinds[column.dtype]) for column in columns])


def completed(table: Any, stems: Mapping[str, tuple[str | None, str | None, float, float]]) -> Any:
    """Return a table of the cells with the columns of `ADDED`.

    Parameters
    ----------
    table : pyarrow.Table
        With the columns of `COLUMNS`.
    stems : mapping
        Species, leaf type, diameter in cm (NaN where unknown) and distance in m, by tree_id.

    Returns
    -------
    pyarrow.Table
        With the columns of `MERGED`; figures that are not finite are null. Where the field list tells the
        kind of leaf it chooses the equation of the mass, and of a diameter that is allometric, with which
        the volume of the stem goes. A diameter of the field list stands beside the tree's own, in
        ``stem_dbh_cm``.
    """
    pa, none = arrow(), (None, None, np.nan, np.nan)
    joined = [stems.get(name, none) for name in table["tree_id"].to_pylist()]
    species, leaf = (pa.array([row[k] for row in joined], pa.string()) for k in (0, 1))
    dbh, distance = (np.array([row[k] for row in joined], dtype=np.float64) for k in (2, 3))
    height, diameter, base = (floats(table, name) for name in ("height_m", "crown_diam_m", "crown_base_h_m"))
    mass = biomass(height, diameter, [row[1] or "" for row in joined] if joined else None)
    kinds = [row[1] for row in joined]
    depth = height - np.where(np.isfinite(base), base, 0.0)
    new: dict[str, Any] = {
        "crown_vol_m3": 2 / 3 * floats(table, "crown_area_m2") * np.where(depth > 0, depth, np.nan),
        "agb_kg": mass.agb_kg,
        "agb_lo_kg": mass.lo_kg,
        "agb_hi_kg": mass.hi_kg,
        "carbon_kg": mass.carbon_kg,
        "species": species,
        "leaf_type": leaf,
        "stem_dbh_cm": dbh,
        "stem_distance_m": distance,
        **_by_leaf(table, kinds, height, diameter),
    }
    schema = arrow_schema()
    held = [_tidy(new[field.name] if field.name in new else table[field.name], field) for field in schema]
    return pa.table(held, schema=schema)


def floats(table: Any, name: str) -> Floats:
    """Return a column of numbers, NaN where it is null."""
    return np.asarray(table[name].to_numpy(zero_copy_only=False), dtype=np.float64)


def _by_leaf(table: Any, kinds: list[str | None], height: Floats, crown: Floats) -> dict[str, Any]:
    """Return the columns of the diameter, told anew where it is allometric and the kind of leaf is known.

    All radii of such a model are in proportion to its diameter (`pipeline.airborne.fallback`), so the volume
    of the stem goes with the square of it.
    """
    told = {name: floats(table, name).copy() for name in ("dbh_cm", "dbh_lo_cm", "dbh_hi_cm")}
    before, volume = told["dbh_cm"].copy(), floats(table, "stem_vol_m3").copy()
    rows: list[str | None] = [None] * len(kinds)
    method = table["dbh_method"].to_pylist()
    sized = np.isfinite(height) & np.isfinite(crown) & np.isfinite(told["dbh_cm"])
    for k in np.flatnonzero(sized).tolist():
        kind = kinds[k]
        if kind not in ROWS or method[k] != ALLOMETRIC:
            continue
        options = AllometryOptions.model_validate({"biome": BIOME, "leaf_type": kind})
        anew = breast_height_diameter(float(height[k]), float(crown[k]), options=options)
        for name, metres in zip(told, anew, strict=True):
            told[name][k] = round(100 * metres, 2)
        volume[k] = round(volume[k] * (told["dbh_cm"][k] / before[k]) ** 2, LITRE_ML)
        rows[k] = f"{BIOME} {kind}"
    return {**told, "stem_vol_m3": volume, "dbh_row": arrow().array(rows, arrow().string())}


def _tidy(values: Any, field: Any) -> Any:
    """Return a column with nulls where a number is not finite."""
    pa = arrow()
    if not pa.types.is_floating(field.type):
        return values
    if isinstance(values, np.ndarray):
        return pa.array(values, mask=~np.isfinite(values))
    compute = arrow("pyarrow.compute")
    return compute.if_else(compute.is_finite(values), values, pa.scalar(None, field.type))
