"""Layers of geographic programs: measures are left out without a word, further layers are told."""

from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path

import pyogrio
import pytest
import shapely

from pipeline.batch.area import read_area
from pipeline.batch.merging.areas import read_areas
from pipeline.batch.vectors import read_vector

pa = pytest.importorskip("pyarrow", reason="needs the extra batch")
BOX = shapely.box(121_000, 487_000, 121_100, 487_100)


@pytest.fixture
def measured(tmp_path: Path) -> Path:
    """A GeoPackage of polygons that says it holds measures."""
    path = tmp_path / "areas.gpkg"
    table = pa.table({"name": ["park"], "geometry": [shapely.to_wkb(BOX)]})
    kind = {"geometry_name": "geometry", "geometry_type": "Polygon", "crs": "EPSG:28992"}
    pyogrio.write_arrow(table, path, layer="areas", driver="GPKG", **kind)
    with closing(sqlite3.connect(path)) as file, file:
        file.execute("UPDATE gpkg_geometry_columns SET m = 1")
    with pytest.warns(UserWarning, match=r"Measured \(M\) geometry types"):
        pyogrio.raw.read(path)
    return path


def test_measures_are_left_out_without_a_warning(measured, caplog):
    assert read_area(measured, "EPSG:28992").shape.area == pytest.approx(10_000)
    assert read_areas(measured, "EPSG:28992").names == ("park",)
    assert caplog.text == ""


def test_other_layers_are_told(measured, caplog):
    notes = pa.table({"note": ["a", "b"]})
    pyogrio.write_arrow(notes, measured, layer="notes", driver="GPKG", append=False)
    info, geometry, values = read_vector(measured)
    assert (info["fields"].tolist(), len(geometry), values[0].tolist()) == (["name"], 1, ["park"])
    assert f"{measured}: its layer areas is read, of others there are notes" in caplog.text
