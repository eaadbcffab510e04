"""The maps of a run: `map.png` and `map.html`, from the merged table."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.airborne.grid import Cell
from pipeline.batch.columns import MERGED, floats
from pipeline.batch.merging.packages import package
from pipeline.formats import geoparquet
from pipeline.formats.geoparquet import arrow
from pipeline.model import Floats
from pipeline.output import write_text
from pipeline.view.map_image import write_map_image
from pipeline.view.map_page import MOST_TREES, map_page
from pipeline.view.map_trees import Figure, Text, TreeMap, Window

FIGURES: tuple[tuple[str, str], ...] = (
    ("height_m", "height"),
    ("dbh_cm", "stem diameter"),
    ("crown_diam_m", "crown diameter"),
    ("crown_base_h_m", "crown base"),
    ("crown_vol_m3", "crown volume"),
    ("total_len_m", "stem and branches"),
    ("agb_kg", "dry mass"),
    ("n_points", "points"),
)
"""Figures on the page, the first of which colours it at the start."""

DRAWN = ("height_m", "crown_diam_m")
"""Figures that the picture needs."""

TEXTS: tuple[tuple[str, str], ...] = (
    ("species", "species"),
    ("dbh_method", "diameter from"),
    ("method", "model"),
    ("flags", "flags"),
    ("edition", "edition"),
    ("acq_date_max", "seen"),
    ("cell_id", "cell"),
)

ROUGH_M = 0.1
"""Crowns are drawn to this accuracy."""

MOST_FRAMES = 2000
"""More cells than these are not outlined."""


def write(table: Path, out: Path, *, crs: str | None, cells: Sequence[Cell] = ()) -> list[Path]:
    """Write both maps.

    Parameters
    ----------
    table : Path
        The merged GeoParquet.
    out : Path
        Folder; its name is the title.
    crs : str or None
    cells : sequence of Cell
        Their outlines are drawn.

    Returns
    -------
    list of Path

    Raises
    ------
    OutputError
        If a file cannot be written.
    MissingExtraError
        If matplotlib or shapely is not installed.
    """
    frames = tuple(cell.core for cell in cells[:MOST_FRAMES]) if len(cells) <= MOST_FRAMES else ()
    title, trees = f"Trees of {out.resolve().name}", read_map(table, crs=crs, frames=frames)
    image, page = out / "map.png", out / "map.html"
    write_map_image(trees if len(trees) == trees.total else _points(table, trees), image, title=title)
    write_text(page, map_page(trees, title=title))
    return [image, page]


def read_map(
    table: Path, *, crs: str | None, frames: tuple[Window, ...] = (), most: int = MOST_TREES
) -> TreeMap:
    """Read what the page draws; of more than `most` trees every second, third ... one, by tree_id."""
    total = geoparquet.rows_of(table)
    part = _every(table, max(1, math.ceil(total / most)))
    rings, ends = _outlines(part["crown"])
    units = {column.name: column.unit for column in MERGED}
    return TreeMap(
        names=part["tree_id"].to_pylist(),
        xy=np.column_stack([floats(part, "x"), floats(part, "y")]),
        rings=rings,
        ring_ends=ends,
        figures={name: Figure(label, _shown(units[name]), floats(part, name)) for name, label in FIGURES},
        texts={name: Text(label, _texts(part, name)) for name, label in TEXTS},
        crs=_named(crs),
        frames=frames,
        total=total,
        source=_source(part),
    )


def _source(table: Any) -> str:
    """Return which surveys saw the trees, and when."""
    pair = arrow("pyarrow.compute").min_max(table["acq_date_max"]).as_py()
    days = sorted({str(day) for day in pair.values() if day is not None})
    editions = ", ".join(sorted({one for one in table["edition"].to_pylist() if one}))
    return " ".join(
        filter(None, [f"from {editions}" * bool(editions), "seen", " to ".join(days)][: 3 if days else 1])
    )


def _every(table: Path, step: int) -> Any:
    """Return every `step`-th row of a table."""
    names = ["tree_id", "x", "y", "crown", *(name for name, _ in (*FIGURES, *TEXTS))]
    pa, parts, start = arrow(), [], 0
    for batch in geoparquet.batches(table, names):
        rows = np.arange(-start % step, len(batch), step)
        parts.append(batch.take(pa.array(rows)))
        start += len(batch)
    return pa.Table.from_batches(parts) if parts else geoparquet.read(table, names)


def _points(table: Path, part: TreeMap) -> TreeMap:
    """Return all trees without their crowns, for a picture in which these are too small to see."""
    whole = geoparquet.read(table, ["x", "y", "height_m", "crown_diam_m"])
    return TreeMap(
        names=(),
        xy=np.column_stack([floats(whole, "x"), floats(whole, "y")]),
        rings=np.empty((0, 2)),
        ring_ends=np.zeros(len(whole) + 1, dtype=np.int64),
        figures={name: part.figures[name]._replace(values=floats(whole, name)) for name in DRAWN},
        crs=part.crs,
        frames=part.frames,
        total=len(whole),
        source=part.source,
    )


def _outlines(column: Any) -> tuple[Floats, Any]:
    """Return the outer rings of polygons, anticlockwise and not closed, and where each begins.

    Of several parts the largest counts.
    """
    shapely = package("shapely")
    shapes = shapely.simplify(shapely.from_wkb(np.array(column.to_pylist(), dtype=object)), ROUGH_M)
    several = np.flatnonzero(shapely.get_num_geometries(shapes) > 1)
    for k in several.tolist():
        shapes[k] = max(shapely.get_parts(shapes[k]), key=lambda part: float(part.area))
    turned = shapely.orient_polygons(shapes)
    points, owner = shapely.get_coordinates(shapely.get_exterior_ring(turned), return_index=True)
    last = np.append(owner[1:] != owner[:-1], True) if len(owner) else np.zeros(0, dtype=bool)
    counts = np.bincount(owner[~last], minlength=len(shapes))
    return points[~last], np.concatenate([[0], np.cumsum(counts)])


def _texts(table: Any, name: str) -> list[str]:
    return ["" if value is None else str(value) for value in table[name].to_pylist()]


def _named(crs: str | None) -> str | None:
    """Return a reference system for people: its name, where it has no number."""
    if crs is None or len(crs) < 20:
        return crs
    from pyproj import CRS  # noqa: PLC0415 (slow to import)

    return str(CRS.from_user_input(crs).name)


def _shown(unit: str) -> str:
    """Return a unit for people."""
    return unit.replace("m3", "m³").replace("m2", "m²")
