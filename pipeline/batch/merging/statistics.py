"""The profile of many trees: height, stem, crown and density of branches, by area and by species."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
    Column("area_ha", "float64", "ha", "size of the area, as far as cells that are done and tiles reach"),
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

Rows = NDArray[np.int64] | slice
"""Which of the trees that are held are meant."""


class Statistics:
    """Gather trees, table by table, and tell their profile.

    The figures of a tree are held once, however many areas it lies in: in 56 bytes, and 12 for each area.

    Parameters
    ----------
    areas : Areas
    """

    def __init__(self, areas: Areas) -> None:
        self._areas = areas
        self._trees = 0
        self._species: dict[str, int] = {}
        self._figures: list[list[Any]] = [[] for _ in range(len(FIGURES) + len(SUMS) + 1)]
        self._kinds: list[Any] = []
        self._pairs: tuple[list[Any], list[Any]] = ([], [])

    def add(self, table: Any) -> None:
        """Add trees, a table with the columns of `pipeline.batch.columns.MERGED`."""
        if not len(table):
            return
        point, area = self._areas.holding(np.column_stack([floats(table, "apex_x"), floats(table, "apex_y")]))
        inside, held = np.unique(point, return_inverse=True)
        for parts, values in zip(self._figures, _figures(table).T, strict=True):
            parts.append(values[inside])
        names = [name or UNKNOWN for name in table["species"].to_pylist()]
        kinds = np.array([self._species.setdefault(name, len(self._species)) for name in names], np.int32)
        self._kinds.append(kinds[inside])
        self._pairs[0].append(held + self._trees)
        self._pairs[1].append(area.astype(np.int32))
        self._trees += len(inside)

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield the rows of the table, by area as they were given, after all of them; all species first."""
        figures, kinds = [_joined(parts, np.float32) for parts in self._figures], self._ranks()
        yield from self._of_area(EVERYTHING, self._areas.all_hectares, figures, kinds)
        tree, area = _joined(self._pairs[0], np.int64), _joined(self._pairs[1], np.int32)
        order = np.argsort(area, kind="stable")
        ends = np.searchsorted(area, np.arange(len(self._areas.names) + 1), sorter=order).tolist()
        for k, (name, hectares) in enumerate(zip(self._areas.names, self._areas.hectares, strict=True)):
            rows = tree[order[ends[k] : ends[k + 1]]]
            yield from self._of_area(name, hectares, [values[rows] for values in figures], kinds[rows])

    def _of_area(
        self, area: str, hectares: float, figures: list[Any], kinds: Any
    ) -> Iterator[dict[str, Any]]:
        """Yield the rows of an area: that of all its trees, and one for each of its species."""
        yield {"area": area, "species": EVERYTHING, **_profile(figures, slice(None), hectares)}
        order = np.argsort(kinds, kind="stable")
        for rows in np.split(order, np.flatnonzero(np.diff(kinds[order])) + 1) if len(order) else ():
            name = sorted(self._species)[kinds[rows[0]]]
            yield {"area": area, "species": name, **_profile(figures, rows, hectares)}

    def _ranks(self) -> Any:
        """Return for each tree which species it is, by name."""
        ranks = np.argsort(np.argsort(list(self._species)))
        kinds = _joined(self._kinds, np.int32)
        return ranks[kinds].astype(np.int32) if len(kinds) else kinds


def to_table(rows: list[dict[str, Any]]) -> Any:
    """Return rows as a table of Arrow."""
    return arrow().Table.from_pylist(rows, schema=arrow_schema(STATISTICS))


def to_csv(rows: list[dict[str, Any]]) -> str:
    """Return rows as CSV: what is unknown is empty."""
    text = io.StringIO()
    writer = csv.DictWriter(text, [column.name for column in STATISTICS], lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def to_json(rows: list[dict[str, Any]]) -> str:
    """Return rows as JSON, with the units; a row a line."""
    units = {column.name: column.unit for column in STATISTICS if column.unit}
    lines = ",\n".join(json.dumps(row, ensure_ascii=False, allow_nan=False) for row in rows)
    return f'{{"units": {json.dumps(units)},\n"rows": [\n{lines}\n]}}\n'


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


def _joined(parts: list[Any], kind: type) -> Any:
    """Return arrays as one, which takes their place: they are not held twice."""
    parts[:] = [np.concatenate([np.empty(0, kind), *parts])]
    return parts[0]


def _profile(figures: list[Any], rows: Rows, hectares: float) -> dict[str, Any]:
    """Return the figures of a group of trees, a column at a time."""
    straight = figures[-1][rows]
    count = len(straight)
    sums = [float(np.nansum(values[rows], dtype=np.float64)) for values in figures[len(FIGURES) : -1]]
    total = dict(zip((name for name, *_ in SUMS), sums, strict=True))
    row: dict[str, Any] = {
        "trees": count,
        "area_ha": _rounded(hectares),
        "trees_per_ha": _rounded(count / hectares) if hectares else None,
        "crown_cover_pct": _rounded(total["crown_area_m2"] / hectares / 100) if hectares else None,
        "agb_t_per_ha": _rounded(total["agb_t"] / hectares) if hectares else None,
        "straight_pct": _rounded(100 * float(straight.mean(dtype=np.float64))) if count else None,
        **{f"{name}_sum": _rounded(value) for name, value in total.items()},
    }
    for k, (name, *_) in enumerate(FIGURES):
        row |= {f"{name}_{of}": value for of, value in zip(SPREAD, _spread(figures[k][rows]), strict=True)}
    return row


def _spread(values: Floats) -> list[float | None]:
    """Return mean, standard deviation and percentiles of what is known."""
    known = values[np.isfinite(values)].astype(np.float64)
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
