"""Cells as a batch leaves them, with random trees: a town to try tables and maps on."""

from __future__ import annotations

import datetime
import json
from pathlib import Path

import numpy as np
import shapely

from pipeline.airborne.grid import Cell
from pipeline.airborne.inventory import COLUMNS
from pipeline.batch.columns import arrow_schema
from pipeline.formats import geoparquet
from pipeline.formats.geoparquet import arrow, points_wkb

CRS = "EPSG:7415"


def places_of_town(cell, count, draw):
    """Rows along streets, and clumps of a park: (N, 2), unlike each other by a decimetre."""
    x0, y0, side = cell.x0, cell.y0, cell.size_m
    rows = int(count * 0.65)
    street = np.round(draw.uniform(0, side, rows) / 60) * 60 + draw.choice([-6, 6], rows)
    along = np.round(draw.uniform(0, side, rows) / 9) * 9
    turned = draw.random(rows) < 0.5
    xy = np.where(turned[:, None], np.c_[street, along], np.c_[along, street]) + draw.normal(
        0, 0.7, (rows, 2)
    )
    park = side * np.array([0.3, 0.65]) + draw.normal(0, side / 9, (count - rows, 2))
    xy = np.clip(np.vstack([xy, park]), 0.2, side - 0.2) + [x0, y0]
    decimetres = np.unique(np.round(xy * 10).astype(np.int64), axis=0)
    return decimetres / 10


def cell_table(cell, count, seed=0, edition="ahn4"):
    """Trees of a cell, as a table of Arrow with the columns of the inventory."""
    draw = np.random.default_rng([seed, int(cell.x0), int(cell.y0)])
    apex = places_of_town(cell, count, draw)
    n = len(apex)
    height = np.round(draw.gamma(9, 1.45, n) + 2, 2)
    diameter = np.round(np.maximum(1.5, height * draw.normal(0.52, 0.1, n)), 2)
    dbh = 0.557 * (height * diameter) ** 0.809
    base = np.round(height * draw.uniform(0.1, 0.4, n), 2)
    xy = apex + draw.normal(0, 0.3, (n, 2))
    turn = np.linspace(0, 2 * np.pi, 17)[:-1]
    reach = diameter[:, None] / 2 * draw.normal(1, 0.08, (n, len(turn)))
    rings = apex[:, None, :] + np.stack([reach * np.cos(turn), reach * np.sin(turn)], axis=-1)
    crowns = shapely.polygons(rings)
    straight = draw.random(n) < 0.1
    ids = [f"{edition}_{x:.0f}_{y:.0f}" for x, y in np.round(apex * 10)]
    values = {
        "tree_id": ids,
        "x": xy[:, 0],
        "y": xy[:, 1],
        "z_ground": draw.normal(1.2, 0.3, n),
        "apex_x": apex[:, 0],
        "apex_y": apex[:, 1],
        "height_m": height,
        "crown_diam_m": diameter,
        "crown_area_m2": np.pi * diameter**2 / 4,
        "crown_base_h_m": base,
        "dbh_cm": dbh,
        "dbh_lo_cm": dbh * np.exp(-1.645 * 0.35),
        "dbh_hi_cm": dbh * np.exp(1.645 * 0.35),
        "dbh_method": ["allometric"] * n,
        "dbh_n_points": np.zeros(n, dtype=np.int32),
        "stem_vol_m3": np.pi * (dbh / 200) ** 2 * height * 0.45,
        "total_len_m": height * diameter * draw.uniform(2, 4, n),
        **{f"n_order{k}": draw.integers(0, 60 // k, n).astype(np.int32) for k in range(1, 5)},
        "n_points": draw.integers(60, 4000, n).astype(np.int32),
        "first_return_density": draw.uniform(8, 30, n),
        "acq_date_min": [datetime.date(2020, 12, 3)] * n,
        "acq_date_max": [datetime.date(2021, 1, 17)] * n,
        "flags": ["crs_assumed,sparse" if one else "crs_assumed" for one in straight],
        "edition": [edition] * n,
        "method": ["straight_stem" if one else "mst" for one in straight],
        "version": ["0.1.0"] * n,
        "config_hash": ["c0ffee"] * n,
        "cell_id": [cell.name] * n,
        "model_uri": [f"cells/{cell.name}/models.lsjson.jsonl.zst#{one}" for one in ids],
        "crs_assumed": [True] * n,
        "geometry": points_wkb(np.c_[xy, draw.normal(1.2, 0.3, n)]),
        "crown": shapely.to_wkb(crowns).tolist(),
    }
    values["z_ground"] = geoparquet.points_of(values["geometry"])[:, 2]
    order = np.argsort(ids)
    schema = arrow_schema(COLUMNS)
    return (
        arrow()
        .table({field.name: arrow().array(values[field.name], field.type) for field in schema})
        .take(order)
    )


def write_cell(out: Path, cell: Cell, table, crs=CRS, **manifest):
    """Write the files of a cell that the tables need; the manifest last."""
    folder = out / "cells" / cell.name
    geoparquet.write(table, folder / "trees.parquet", crs=crs)
    told = {"cell": cell.name, "trees": len(table), "config_hash": "c0ffee", "input_hash": "1", **manifest}
    (folder / "manifest.json").write_text(json.dumps(told))


def town(out: Path, columns=2, rows=2, count=150, size=500.0, seed=0, edition="ahn4"):
    """Write a town of cells, and return their tables by cell."""
    tables = {}
    for k in range(columns):
        for j in range(rows):
            cell = Cell(121_500 + k * size, 487_000 + j * size, size)
            tables[cell] = cell_table(cell, count, seed, edition)
            write_cell(out, cell, tables[cell])
    return tables
