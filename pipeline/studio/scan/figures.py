"""The report and comparisons as rows of text, and what flags mean."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from pipeline.accuracy import Comparison
from pipeline.accuracy.tables import tables

UNKNOWN = "-"

FLAGS: Mapping[str, str] = {
    "several_stems": "several stems, or points of several trees; they are modelled as one",
    "no_trunk": "no point shows the bark of the lower stem: its diameter is inferred",
    "no_ground": "no ground was found: the height counts from the lowest points",
    "floating_parts": "parts hang apart; the gaps are bridged",
    "leafy": "points of leaves; volume and length are less certain",
    "one_sided": "the stem is seen from one side only",
    "sparse": "points lie far apart; most radii are inferred",
    "crs_assumed": "the reference system was given, the file names none",
    "partial_crown": "the crown is not whole",
    "noise_class": "the file marks points as noise; they are left out",
    "relaxed_angles": "some branches leave at other angles than asked for",
    "unreached_leaves": "some points could not be reached at the angles asked for",
}
"""Flags of the report, in words."""


class Row(NamedTuple):
    """One line of the panel.

    Attributes
    ----------
    key, label, text : str
        The text has its unit, and its interval of 90 % where there is one.
    """

    key: str
    label: str
    text: str


class Kind(NamedTuple):
    """How a figure is written: label, unit, decimals, and the keys of its interval."""

    label: str
    unit: str = ""
    digits: int = 0
    interval: tuple[str, str] | None = None


KINDS: Mapping[str, Kind] = {
    "height_m": Kind("Height", "m", 2),
    "dbh_cm": Kind("Diameter at breast height", "cm", 1, ("dbh_lo_cm", "dbh_hi_cm")),
    "dbh_arc_deg": Kind("Bark seen at breast height", "°"),
    "dbh_source": Kind("That diameter is"),
    "crown_diameter_m": Kind("Crown diameter", "m", 2),
    "crown_base_m": Kind("Crown base", "m", 2),
    "volume_l": Kind("Volume", "L", 1, ("volume_lo_l", "volume_hi_l")),
    "stem_volume_l": Kind("of it the stem", "L", 1),
    "branch_volume_l": Kind("of it branches", "L", 1),
    "length_m": Kind("Length", "m", 1, ("length_lo_m", "length_hi_m")),
    "branches": Kind("Branches, the stem included"),
    "max_order": Kind("Highest branch order"),
    "nodes": Kind("Nodes"),
    "noise_mm": Kind("Range noise", "mm", 1),
    "ground_z": Kind("Height of the ground", "m", 2),
    "method": Kind("Method of the skeleton"),
    "method_reason": Kind("because"),
    "crs": Kind("Reference system"),
    "points_in": Kind("Points in the file"),
    "points_used": Kind("Points used"),
}
"""The figures of the panel by their keys in report.json, in its order."""

PARTS: Mapping[str, tuple[str, str, float]] = {
    "dropped": ("Left out: {}", "", 1.0),
    "radius_share": ("Length with radii {}", "%", 100.0),
    "surface_mm": ("Points from the bark, {}", "mm", 1.0),
    "seconds": ("Seconds: {}", "s", 1.0),
}
"""Figures with parts: label, unit and factor; parts that are nothing are left out."""


def rows(figures: Mapping[str, Any]) -> list[Row]:
    """Return the figures of a report that are known, as texts.

    Parameters
    ----------
    figures : mapping
        Keys of report.json.
    """
    made = [
        Row(key, kind.label, _text(figures, key, kind))
        for key, kind in KINDS.items()
        if figures.get(key) is not None
    ]
    for key, (label, unit, factor) in PARTS.items():
        for part, value in dict(figures.get(key) or {}).items():
            if value:
                text = f"{value:,}" if isinstance(value, int) else f"{factor * value:.1f}"
                made.append(Row(f"{key}.{part}", label.format(part), f"{text} {unit}".rstrip()))
    return made


def flags(figures: Mapping[str, Any]) -> list[dict[str, str]]:
    """Return the flags of a report with what they mean."""
    return [{"name": name, "says": FLAGS.get(name, name)} for name in figures.get("flags") or ()]


def compared(found: Comparison) -> list[dict[str, Any]]:
    """Return the tables of a comparison as plain values: name, heads and rows."""
    return [
        {
            "name": table.name,
            "head": list(table.head),
            "rows": [[label, *cells] for label, cells in table.rows.items()],
        }
        for table in tables(found)
    ]


def _text(figures: Mapping[str, Any], key: str, kind: Kind) -> str:
    value = figures[key]
    if not isinstance(value, int | float):
        return str(value)
    text = f"{value:,.{kind.digits}f}"
    if kind.interval is not None:
        low, high = (figures.get(end) for end in kind.interval)
        if low is not None and high is not None:
            text += f" ({low:,.{kind.digits}f} to {high:,.{kind.digits}f})"
    return f"{text} {kind.unit}".rstrip()
