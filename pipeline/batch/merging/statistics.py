"""The profile of many trees: height, stem, crown and density of branches, by area and by species."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from pipeline.airborne.fallback import STRAIGHT
from pipeline.airborne.inventory import Column
from pipeline.batch.columns import arrow_schema, floats
from pipeline.batch.merging.areas import Areas
from pipeline.batch.merging.shelf import Shelf
from pipeline.formats.geoparquet import arrow

Told = TypeVar("Told")

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


class Group(NamedTuple):
    """Trees of which a row tells: of an area, and of all species or one of them."""

    area: str
    species: str
    hectares: float
    trees: NDArray[np.int32] | slice


class Statistics:
    """Gather trees, table by table, and tell their profile.

    The figures of a tree wait on the disk, in 52 bytes, and are read one by one; held are 4 bytes a tree, and
    8 for each area that it lies in.

    Parameters
    ----------
    areas : Areas
    folder : Path, optional
        Where the figures wait; else where the system keeps files without names.
    """

    def __init__(self, areas: Areas, folder: Path | None = None) -> None:
        self._areas = areas
        self._trees = 0
        self._species: dict[str, int] = {}
        self._figures = Shelf(len(FIGURES) + len(SUMS) + 1, folder)
        self._kinds: list[Any] = []
        self._pairs: tuple[list[Any], list[Any]] = ([], [])

    def add(self, table: Any) -> None:
        """Add trees, a table with the columns of `pipeline.batch.columns.MERGED`."""
        if not len(table):
            return
        point, area = self._areas.holding(np.column_stack([floats(table, "apex_x"), floats(table, "apex_y")]))
        inside, held = np.unique(point, return_inverse=True)
        self._figures.add(_figures(table)[inside])
        names = [name or UNKNOWN for name in table["species"].to_pylist()]
        kinds = np.array([self._species.setdefault(name, len(self._species)) for name in names], np.int32)
        self._kinds.append(kinds[inside])
        self._pairs[0].append((held + self._trees).astype(np.int32))
        self._pairs[1].append(area.astype(np.int32))
        self._trees += len(inside)

    def rows(self) -> Iterator[dict[str, Any]]:
        """Yield the rows of the table, by area as they were given, after all of them; all species first."""
        groups = list(self._groups())
        spreads = [self._told(k, _spread, groups) for k in range(len(FIGURES))]
        sums = [self._told(len(FIGURES) + k, _sum, groups) for k in range(len(SUMS))]
        straight = self._told(len(FIGURES) + len(SUMS), _count_and_share, groups)
        for k, group in enumerate(groups):
            row: dict[str, Any] = {"area": group.area, "species": group.species}
            row |= _densities(group.hectares, [told[k] for told in sums], straight[k])
            for (figure, *_), spread in zip(FIGURES, spreads, strict=True):
                row |= {f"{figure}_{of}": value for of, value in zip(SPREAD, spread[k], strict=True)}
            yield row

    def _told(self, number: int, tell: Callable[[Any], Told], groups: list[Group]) -> list[Told]:
        """Return what a figure tells of each group; it alone is held meanwhile."""
        values = self._figures.column(number)
        return [tell(values[group.trees]) for group in groups]

    def _groups(self) -> Iterator[Group]:
        """Yield the groups in the order of their rows."""
        kinds, (tree, area) = self._ranks(), (_joined(parts, np.int32) for parts in self._pairs)
        yield Group(EVERYTHING, EVERYTHING, self._areas.all_hectares, slice(None))
        yield from self._by_species(EVERYTHING, self._areas.all_hectares, _sorted(kinds), kinds)
        order = _sorted(area)
        tree, ends = tree[order], np.bincount(area, minlength=len(self._areas.names)).cumsum().tolist()
        for k, (name, hectares) in enumerate(zip(self._areas.names, self._areas.hectares, strict=True)):
            trees = tree[ends[k - 1] if k else 0 : ends[k]]
            yield Group(name, EVERYTHING, hectares, trees)
            yield from self._by_species(name, hectares, trees[_sorted(kinds[trees])], kinds)

    def _by_species(self, area: str, hectares: float, trees: Any, kinds: Any) -> Iterator[Group]:
        """Yield a group for each species of trees that are sorted by it."""
        known = sorted(self._species)
        for part in np.split(trees, np.flatnonzero(np.diff(kinds[trees])) + 1) if len(trees) else ():
            yield Group(area, known[kinds[part[0]]], hectares, part)

    def _ranks(self) -> Any:
        """Return for each tree which species it is, by name."""
        ranks = np.argsort(np.argsort(list(self._species)))
        kinds = _joined(self._kinds, np.int32)
        return ranks.astype(np.int32)[kinds] if len(kinds) else kinds


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


def _sorted(values: Any) -> Any:
    """Return the order that sorts values; equal ones stay as they stand."""
    return np.argsort(values, kind="stable").astype(np.int32)


def _sum(values: Any) -> float:
    return float(np.nansum(values, dtype=np.float64))


def _count_and_share(values: Any) -> tuple[int, float]:
    return len(values), float(values.mean(dtype=np.float64)) if len(values) else np.nan


def _densities(hectares: float, sums: list[float], straight: tuple[int, float]) -> dict[str, Any]:
    """Return how many trees of a group there are, their sums, and both by the hectare."""
    count, share = straight
    total = dict(zip((name for name, *_ in SUMS), sums, strict=True))
    return {
        "trees": count,
        "area_ha": _rounded(hectares),
        "trees_per_ha": _rounded(count / hectares) if hectares else None,
        "crown_cover_pct": _rounded(total["crown_area_m2"] / hectares / 100) if hectares else None,
        "agb_t_per_ha": _rounded(total["agb_t"] / hectares) if hectares else None,
        "straight_pct": _rounded(100 * share),
        **{f"{name}_sum": _rounded(value) for name, value in total.items()},
    }


def _spread(values: Any) -> list[float | None]:
    """Return mean, standard deviation and percentiles of what is known."""
    known = values[np.isfinite(values)].astype(np.float64)
    if not len(known):
        return [None] * len(SPREAD)
    mean = float(known.mean())
    deviation = float(known.std(ddof=1)) if len(known) > 1 else None
    percentiles = np.percentile(known, (5, 50, 95), overwrite_input=True)  # the last that it is needed for
    return [_rounded(mean), _rounded(deviation), *map(_rounded, percentiles)]


def _rounded(value: float | None) -> float | None:
    """Return a figure of six digits."""
    return None if value is None or not np.isfinite(value) else float(f"{value:.6g}")
