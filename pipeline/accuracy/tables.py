"""A comparison as tables of text, for the terminal and the page."""

from __future__ import annotations

from typing import NamedTuple

from pipeline.accuracy.amounts import Amounts
from pipeline.accuracy.comparison import Comparison
from pipeline.accuracy.spread import Spread

UNKNOWN = "-"


class Table(NamedTuple):
    """A name, the heads of the columns, and rows by their label."""

    name: str
    head: tuple[str, ...]
    rows: dict[str, tuple[str, ...]]


DEVIATIONS = {
    "nodes": "nodes",
    "axis": "axis of A from B's",
    "surface": "bark of A from B's",
    "surface_back": "bark of B from A's",
}
AMOUNTS = {
    "volume_l": ("volume, L", "volume_error_pct"),
    "stem_volume_l": ("stem volume, L", "stem_volume_error_pct"),
    "branch_volume_l": ("branch volume, L", "branch_volume_error_pct"),
    "length_m": ("length, m", "length_error_pct"),
    "dbh_cm": ("DBH, cm", "dbh_error_pct"),
    "height_m": ("height, m", None),
    "branches": ("branches", None),
    "branches_ge_1cm": ("branches of 1 cm radius", None),
    "nodes": ("nodes", None),
}


def tables(found: Comparison) -> list[Table]:
    """Return the tables of what applies."""
    made = [
        _deviations(found),
        _amounts(found),
        _topology(found),
        _orders(found),
        _points(found),
        _rest(found),
    ]
    return [table for table in made if table.rows]


def as_text(found: Comparison) -> str:
    """Return the tables for a terminal."""
    blocks = []
    for table in tables(found):
        rows = [(table.name, *table.head), *((label, *cells) for label, cells in table.rows.items())]
        wide = [max(len(row[k]) for row in rows if k < len(row)) for k in range(max(map(len, rows)))]
        blocks.append(
            "\n".join(
                "  ".join(
                    cell.ljust(wide[k]) if k == 0 else cell.rjust(wide[k]) for k, cell in enumerate(row)
                ).rstrip()
                for row in rows
            )
        )
    return "\n\n".join(blocks)


def _deviations(found: Comparison) -> Table:
    rows: dict[str, tuple[str, ...]] = {}
    for key, label in DEVIATIONS.items():
        spread: Spread | None = getattr(found, key)
        if spread is not None:
            said = f"{label}, by {found.matched_by}" if key == "nodes" else label
            if key == "surface" and found.coverage is not None:
                said = "points from the bark"
            if key == "axis" and found.recall is None:
                said = "points from the axis"
            figures = (spread.min_mm, spread.max_mm, spread.mean_mm, spread.median_mm, spread.stdev_mm)
            rows[said] = (*(f"{v:.3f}" for v in (*figures, spread.p95_mm)), f"{spread.matched:,}")
    return Table("distances, mm", ("min", "max", "mean", "median", "stdev", "p95", "number"), rows)


def _amounts(found: Comparison) -> Table:
    known = found.amounts or {}
    a, b = known.get("a"), known.get("b")
    rows: dict[str, tuple[str, ...]] = {}
    for key, (label, error) in AMOUNTS.items():
        cells = [_amount(a, key), _amount(b, key)]
        off = getattr(found, error) if error else None
        if a is not None and any(cell != UNKNOWN for cell in cells):
            rows[label] = (*cells, _figure(off, "+.2f", " %")) if b is not None else (cells[0],)
    if b is not None and found.height_error_m is not None:
        rows["height, m"] = (*rows["height, m"][:2], f"{found.height_error_m:+.3f} m")
    return Table("tree", ("A", "B", "A - B") if b is not None else ("A",), rows)


def _amount(known: Amounts | None, key: str) -> str:
    value = None if known is None else getattr(known, key)
    return UNKNOWN if value is None else f"{value:,}" if isinstance(value, int) else f"{value:,.2f}"


def _topology(found: Comparison) -> Table:
    rows = {
        "recall": _figure(found.recall, ".4f"),
        "precision": _figure(found.precision, ".4f"),
        "order accuracy": _figure(found.order_accuracy, ".4f"),
        "radius error, mm": _figure(found.radius_error_mm, ".3f"),
        "ratio of branches of 1 cm radius": _figure(found.branches_ratio, ".3f"),
    }
    if found.branches is not None:
        some = found.branches
        rows["branches of B matched"] = f"{some.matched:,} of {some.b:,}"
        rows["of them on the same parent"] = f"{some.parent_matched:,}"
    if found.same_branching is not None:
        rows["same branches on the same parents"] = "yes" if found.same_branching else "no"
    return Table("axes", ("A in B",), {key: (cell,) for key, cell in rows.items() if cell != UNKNOWN})


def _orders(found: Comparison) -> Table:
    confusion, recall = found.order_confusion_m or (), found.recall_by_order or ()
    columns = max(map(len, confusion), default=0)
    rows = {}
    for k, part in enumerate(recall):
        cells = confusion[k] if k < len(confusion) else ()
        metres = (*(f"{v:.1f}" for v in cells), *[UNKNOWN] * (columns - len(cells)))
        rows[f"order {k} in B"] = (_figure(part, ".4f"), *metres)
    return Table("orders", ("recall", *(f"m of {k} in A" for k in range(columns))), rows)


def _points(found: Comparison) -> Table:
    rows = {"points within 5 cm of the bark": _figure(found.coverage, ".4f")}
    if found.unexplained is not None:
        rows["points farther off"] = f"{found.unexplained.points:,}"
        for k, clump in enumerate(found.unexplained.clumps[:5], 1):
            rows[f"  clump {k}"] = f"{clump.points:,} at {clump.x:.2f} {clump.y:.2f} {clump.z:.2f}"
    if found.unsupported is not None:
        bare = found.unsupported
        rows["wood without points"] = f"{bare.length_m:.2f} m ({100 * bare.share:.1f} %)"
        rows["branches mostly without points"] = f"{bare.branches:,}"
    rows["mean distance of the points from the truth, mm"] = _figure(found.surface_floor_mm, ".3f")
    return Table("points", ("",), {key: (cell,) for key, cell in rows.items() if cell != UNKNOWN})


def _rest(found: Comparison) -> Table:
    rows: dict[str, tuple[str, ...]] = {}
    if found.bytes:
        rows["bytes"] = tuple(UNKNOWN if n is None else f"{n:,}" for n in found.bytes.values())
    if found.shift_m:
        rows["shift removed, m"] = (f"{found.shift_m:.4f}",)
    return Table("files", ("A", "B"), rows)


def _figure(value: float | None, form: str, unit: str = "") -> str:
    return UNKNOWN if value is None else f"{value:{form}}{unit}"
