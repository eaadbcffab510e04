"""GeoParquet: what the specification asks for, the same bytes, and sentences for damaged files."""

from __future__ import annotations

import json
import time

import geopandas
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import shapely

from pipeline.errors import InputFormatError, InputMissingError, UsageError
from pipeline.formats import geoparquet
from pipeline.formats.geoparquet import GeoparquetWriter, points_of, points_wkb


def table(count=5, seed=0):
    draw = np.random.default_rng(seed)
    xyz = draw.uniform(0, 100, (count, 3)) + [121_000, 487_000, 0]
    crowns = shapely.to_wkb(shapely.buffer(shapely.points(xyz[:, :2]), 3)).tolist()
    return pa.table(
        {
            "tree_id": [f"t{k:07d}" for k in range(count)],
            "height_m": draw.uniform(2, 30, count),
            "geometry": points_wkb(xyz),
            "crown": pa.array([*crowns[:-1], None], pa.binary()),
        }
    ), xyz


def test_what_is_written_is_read_again(tmp_path):
    rows, xyz = table()
    geoparquet.write(rows, tmp_path / "t.parquet", crs="EPSG:7415")
    again = geoparquet.read(tmp_path / "t.parquet")
    assert again.equals(rows)
    assert geoparquet.crs_of(tmp_path / "t.parquet") == "EPSG:7415"
    assert points_of(again["geometry"]) == pytest.approx(xyz, abs=0)
    assert geoparquet.read(tmp_path / "t.parquet", ["height_m"]).column_names == ["height_m"]


def test_the_key_geo_says_what_the_specification_asks_for(tmp_path):
    rows, xyz = table()
    geoparquet.write(rows, tmp_path / "t.parquet", crs="EPSG:7415")
    geo = json.loads(pq.read_metadata(tmp_path / "t.parquet").metadata[b"geo"])
    assert (geo["version"], geo["primary_column"]) == ("1.1.0", "geometry")
    point, crown = geo["columns"]["geometry"], geo["columns"]["crown"]
    assert (point["encoding"], point["geometry_types"], crown["geometry_types"]) == (
        "WKB",
        ["Point Z"],
        ["Polygon"],
    )
    assert point["bbox"] == [*xyz.min(axis=0), *xyz.max(axis=0)]
    assert point["crs"]["id"] == {"authority": "EPSG", "code": 7415}
    assert crown["crs"]["id"] == {"authority": "EPSG", "code": 28992}


def test_geopandas_reads_both_geometries(tmp_path):
    rows, xyz = table()
    geoparquet.write(rows, tmp_path / "t.parquet", crs="EPSG:7415")
    frame = geopandas.read_parquet(tmp_path / "t.parquet")
    assert frame.crs.to_epsg() == 7415
    assert np.c_[frame.geometry.x, frame.geometry.y, frame.geometry.z] == pytest.approx(xyz, abs=0)
    assert frame["crown"].iloc[0].area == pytest.approx(28, abs=0.3)
    assert frame["crown"].iloc[-1] is None


def test_without_a_reference_system_none_is_claimed(tmp_path):
    geoparquet.write(table()[0], tmp_path / "t.parquet", crs=None)
    assert geoparquet.crs_of(tmp_path / "t.parquet") is None
    assert geopandas.read_parquet(tmp_path / "t.parquet").crs is None


def test_the_same_rows_give_the_same_bytes_however_they_come(tmp_path, monkeypatch):
    monkeypatch.setattr(geoparquet, "ROW_GROUP", 100)
    rows, _ = table(1234)
    geoparquet.write(rows, tmp_path / "one.parquet", crs="EPSG:7415")
    for name, step in (("two", 7), ("three", 333)):
        with GeoparquetWriter(tmp_path / f"{name}.parquet", rows.schema, crs="EPSG:7415") as file:
            for start in range(0, len(rows), step):
                file.write(rows.slice(start, step))
        assert (tmp_path / f"{name}.parquet").read_bytes() == (tmp_path / "one.parquet").read_bytes()
    assert pq.read_metadata(tmp_path / "two.parquet").num_row_groups == 13
    batches = list(geoparquet.batches(tmp_path / "two.parquet", rows=50))
    assert sum(map(len, batches)) == 1234
    assert max(map(len, batches)) == 50


def test_an_empty_table_is_a_table(tmp_path):
    rows = table()[0].slice(0, 0)
    geoparquet.write(rows, tmp_path / "t.parquet", crs="EPSG:7415")
    assert geoparquet.read(tmp_path / "t.parquet").equals(rows)
    assert geopandas.read_parquet(tmp_path / "t.parquet").empty


def test_half_a_million_rows_take_about_a_second(tmp_path):
    rows, _ = table(100_000)
    rows = rows.set_column(3, "crown", pa.array([rows["crown"][0].as_py()] * len(rows), pa.binary()))
    begin = time.process_time()
    with GeoparquetWriter(tmp_path / "t.parquet", rows.schema, crs="EPSG:7415") as file:
        for _ in range(5):
            file.write(rows)
    assert time.process_time() - begin < 5  # measured 1 s; machines differ
    assert geoparquet.rows_of(tmp_path / "t.parquet") == 500_000


def test_nothing_is_left_where_writing_fails(tmp_path):
    rows, _ = table()

    def write_two():
        with GeoparquetWriter(tmp_path / "t.parquet", rows.schema, crs=None) as file:
            file.write(rows)
            file.write(rows.drop_columns("height_m"))

    with pytest.raises(UsageError, match="do not fit the columns"):
        write_two()
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(UsageError, match="inside `with"):
        GeoparquetWriter(tmp_path / "t.parquet", rows.schema, crs=None).write(rows)


def test_damaged_files_are_told_in_a_sentence(tmp_path):
    path = tmp_path / "t.parquet"
    with pytest.raises(InputMissingError, match="no such file; check the name"):
        geoparquet.read(path)
    path.write_bytes(b"PAR1 and no more")
    with pytest.raises(InputFormatError, match=r"cannot be read as Parquet.*write the file anew"):
        geoparquet.read(path)
    geoparquet.write(table()[0], path, crs=None)
    with pytest.raises(InputFormatError, match="has no column trunk; write it anew"):
        geoparquet.read(path, ["trunk"])
    pq.write_table(pa.table({"a": [1]}).replace_schema_metadata({"geo": "[]x"}), path)
    with pytest.raises(InputFormatError, match="key geo of the file is damaged"):
        geoparquet.crs_of(path)
    with pytest.raises(UsageError, match="no reference system that pyproj knows"):
        geoparquet.write(table()[0], path, crs="EPSG:0")


def test_points_of_postgis_are_read_and_others_refused():
    point = shapely.Point(1, 2, 3)
    column = pa.array([shapely.to_wkb(point), shapely.to_wkb(point, flavor="iso"), None], pa.binary())
    assert points_of(column).tolist() == [[1, 2, 3], [1, 2, 3]]
    for other in (shapely.Point(1, 2), shapely.LineString([(0, 0), (1, 1)])):
        with pytest.raises(InputFormatError, match="is no POINT Z"):
            points_of(pa.array([shapely.to_wkb(other)], pa.binary()))
