"""The profile of many trees: height, stem, crown and density of branches, by area and by species."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from pipeline.airborne.fallback import STRAIGHT
from pipeline.airborne.inventory import Column
from pipeline.batch.columns import arrow_schema, floats
from pipeline.batch.merging.areas import Areas
from pipeline.formats.geoparquet import arrow
from pipeline.model import Floats

EVERYTHING = "all"
"""Name of the area that is all areas, and of the species that is all species."""

UNKNOWN = "unknown"
"""Name of the species of trees without one."""

SPREAD = ("mean", "sd", "p05", "p50", "p95")
"""What is told of a figure: mean, standard deviation, and what 5, 50 and 95 % of the trees stay below."""

FIGURES: tuple[tuple[str, str, str], ...] = (
    ("height_m", "m", "height"),
    ("dbh_cm", "cm", "diameter of the stem"),
    ("crown_diam_m", "m", "diameter of the crown"),
    ("crown_base_h_m", "m", "height of the crown's base"),
    ("branch_m_m3", "m/m3", "length of stem and branches by volume of the crown"),
    ("branches_m3", "1/m3", "branches by volume of the crown"),
    ("slenderness", "m/m", "height by diameter of the stem"),
)
"""Figures of a tree whose spread is told: name, unit, what."""

SUMS: tuple[tuple[str, str, str], ...] = (
    ("crown_area_m2", "m2", "area of all crowns in plan"),
    ("stem_vol_m3", "m3", "volume of all stems"),
    ("total_len_m", "m", "length of all stems and branches"),
    ("agb_t", "t", "dry mass above the ground"),
    ("carbon_t", "t", "carbon in that mass"),
)
"""Figures of a tree that are summed."""

STATISTICS: tuple[Column, ...] = (
    Column("area", "string", "", f"name of the area or cell; {EVERYTHING} for all of them together"),
    Column("species", "string", "", f"{EVERYTHING} for all species, {UNKNOWN} for trees without one"),
    Column("trees", "int32", "", "number of trees"),
    Column("area_ha", "float64", "ha", "size of the area"),
    Column("trees_per_ha", "float64", "1/ha", "trees on a hectare"),
    Column("crown_cover_pct", "float64", "%", "area of all crowns by that of the area"),
    Column("agb_t_per_ha", "float64", "t/ha", "dry mass above the ground on a hectare"),
    Column("straight_pct", "float64", "%", "trees whose model is a straight stem, for want of points"),
    *(Column(f"{name}_sum", "float64", unit, what) for name, unit, what in SUMS),
    *(
        Column(f"{name}_{of}", "float64", unit, f"{what}: {of}")
        for name, unit, what in FIGURES
        for of in SPREAD
    ),
)
"""Columns of the table of statistics."""

Group = tuple[int, str]
"""Area, -1 for all; and species."""


class Statistics:
    """Gather trees, table by table, and tell their profile.

    Seven figures and five sums of every tree are held in four bytes each, 48 bytes a tree and area.

    Parameters
    ----------
    areas : Areas
    """

    def __init__(self, areas: Areas) -> None:
        self._areas = areas
        self._parts: dict[Group, list[Any]] = {}

    def add(self, table: Any) -> None:
        """Add trees, a table with the columns of `pipeline.batch.columns.MERGED`."""
        if not len(table):
            return
        figures = _figures(table)
        species = np.array([name or UNKNOWN for name in table["species"].to_pylist()], dtype=object)
        point, area = self._areas.holding(np.column_stack([floats(table, "apex_x"), floats(table, "apex_y")]))
        inside = np.unique(point)
        for number, rows in [(-1, inside), *((int(a), point[area == a]) for a in np.unique(area))]:
            self._gather(number, EVERYTHING, figures[rows])
            for name in np.unique(species[rows]):
                self._gather(number, name, figures[rows[species[rows] == name]])

    def _gather(self, area: int, species: str, figures: Any) -> None:
        if len(figures):
            self._parts.setdefault((area, species), []).append(figures)

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield the rows of the table, by area as they were given, after all of them; all species first."""
        shapes = self._areas
        sizes = {-1: shapes.all_hectares, **dict(enumerate(shapes.hectares))}
        species = {area: sorted(s for a, s in self._parts if a == area and s != EVERYTHING) for area in sizes}
        for area, hectares in sizes.items():
            for name in (EVERYTHING, *species[area]):
                parts = self._parts.get((area, name), [])
                figures = np.concatenate(parts) if parts else np.empty((0, len(FIGURES) + len(SUMS) + 1))
                place = EVERYTHING if area < 0 else shapes.names[area]
                yield {"area": place, "species": name, **_profile(figures.astype(np.float64), hectares)}

    def table(self) -> Any:
        """Return the rows as a table of Arrow."""
        return arrow().Table.from_pylist(list(self.rows()), schema=arrow_schema(STATISTICS))


def to_csv(rows: list[dict[str, Any]]) -> str:
    """Return rows as CSV: what is unknown is empty."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [column.name for column in STATISTICS], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def to_json(rows: list[dict[str, Any]]) -> str:
    """Return rows as JSON, with the units."""
    units = {column.name: column.unit for column in STATISTICS if column.unit}
    return json.dumps({"units": units, "rows": rows}, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _figures(table: Any) -> Any:
    """Return (N, figures + sums + 1) of every tree, float32; the last one says straight stems."""
    held = {name: floats(table, name) for name in table.schema.names if name in _WANTED}
    crown, height, dbh = held["crown_vol_m3"], held["height_m"], held["dbh_cm"]
    branches = sum(held[f"n_order{k}"] for k in range(1, 5))
    with np.errstate(divide="ignore", invalid="ignore"):
        made = {
            "branch_m_m3": held["total_len_m"] / crown,
            "branches_m3": branches / crown,
            "slenderness": 100 * height / dbh,
            "agb_t": held["agb_kg"] / 1000,
            "carbon_t": held["carbon_kg"] / 1000,
        }
    straight = [method == STRAIGHT for method in table["method"].to_pylist()]
    names = [name for name, *_ in (*FIGURES, *SUMS)]
    columns = [made[name] if name in made else held[name] for name in names]
    return np.column_stack([*columns, straight]).astype(np.float32)


_WANTED = {
    *(name for name, *_ in (*FIGURES, *SUMS)), "crown_vol_m3", "agb_kg", "carbon_kg",
    *(f"n_order{k}" for k in range(1, 5)),
}  # fmt: skip


def _profile(figures: Floats, hectares: float) -> dict[str, Any]:
    """Return the figures of a group of trees."""
    count = len(figures)
    sums = np.nansum(figures[:, len(FIGURES) : -1], axis=0).tolist()
    total = dict(zip((name for name, *_ in SUMS), sums, strict=True))
    row: dict[str, Any] = {
        "trees": count,
        "area_ha": _rounded(hectares),
        "trees_per_ha": _rounded(count / hectares) if hectares else None,
        "crown_cover_pct": _rounded(total["crown_area_m2"] / hectares / 100) if hectares else None,
        "agb_t_per_ha": _rounded(total["agb_t"] / hectares) if hectares else None,
        "straight_pct": _rounded(100 * float(figures[:, -1].mean())) if count else None,
        **{f"{name}_sum": _rounded(value) for name, value in total.items()},
    }
    for k, (name, *_) in enumerate(FIGURES):
        row |= {f"{name}_{of}": value for of, value in zip(SPREAD, _spread(figures[:, k]), strict=True)}
    return row


def _spread(values: Floats) -> list[float | None]:
    """Return mean, standard deviation and percentiles of what is known."""
    known = values[np.isfinite(values)]
    if not len(known):
        return [None] * len(SPREAD)
    deviation = float(known.std(ddof=1)) if len(known) > 1 else None
    return [
        _rounded(float(known.mean())),
        _rounded(deviation),
        *map(_rounded, np.percentile(known, (5, 50, 95))),
    ]


def _rounded(value: float | None) -> float | None:
    """Return a figure of six digits."""
    return None if value is None or not np.isfinite(value) else float(f"{value:.6g}")
