"""Cells become one table, once, in one order; every row finds its model; other programs read it."""

from __future__ import annotations

import hashlib
import importlib
import json
import sqlite3
from contextlib import closing
from dataclasses import replace

import geopandas
import numpy as np
import pyogrio
import pytest
import shapely
from pyproj import CRS as CRS_OF

from pipeline.airborne.biomass import biomass
from pipeline.airborne.grid import Cell
from pipeline.airborne.inventory import COLUMNS
from pipeline.batch.columns import ADDED, MERGED, completed
from pipeline.batch.merge import merge
from pipeline.batch.merging import maps
from pipeline.errors import InputFormatError, InputMissingError, MissingExtraError
from pipeline.exchange import read_model
from pipeline.formats import geoparquet
from pipeline.lsystem import ArchiveWriter, encode
from pipeline.model import Skeleton, TreeModel
from tests.batch.merging.fakes import CRS, cell_table, town, write_cell

CELL = Cell(121_500.0, 487_000.0, 500.0)


def merged(out, **more):
    summary = merge(out, **{"drawn": False, **more})
    return summary, geoparquet.read(out / "trees.parquet")


def test_all_trees_are_there_by_their_names(tmp_path):
    tables = town(tmp_path, columns=3, rows=2, count=80)
    summary, table = merged(tmp_path)
    names = table["tree_id"].to_pylist()
    assert names == sorted(name for one in tables.values() for name in one["tree_id"].to_pylist())
    assert (summary["trees"], summary["cells"], summary["crs"]) == (len(names), 6, CRS)
    assert table.column_names == [column.name for column in MERGED]
    assert len({column.name for column in MERGED}) == len(COLUMNS) + len(ADDED)
    given = {row["tree_id"]: row for one in tables.values() for row in one.to_pylist()}
    for row in table.to_pylist()[::37]:
        assert {name: row[name] for name in given[row["tree_id"]]} == given[row["tree_id"]]


def test_the_same_cells_give_the_same_bytes(tmp_path):
    tables = town(tmp_path / "a", count=60)
    for cell, table in reversed(tables.items()):
        write_cell(tmp_path / "b", cell, table)
    digests = []
    for name in "ab":
        merge(tmp_path / name, drawn=False)
        files = ("trees.parquet", "trees.gpkg", "statistics.json", "statistics.csv")
        digests.append([hashlib.sha256((tmp_path / name / one).read_bytes()).hexdigest() for one in files])
    assert digests[0] == digests[1]


def test_many_cells_in_small_groups_stay_in_order(tmp_path, monkeypatch):
    monkeypatch.setattr(geoparquet, "ROW_GROUP", 50)
    tables = town(tmp_path, columns=4, rows=3, count=40)
    _, table = merged(tmp_path)
    names = table["tree_id"].to_pylist()
    assert names == sorted(names)
    assert len(names) == sum(map(len, tables.values()))


def test_figures_that_are_not_finite_are_null(tmp_path):
    table = cell_table(CELL, 20)
    place = table.schema.get_field_index("dbh_cm")
    values = np.array([np.nan, np.inf, *table["dbh_cm"].to_pylist()[2:]])
    write_cell(tmp_path, CELL, table.set_column(place, "dbh_cm", [values]))
    _, table = merged(tmp_path)
    assert table["dbh_cm"].null_count == 2


def test_every_row_finds_its_model(tmp_path):
    tables = town(tmp_path, columns=2, rows=1, count=12)
    skeleton = Skeleton(np.array([[0.0, 0, 0], [0, 0, 4], [1, 0, 6]]), np.array([-1, 0, 1]))
    tree = TreeModel(skeleton, np.array([0.2, 0.15, 0.05]), np.zeros(3, dtype=np.int8), np.zeros(3))
    for cell, table in tables.items():
        with ArchiveWriter(tmp_path / "cells" / cell.name / "models.lsjson.jsonl.zst", level=3) as archive:
            for row in table.to_pylist():
                moved = replace(skeleton, origin=np.array([row["x"], row["y"], row["z_ground"]]))
                archive.add(row["tree_id"], encode(replace(tree, skeleton=moved)))
    _, table = merged(tmp_path)
    for row in table.to_pylist():
        model = read_model(f"{tmp_path}/{row['model_uri']}")
        assert model.skeleton.world[0] == pytest.approx([row["x"], row["y"], row["z_ground"]], abs=0.01)


def test_geopandas_and_gdal_read_what_is_written(tmp_path):
    tables = town(tmp_path, count=50)
    summary, table = merged(tmp_path, gpkg=tmp_path / "elsewhere" / "bomen.gpkg")
    path = tmp_path / "elsewhere" / "bomen.gpkg"
    assert str(path) in summary["files"]
    assert not (tmp_path / "trees.gpkg").exists()
    count = sum(map(len, tables.values()))
    frame = geopandas.read_parquet(tmp_path / "trees.parquet")
    assert (len(frame), frame.crs.to_epsg()) == (count, 7415)
    layers = dict(pyogrio.list_layers(path).tolist())
    assert layers == {"trees": "Point Z", "crowns": "Polygon", "boom": "Point Z", "statistics": None}
    trees = pyogrio.read_dataframe(path, layer="trees")
    assert [name for name in trees.columns if name != "geometry"] == [
        column.name for column in MERGED if column.name not in geoparquet.GEOMETRIES
    ]
    assert trees.crs.to_epsg() == 7415
    assert trees.geometry.z.tolist() == table["z_ground"].to_pylist()
    assert trees["acq_date_max"].astype(str).str.startswith("2021-01-17").all()
    crowns = pyogrio.read_dataframe(path, layer="crowns")
    apexes = shapely.points(frame.apex_x, frame.apex_y)
    assert shapely.contains(crowns.geometry.to_numpy(), apexes).mean() > 0.99
    boom = pyogrio.read_dataframe(path, layer="boom")
    assert boom.crs.to_epsg() == 7415
    assert (boom["boomhoogteActueel"] - trees["height_m"]).abs().max() <= 0.5
    assert boom["tree_id"].tolist() == trees["tree_id"].tolist()
    near = pyogrio.read_dataframe(path, layer="trees", bbox=(121_500, 487_000, 121_700, 487_200))
    assert 0 < len(near) < count
    statistics = pyogrio.read_dataframe(path, layer="statistics")
    assert statistics.loc[0, ["area", "species", "trees"]].tolist() == ["all", "all", count]


def test_stems_of_a_field_list_are_joined(tmp_path):
    table = cell_table(CELL, 60)
    write_cell(tmp_path, CELL, table)
    rows = table.to_pylist()
    lines = ["boomnummer;x;y;soort;stamdiameter"]
    lines += [
        f"B{k};{row['x'] + 0.1:.2f};{row['y']:.2f};Quercus robur;{30 + k}" for k, row in enumerate(rows[:5])
    ]
    lines += ["B5;100000;400000;Pinus nigra;20"]
    (tmp_path / "stems.csv").write_text("\n".join(lines))
    summary, joined = merged(tmp_path, stems=tmp_path / "stems.csv")
    assert (summary["stems"]["matched"], summary["stems"]["unmatched_names"]) == (5, ["B5"])
    told = json.loads((tmp_path / "stems.json").read_text())
    assert told["unmatched_stems"] == [{"name": "B5", "x": 1e5, "y": 4e5, "species": "Pinus nigra"}]
    held = {row["tree_id"]: row for row in joined.to_pylist()}
    for k, row in enumerate(rows[:5]):
        tree = held[row["tree_id"]]
        assert (tree["species"], tree["leaf_type"]) == ("Quercus robur", "angiosperm")
        oak = 0.694 * (row["height_m"] * row["crown_diam_m"]) ** 0.730
        assert (tree["stem_dbh_cm"], tree["dbh_method"]) == (30 + k, "allometric")  # beside, not over
        assert tree["dbh_cm"] == pytest.approx(oak, abs=0.006)
        assert tree["dbh_row"] == "palearctic-temperate-mixed angiosperm"
        assert tree["dbh_lo_cm"] == pytest.approx(oak * np.exp(-1.645 * 0.35), abs=0.006)
        assert tree["dbh_hi_cm"] == pytest.approx(oak * np.exp(1.645 * 0.35), abs=0.006)
        thicker = (tree["dbh_cm"] / row["dbh_cm"]) ** 2
        assert tree["stem_vol_m3"] == pytest.approx(row["stem_vol_m3"] * thicker, abs=1e-6)
        assert tree["agb_kg"] == pytest.approx(
            float(biomass([row["height_m"]], [row["crown_diam_m"]], ["angiosperm"]).agb_kg[0])
        )
        assert tree["stem_distance_m"] == pytest.approx(0.1, abs=0.01)
    others = [row for row in held.values() if row["species"] is None]
    assert len(others) == len(rows) - 5
    assert {row["dbh_method"] for row in others} == {"allometric"}
    assert {row["dbh_row"] for row in others} == {None}
    plain = {row["tree_id"]: (row["dbh_cm"], row["stem_vol_m3"]) for row in rows}
    assert all((row["dbh_cm"], row["stem_vol_m3"]) == plain[row["tree_id"]] for row in others)
    statistics = json.loads((tmp_path / "statistics.json").read_text())["rows"]
    assert {row["species"]: row["trees"] for row in statistics if row["area"] == "all"} == {
        "all": len(rows),
        "Quercus robur": 5,
        "unknown": len(rows) - 5,
    }


def test_a_merge_without_a_field_list_leaves_nothing_of_an_earlier_one(tmp_path):
    write_cell(tmp_path, CELL, cell_table(CELL, 5))
    (tmp_path / "stems.csv").write_text("x;y;soort\n100000;400000;Quercus robur\n")
    _, plain = merged(tmp_path)
    merged(tmp_path, stems=tmp_path / "stems.csv")
    assert (tmp_path / "stems.json").exists()
    _, again = merged(tmp_path)
    assert again.equals(plain)
    assert not (tmp_path / "stems.json").exists()


def test_sizes_reach_as_far_as_the_tiles(tmp_path):
    write_cell(tmp_path, CELL, cell_table(CELL, 20))
    west, south, _, _ = CELL.core
    plan = {"tiles": [{"extent": [west - 900, south - 900, west + 100, south + 200]}]}
    (tmp_path / "plan.json").write_text(json.dumps(plan))
    merged(tmp_path)
    rows = json.loads((tmp_path / "statistics.json").read_text())["rows"]
    assert {row["area"]: row["area_ha"] for row in rows} == {"all": 2.0, CELL.name: 2.0}
    assert rows[0]["trees_per_ha"] == rows[0]["trees"] / 2


@pytest.mark.parametrize("method", ["measured", "propagated"])
def test_a_diameter_that_was_seen_stays_whatever_the_species(method):
    table = cell_table(CELL, 4)
    place = table.schema.get_field_index("dbh_method")
    table = table.set_column(place, "dbh_method", [[method] * len(table)])
    stems = dict.fromkeys(table["tree_id"].to_pylist(), ("Picea abies", "gymnosperm", 12.0, 0.5))
    whole = completed(table, stems)
    assert whole["dbh_cm"].to_pylist() == table["dbh_cm"].to_pylist()
    assert set(whole["dbh_row"].to_pylist()) == {None}
    assert set(whole["leaf_type"].to_pylist()) == {"gymnosperm"}


def test_the_map_says_what_it_is_made_of_and_when(tmp_path):
    write_cell(tmp_path, CELL, cell_table(CELL, 5))
    merge(tmp_path)
    assert "from ahn4 seen 2021-01-17" in (tmp_path / "map.html").read_text()


def test_the_leaf_types_choose_different_rows():
    table = cell_table(CELL, 4)
    names = table["tree_id"].to_pylist()
    pine, oak = (
        completed(table, dict.fromkeys(names, ("", kind, np.nan, 0.5)))
        for kind in ("gymnosperm", "angiosperm")
    )
    ratio = np.array(pine["dbh_cm"].to_pylist()) / np.array(oak["dbh_cm"].to_pylist())
    assert ratio == pytest.approx(1.004 / 0.694, rel=1e-3)
    assert pine["agb_kg"].to_pylist() != oak["agb_kg"].to_pylist()


def test_the_package_is_of_the_version_that_gdal_of_some_years_ago_reads(tmp_path):
    town(tmp_path, columns=1, rows=1, count=20)
    merge(tmp_path, drawn=False)
    with closing(sqlite3.connect(tmp_path / "trees.gpkg")) as file:
        assert file.execute("PRAGMA user_version").fetchone() == (10300,)


def test_a_run_without_trees_has_empty_tables_and_maps(tmp_path):
    write_cell(tmp_path, CELL, cell_table(CELL, 20).slice(0, 0))
    summary = merge(tmp_path)
    assert summary["trees"] == 0
    assert len(pyogrio.read_dataframe(tmp_path / "trees.gpkg", layer="trees")) == 0
    assert (tmp_path / "map.png").stat().st_size > 1000
    assert "0 trees" in (tmp_path / "map.html").read_text()


def test_both_maps_are_made(tmp_path):
    town(tmp_path / "oost & <west>", count=30)
    summary = merge(tmp_path / "oost & <west>")
    names = [one.rpartition("/")[2] for one in summary["files"]]
    assert names == [
        "trees.parquet",
        "statistics.json",
        "statistics.csv",
        "trees.gpkg",
        "map.png",
        "map.html",
    ]
    assert "Trees of oost &amp; &lt;west&gt;" in (tmp_path / "oost & <west>" / "map.html").read_text()


def test_a_reference_system_without_a_number_is_kept(tmp_path):
    local = "+proj=tmerc +lat_0=52 +lon_0=5 +x_0=121000 +y_0=487000 +ellps=GRS80 +units=m"
    write_cell(tmp_path, CELL, cell_table(CELL, 20), crs=local)
    merge(tmp_path)
    frame = geopandas.read_parquet(tmp_path / "trees.parquet")
    trees = pyogrio.read_dataframe(tmp_path / "trees.gpkg", layer="trees")
    assert frame.crs.equals(CRS_OF(local))
    assert "Transverse Mercator" in trees.crs.to_wkt()
    assert "<span>unknown</span>" in (tmp_path / "map.html").read_text()  # the name that PROJ gives it


def test_cells_of_different_settings_are_noted(tmp_path):
    town(tmp_path, columns=1, rows=2, count=20)
    assert merge(tmp_path, drawn=False)["notes"] == []
    write_cell(tmp_path, CELL, cell_table(CELL, 20), config_hash="another")
    (note,) = merge(tmp_path, drawn=False)["notes"]
    assert note == "the cells were made with 2 different settings; run the batch again to make them alike"


def test_many_trees_are_drawn_evenly(tmp_path):
    tables = town(tmp_path, count=50)
    merge(tmp_path, drawn=False)
    count = sum(map(len, tables.values()))
    part = maps.read_map(tmp_path / "trees.parquet", crs=CRS, most=count // 3)
    names = geoparquet.read(tmp_path / "trees.parquet", ["tree_id"])["tree_id"].to_pylist()
    assert list(part.names) == names[::4]
    assert part.note == f"{len(part)} of {count} trees are drawn, evenly chosen; the tables hold all"


def test_what_does_not_fit_is_told(tmp_path):
    with pytest.raises(InputMissingError, match="run `treepipe batch TILE"):
        merge(tmp_path)
    write_cell(tmp_path, CELL, cell_table(CELL, 20))
    quarter = Cell(121_750.0, 487_000.0, 250.0)
    write_cell(tmp_path, quarter, cell_table(quarter, 20))
    with pytest.raises(InputFormatError, match="trees would be there twice; remove the folder"):
        merge(tmp_path)
    east = Cell(122_000.0, 487_000.0, 500.0)
    write_cell(tmp_path / "two", CELL, cell_table(CELL, 20))
    write_cell(tmp_path / "two", east, cell_table(east, 20), crs="EPSG:28992")
    with pytest.raises(InputFormatError, match=r"is in EPSG:28992, but .* in EPSG:7415"):
        merge(tmp_path / "two")
    write_cell(tmp_path / "three", CELL, cell_table(CELL, 20))
    write_cell(tmp_path / "three", east, cell_table(CELL, 20))
    with pytest.raises(InputFormatError, match="is there twice; remove the cells"):
        merge(tmp_path / "three")
    write_cell(tmp_path / "four", CELL, cell_table(CELL, 20).drop_columns("edition"))
    with pytest.raises(InputFormatError, match="has no column edition; write it anew"):
        merge(tmp_path / "four")
    (tmp_path / "four" / "cells" / CELL.name / "manifest.json").write_text("{")
    with pytest.raises(InputFormatError, match="is no JSON"):
        merge(tmp_path / "four")


@pytest.mark.parametrize("absent", ["pyarrow", "pyogrio", "shapely", "matplotlib.figure"])
def test_a_missing_package_is_named_with_its_remedy(tmp_path, monkeypatch, absent):
    write_cell(tmp_path, CELL, cell_table(CELL, 20))
    there = importlib.import_module

    def import_module(name, *more):
        if name == absent:
            raise ModuleNotFoundError(name)
        return there(name, *more)

    for room in (
        "pipeline.batch.merging.packages",
        "pipeline.formats.arrow_points",
        "pipeline.view.map_image",
    ):
        monkeypatch.setattr(f"{room}.import_module", import_module)
    with pytest.raises(MissingExtraError, match=rf"{absent.split('.')[0]}.*treepipe\[batch\]"):
        merge(tmp_path)
