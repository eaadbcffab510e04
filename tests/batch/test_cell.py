"""A cell from its points to its four files: the border rule, the rows, the models, nothing half written."""

from __future__ import annotations

import errno
import json
import subprocess
import sys

import numpy as np
import pytest
from pyproj import CRS
from scipy.spatial import ConvexHull

from pipeline.airborne.grid import Cell
from pipeline.airborne.inventory import COLUMNS
from pipeline.airborne.raster import Raster
from pipeline.airborne.segmentation import Segmented
from pipeline.airborne.tree import AirborneTree
from pipeline.batch import cell as cells
from pipeline.batch.cell import CellTask, work_cell
from pipeline.cloud.parts import RECORD, Frame, Lattice, append, finish_part, start_part
from pipeline.errors import OutputError
from pipeline.formats import geoparquet
from pipeline.lsystem import Archive
from pipeline.output import whole_file

CELL = Cell(121_000.0, 487_000.0, 50.0)
CORE = np.array([121_000.0, 487_000.0])
FILES = ("manifest.json", "models.lsjson.jsonl.zst", "trees.city.jsonl", "trees.parquet")
DAY_S = 86_400.0
FLOWN_S = 1_260_000_000.0 - 1e9  # 10 December 2019 in adjusted standard GPS time
SPACING_M = 20.0


def crown(x, y, *, height=12.0, points=200, seed=0):
    """Points of a crown like an egg, the highest of them at its middle."""
    rng = np.random.default_rng(seed)
    off = rng.normal(size=(points, 3))
    off *= rng.random((points, 1)) ** (1 / 3) / np.linalg.norm(off, axis=1, keepdims=True)
    xyz = np.array([x, y, 0.65 * height]) + off * [2.5, 2.5, 0.33 * height]
    xyz[0] = x, y, height
    return xyz


def write_points(path, trees, *, standard_time=True, days=2.0):
    """Write trees as the batch writes the points of a cell; classes tell the trees apart."""
    frame = Frame(Lattice((0.001,) * 3, (0.0,) * 3), CRS.from_epsg(28992).to_wkt("WKT1_GDAL"), standard_time)
    start_part(path, frame)
    for number, xyz in enumerate(trees):
        records = np.zeros(len(xyz), RECORD)
        for axis, name in enumerate("XYZ"):
            records[name] = np.rint(xyz[:, axis] * 1000)
        records["user_data"] = records["intensity"] = number
        records["bit_fields"] = 1 | 1 << 4
        records["classification"] = 1
        records["gps_time"] = FLOWN_S + np.linspace(0, days * DAY_S, len(xyz))
        append(path, records)
    finish_part(path)
    return path


def by_intensity(cloud, *, ground=None, options=None):
    """Stand in for the segmentation: the trees are told apart by the intensity of their points."""
    del ground, options
    trees = []
    for number in np.unique(cloud.attributes["intensity"]):
        at = np.flatnonzero(cloud.attributes["intensity"] == number)
        xyz = cloud.xyz[at]
        apex = xyz[np.argmax(xyz[:, 2])]
        ring, area = apex[:2] + [[0, 0], [1, 0], [0, 1]], 0.5
        if len(at) > 3:
            hull = ConvexHull(xyz[:, :2])
            ring, area = xyz[hull.vertices, :2], hull.volume
        ground_z = -float(cloud.origin[2])
        trees.append(
            AirborneTree(at, apex, ground_z, apex[:2], ring, area, 2 * np.sqrt(area / np.pi), 4.0, ())
        )
    low = np.floor(cloud.xyz[:, :2].min(axis=0)) - 10 if len(cloud) else np.zeros(2)
    terrain = Raster(np.full((400, 400), -float(cloud.origin[2])), low, 0.5)
    return Segmented(tuple(trees), terrain, np.ones(len(cloud), dtype=bool))


@pytest.fixture(autouse=True)
def _segmented(monkeypatch):
    monkeypatch.setattr(cells, "segment", by_intensity)


def task_of(tmp_path, trees, *, cell=CELL, **more):
    folder = tmp_path / "out" / "cells" / cell.name
    folder.mkdir(parents=True)
    path = write_points(tmp_path / f"{cell.name}.las", trees)
    known = {"config_hash": "c0", "input_hash": "i0", "edition": "ahn4", "crs": "EPSG:7415"}
    return CellTask(cell, path, folder, **{**known, **more})


def rows_of(task):
    return geoparquet.read(task.folder / "trees.parquet").to_pylist()


@pytest.fixture
def park(tmp_path):
    """Three trees: in the core, on its western edge, and on its eastern one, which is the neighbour's."""
    places = ((20.0, 20.0), (0.0, 30.0), (50.0, 10.0))
    trees = [crown(*(CORE + place), seed=k) for k, place in enumerate(places)]
    return task_of(tmp_path, trees)


def test_a_cell_becomes_four_files(park):
    manifest = work_cell(park)
    assert sorted(path.name for path in park.folder.iterdir()) == sorted(FILES)
    assert json.loads((park.folder / "manifest.json").read_text()) == manifest
    assert manifest["trees"] == manifest["fallback_trees"] == 2
    assert manifest["failures"] == {}
    assert (manifest["config_hash"], manifest["input_hash"]) == ("c0", "i0")
    assert set(manifest["files"]) == set(FILES) - {"manifest.json"}
    assert 200 < manifest["points"] < 600


def test_an_apex_on_the_edge_belongs_to_one_cell(park, tmp_path):
    work_cell(park)
    east = Cell(CELL.x0 + CELL.size_m, CELL.y0, CELL.size_m)
    folder = tmp_path / "out" / "cells" / east.name
    neighbour = CellTask(east, park.points, folder, edition="ahn4", crs="EPSG:7415")
    work_cell(neighbour)
    mine, theirs = rows_of(park), rows_of(neighbour)
    assert [one["tree_id"] for one in mine] == ["ahn4_1210000_4870300", "ahn4_1210200_4870200"]
    assert [one["tree_id"] for one in theirs] == ["ahn4_1210500_4870100"]
    assert [one["n_points"] for one in [*mine, *theirs]] == [200, 200, 200]  # those in the buffer included


def test_rows_say_what_was_seen(park):
    work_cell(park)
    one = rows_of(park)[1]
    assert list(one) == [column.name for column in COLUMNS]
    assert (one["x"], one["y"], one["z_ground"]) == (121_020.0, 487_020.0, 0.0)
    assert one["height_m"] == pytest.approx(12.0)
    assert one["dbh_lo_cm"] < one["dbh_cm"] < one["dbh_hi_cm"]
    assert one["dbh_method"] == "allometric"
    assert one["dbh_n_points"] == 0
    assert one["flags"].split(",") == sorted({*one["flags"].split(","), "fallback", "no_trunk"})
    assert str(one["acq_date_min"]) == "2019-12-10"
    assert str(one["acq_date_max"]) == "2019-12-12"
    assert one["cell_id"] == CELL.name
    assert one["model_uri"] == f"cells/{CELL.name}/models.lsjson.jsonl.zst#{one['tree_id']}"
    assert one["crs_assumed"] is False
    assert one["n_order1"] > 3
    assert not any(isinstance(value, float) and not np.isfinite(value) for value in one.values())


def test_geometries_are_read_by_others(park):
    work_cell(park)
    frame = pytest.importorskip("geopandas").read_parquet(park.folder / "trees.parquet")
    assert frame.crs.to_epsg() == 7415
    assert frame.geometry.has_z.all()
    crowns = frame["crown"]
    assert crowns.is_valid.all()
    assert crowns.area.to_numpy() == pytest.approx(frame["crown_area_m2"].to_numpy(), rel=0.01)


def test_time_of_the_week_is_no_date(tmp_path):
    task = task_of(tmp_path, [])
    write_points(task.points, [crown(*(CORE + 20))], standard_time=False)
    work_cell(task)
    assert rows_of(task)[0]["acq_date_min"] is None


def test_models_are_in_the_archive_and_the_sequence(park):
    work_cell(park)
    names = [one["tree_id"] for one in rows_of(park)]
    assert list(Archive(park.folder / "models.lsjson.jsonl.zst").ids) == names
    lines = [json.loads(line) for line in (park.folder / "trees.city.jsonl").read_text().splitlines()]
    assert [line["id"] for line in lines[1:]] == names


def test_one_tree_is_taken_out(park, tmp_path):
    work_cell(park)
    source = park.folder / "models.lsjson.jsonl.zst"
    target = tmp_path / "tree.city.json"
    command = [sys.executable, "-m", "pipeline", "convert", f"{source}#ahn4_1210200_4870200", str(target)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert json.loads(target.read_text())["type"] == "CityJSON"


def test_the_same_points_give_the_same_bytes(park, tmp_path):
    work_cell(park)
    records = np.fromfile(park.points, RECORD, offset=park.points.stat().st_size - 600 * RECORD.itemsize)
    assert len(records) == 600
    shuffled = tmp_path / "shuffled.las"
    head = park.points.read_bytes()[: -records.nbytes]
    shuffled.write_bytes(head + np.random.default_rng(1).permutation(records).tobytes())
    again = CellTask(**{**park.__dict__, "points": shuffled, "folder": tmp_path / "again" / CELL.name})
    work_cell(again)
    for name in FILES[1:]:
        assert (again.folder / name).read_bytes() == (park.folder / name).read_bytes(), name


def test_a_tree_does_not_depend_on_its_cell(park, tmp_path):
    work_cell(park)
    wide = Cell(CELL.x0 - 50, CELL.y0 - 50, 200.0)
    far = crown(*(CORE + [-45.0, -40.0]), seed=9)
    others = [crown(*(CORE + place), seed=k) for k, place in enumerate(((20.0, 20.0), (0.0, 30.0)))]
    (tmp_path / "more").mkdir()
    more = task_of(tmp_path / "more", [*others, far], cell=wide)
    work_cell(more)
    mine, theirs = (Archive(one.folder / "models.lsjson.jsonl.zst") for one in (park, more))
    places = {one["tree_id"]: one for one in rows_of(more)}
    for one in rows_of(park):
        assert mine.read(one["tree_id"]) == theirs.read(one["tree_id"])
        other = places[one["tree_id"]]
        assert {k: v for k, v in one.items() if k not in ("cell_id", "model_uri")} == {
            k: v for k, v in other.items() if k not in ("cell_id", "model_uri")
        }


@pytest.mark.parametrize("trees", [[], [crown(*(CORE - 15))]], ids=["no points", "none in the core"])
def test_a_cell_without_trees_has_valid_files(tmp_path, trees):
    task = task_of(tmp_path, trees)
    manifest = work_cell(task)
    assert manifest["trees"] == 0
    assert rows_of(task) == []
    assert len(Archive(task.folder / "models.lsjson.jsonl.zst")) == 0
    assert len((task.folder / "trees.city.jsonl").read_text().splitlines()) == 1


@pytest.mark.parametrize("points", [1, 2, 3, 9])
def test_no_tree_is_dropped(tmp_path, points):
    task = task_of(tmp_path, [crown(*(CORE + 20))[:points]])
    assert work_cell(task)["fallback_trees"] == 1
    one = rows_of(task)[0]
    assert {"fallback", "few_points"} <= set(one["flags"].split(","))
    assert one["n_points"] == points
    assert one["height_m"] == pytest.approx(12.0)


def test_a_tree_that_fails_is_told_in_the_manifest(park, monkeypatch):
    def broken(*_inputs, **_options):
        msg = "matrix is singular"
        raise np.linalg.LinAlgError(msg)

    monkeypatch.setattr("pipeline.airborne.modelling.find_trunk", broken)
    manifest = work_cell(park)
    assert manifest["trees"] == 2
    assert set(manifest["failures"].values()) == {"matrix is singular"}
    assert all("failed" in one["flags"] for one in rows_of(park))


def test_trees_that_share_a_decimetre_have_names_of_their_own(tmp_path):
    low = crown(*(CORE + [20.02, 20.0]), height=8.0, seed=1)
    task = task_of(tmp_path, [low, crown(*(CORE + [20.01, 20.0]), seed=2)])
    work_cell(task)
    found = {one["tree_id"]: one["height_m"] for one in rows_of(task)}
    assert found == {"ahn4_1210200_4870200": 12.0, "ahn4_1210200_4870200_2": 8.0}


@pytest.mark.parametrize("full_at", FILES)
def test_a_full_disk_leaves_nothing_of_the_cell(park, monkeypatch, full_at):
    work_cell(park)  # old files go too

    def full(path, *_more):
        if str(path).endswith(full_at):
            raise OSError(errno.ENOSPC, "No space left on device")

    real = whole_file

    def whole(path):
        full(path)
        return real(path)

    for module in ("output", "formats.geoparquet", "lsystem.storage.archive", "cityjson.seq"):
        monkeypatch.setattr(f"pipeline.{module}.whole_file", whole)
    with pytest.raises(OutputError, match=r"cell 121000_487000_50: .*free space"):
        work_cell(park)
    assert list(park.folder.iterdir()) == []


def test_a_worker_that_fails_leaves_what_another_has_done_meanwhile(park, monkeypatch):
    """As when a driver is killed, and its worker comes to its end after the next run has done the cell."""

    def beaten(*_inputs, **_options):
        monkeypatch.undo()
        monkeypatch.setattr(cells, "segment", by_intensity)
        work_cell(park)
        msg = "a file has gone"
        raise OutputError(msg)

    monkeypatch.setattr(cells, "_write_trees", beaten)
    with pytest.raises(OutputError, match="a file has gone"):
        work_cell(park)
    assert sorted(path.name for path in park.folder.iterdir()) == sorted(FILES)
