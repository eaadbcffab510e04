"""Statistics by area and species: figures by hand, and areas of a file."""

from __future__ import annotations

import csv
import io
import json
import tracemalloc
from pathlib import Path

import geopandas
import numpy as np
import pytest
import shapely

from pipeline.airborne.grid import Cell
from pipeline.batch.columns import completed, floats
from pipeline.batch.merging import shelf
from pipeline.batch.merging.areas import Areas, of_cells, read_areas, within_cells, within_tiles
from pipeline.batch.merging.statistics import STATISTICS, Statistics, to_csv, to_json, to_table
from pipeline.errors import InputFormatError, InputMissingError, OutputError
from pipeline.formats.geoparquet import arrow
from tests.batch.merging.fakes import cell_table

CELL = Cell(121_500.0, 487_000.0, 500.0)


def changed(table, **columns):
    for name, values in columns.items():
        place = table.schema.get_field_index(name)
        table = table.set_column(place, name, arrow().array(values, table.schema.field(name).type))
    return table


@pytest.fixture
def three():
    """Three trees of which the figures are known."""
    table = changed(
        cell_table(CELL, 40).slice(0, 3),
        height_m=[10.0, 20.0, 30.0],
        crown_diam_m=[4.0, 6.0, 8.0],
        crown_area_m2=[10.0, 30.0, 50.0],
        crown_base_h_m=[4.0, 5.0, None],
        dbh_cm=[20.0, 40.0, None],
        total_len_m=[80.0, 150.0, 2000.0],
        method=["mst", "mst", "straight_stem"],
        **{f"n_order{k}": [k, 0, 1] for k in range(1, 5)},
    )
    ids = table["tree_id"].to_pylist()
    stems = {
        ids[0]: ("Tilia cordata", "angiosperm", 21.0, 0.4),
        ids[1]: ("Pinus nigra", "gymnosperm", np.nan, 2.0),
    }
    return completed(table, stems)


def test_three_trees_by_hand(three):
    told = Statistics(of_cells([CELL]))
    told.add(three)
    rows = {(row["area"], row["species"]): row for row in told.rows()}
    assert list(rows) == [
        (area, species)
        for area in ("all", CELL.name)
        for species in ("all", "Pinus nigra", "Tilia cordata", "unknown")
    ]
    row = rows[CELL.name, "all"]
    assert (row["trees"], row["area_ha"], row["trees_per_ha"]) == (3, 25.0, 0.12)
    assert row["crown_cover_pct"] == pytest.approx(100 * 90 / 250_000, rel=1e-5)
    assert (row["height_m_mean"], row["height_m_sd"], row["height_m_p50"]) == (20.0, 10.0, 20.0)
    assert row["dbh_cm_mean"] == pytest.approx(np.mean(three["dbh_cm"].to_pylist()[:2]))
    assert row["straight_pct"] == pytest.approx(100 / 3, rel=1e-5)
    assert row["total_len_m_sum"] == 2230.0
    assert row["agb_t_sum"] == pytest.approx(sum(three["agb_kg"].to_pylist()) / 1000, rel=1e-5)
    lime = rows[CELL.name, "Tilia cordata"]
    assert lime["branch_m_m3_p50"] == pytest.approx(80 / (2 / 3 * 10 * 6), rel=1e-5)
    assert lime["branches_m3_mean"] == pytest.approx(10 / 40, rel=1e-5)
    assert lime["slenderness_mean"] == pytest.approx(1000 / three["dbh_cm"][0].as_py(), rel=1e-5)
    assert lime["height_m_sd"] is None


def test_figures_wait_on_the_disk_and_go_with_the_statistics(tmp_path):
    """Held is a tenth of what waits: 100 million trees have 5 GB of figures."""
    cells = [Cell(100_000.0 + 500 * k, 487_000.0, 500.0) for k in range(40)]
    whole = completed(cell_table(CELL, 5000), {})
    place = whole.schema.get_field_index("apex_x")
    east = floats(whole, "apex_x") - CELL.x0
    tables = [
        whole.set_column(place, "apex_x", arrow().array(east + cell.x0)) for cell in cells for _ in range(5)
    ]
    told = Statistics(of_cells(cells), tmp_path)
    told.add(tables[0])
    tracemalloc.start()
    for table in tables:
        told.add(table)
    held = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    trees = len(whole) * len(tables)
    assert held < 20 * trees, f"{held / trees:.0f} bytes a tree"
    assert next(told.rows())["trees"] == trees + len(whole)
    assert list(tmp_path.iterdir()) == [], "the file has no name"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is full")
def test_a_full_disk_under_the_figures_is_told(monkeypatch):
    with Path("/dev/full").open("r+b", buffering=0) as full:
        monkeypatch.setattr(shelf, "TemporaryFile", lambda **_: full)
        told = Statistics(of_cells([CELL]))
        with pytest.raises(OutputError, match=r"No space left on device\); free space, then merge again"):
            told.add(completed(cell_table(CELL, 10), {}))


def test_parts_and_order_do_not_matter():
    table = completed(cell_table(CELL, 200), {})
    whole, parts = Statistics(of_cells([CELL])), Statistics(of_cells([CELL]))
    whole.add(table)
    for start in range(0, len(table), 17):
        parts.add(table.slice(start, 17))
    assert list(whole.rows()) == list(parts.rows())


def test_a_tree_on_the_edge_is_in_one_cell():
    cells = [CELL, Cell(122_000.0, 487_000.0, 500.0)]
    edge = np.array([[122_000.0, 487_100.0], [121_999.9, 487_100.0], [121_500.0, 487_500.0]])
    assert of_cells(cells).holding(edge).T.tolist() == [[0, 1], [1, 0]]
    overlapping = Areas(("a", "b"), (shapely.box(0, 0, 2, 2), shapely.box(1, 0, 3, 2)))
    assert sorted(overlapping.holding(np.array([[1.5, 1.0]]))[1].tolist()) == [0, 1]
    assert overlapping.all_hectares == pytest.approx(6e-4)


def test_areas_of_a_file_count_only_where_cells_are(tmp_path):
    shapes = [
        shapely.box(121_400, 487_000, 121_750, 487_500),
        shapely.box(150_000, 400_000, 150_100, 400_100),
    ]
    frame = geopandas.GeoDataFrame({"Naam": ["Oost", "Elders"]}, geometry=shapes, crs="EPSG:28992")
    frame.to_file(tmp_path / "wijken.gpkg")
    areas = read_areas(tmp_path / "wijken.gpkg", "EPSG:7415")
    assert areas.names == ("Oost", "Elders")
    assert areas.hectares == pytest.approx((17.5, 1.0))
    inside = within_cells(areas, [CELL])
    assert inside.hectares == pytest.approx((12.5, 0.0))
    told = Statistics(inside)
    table = completed(cell_table(CELL, 100), {})
    told.add(table)
    rows = {row["area"]: row for row in told.rows() if row["species"] == "all"}
    west = sum(x <= 121_750 for x in table["apex_x"].to_pylist())
    assert rows["Oost"]["trees"] == rows["all"]["trees"] == west
    assert rows["Elders"]["trees"] == 0
    assert rows["Elders"]["trees_per_ha"] is None
    frame.to_crs("EPSG:4326").to_file(tmp_path / "wijken.geojson")
    again = read_areas(tmp_path / "wijken.geojson", "EPSG:7415")
    assert again.hectares == pytest.approx((17.5, 1.0), rel=1e-3)


def test_a_cell_at_the_edge_is_as_large_as_what_tiles_show_of_it():
    east = Cell(122_000.0, 487_000.0, 500.0)
    west, south, _, _ = CELL.core
    extents = [(west, south, west + 500, south + 500), (122_000.0, 487_000.0, 122_050.0, 488_000.0)]
    areas = within_tiles(of_cells([CELL, east]), extents)
    assert areas.hectares == pytest.approx((25.0, 2.5))
    assert areas.all_hectares == pytest.approx(27.5)
    edge = np.array([[122_050.0, 487_100.0]])
    assert areas.holding(edge).T.tolist() == [[0, 1]]  # a tree on the tile's own edge is still the cell's
    assert within_tiles(areas, []).hectares == areas.hectares
    assert of_cells([east]).hectares == (25.0,)


def test_files_without_areas_are_told(tmp_path):
    with pytest.raises(InputMissingError, match="check the name of the areas"):
        read_areas(tmp_path / "no.gpkg", None)
    points = geopandas.GeoDataFrame(geometry=geopandas.points_from_xy([1], [2]), crs="EPSG:4326")
    points.to_file(tmp_path / "points.geojson")
    with pytest.raises(InputFormatError, match="holds no polygon"):
        read_areas(tmp_path / "points.geojson", None)
    (tmp_path / "bad.gpkg").write_bytes(b"nothing")
    with pytest.raises(InputFormatError, match="no areas can be read there"):
        read_areas(tmp_path / "bad.gpkg", None)


def test_the_texts_say_the_same(three):
    told = Statistics(of_cells([CELL]))
    told.add(three)
    rows = list(told.rows())
    held = json.loads(to_json(rows))
    assert held["rows"] == rows
    assert held["units"]["dbh_cm_p95"] == "cm"
    read = list(csv.DictReader(io.StringIO(to_csv(rows))))
    assert [row["height_m_mean"] for row in read] == [str(row["height_m_mean"]) for row in rows]
    assert to_table(rows).column_names == [column.name for column in STATISTICS]
