"""What a user gives by mistake: one line that names the file and the remedy, and the right exit code."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import laspy
import numpy as np
import pytest
from pyproj import CRS

from pipeline.cloud import write_cloud
from pipeline.model import PointCloud

LINE = np.linspace([0, 0, 0], [1, 2, 5], 200)
PLANE = np.column_stack([np.tile(np.arange(15), 15), np.repeat(np.arange(15), 15), np.zeros(225)]) / 10

FEET = "+proj=tmerc +lat_0=40 +lon_0=-74 +x_0=0 +y_0=0 +ellps=GRS80 +towgs84=0,0,0 +units=us-ft +type=crs"


def save(path: Path, points) -> Path:
    np.savetxt(path, points, fmt="%.4f")
    return path


def complaint(result, code: int) -> str:
    """Return the one line on stderr."""
    assert result.exit_code == code, result.output
    lines = result.stderr.strip().splitlines()
    assert len(lines) == 1, result.stderr
    assert lines[0].startswith("treepipe: ")
    assert "Traceback" not in result.output
    return lines[0]


@pytest.mark.parametrize(
    ("name", "points", "words"),
    [
        ("one", LINE[:1], "1 point usable of 1"),
        ("two", LINE[:2], "2 points usable of 2"),
        ("three", LINE[:3], "3 points usable of 3"),
        ("equal", np.tile(LINE[3], (50, 1)), "come down to one place"),
        ("collinear", LINE, "on one line"),
        ("coplanar", PLANE, "in one plane"),
        ("nan", np.full((50, 3), np.nan), "0 points usable of 50"),
        ("inf", np.full((50, 3), np.inf), "0 points usable of 50"),
        ("far", 1e15 + 1e3 * LINE, "0 points usable of 200 (200 invalid)"),
    ],
)
def test_points_that_are_no_tree(run, tmp_path, name, points, words):
    cloud = save(tmp_path / f"{name}.xyz", points)
    line = complaint(run(cloud), 1)
    assert str(cloud) in line
    assert words in line
    assert ";" in line
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert [entry["status"] for entry in summary["inputs"]] == ["failed"]
    assert f"treepipe: {summary['inputs'][0]['error']}" == line


@pytest.mark.parametrize("command", ["run", "clean"])
@pytest.mark.parametrize(("crs", "unit"), [("EPSG:4326", "degree"), ("EPSG:2263", "US survey foot")])
def test_a_cloud_in_degrees_or_feet_is_refused(call, points, tmp_path, command, crs, unit):
    cloud = tmp_path / "strange.laz"
    write_cloud(PointCloud(points, np.zeros(3), crs), cloud)
    more = ["--out", tmp_path / "out", "--no-picture"] if command == "run" else ["-o", tmp_path / "c.laz"]
    line = complaint(call(command, cloud, *more), 1)
    assert f"{cloud}: its reference system {crs} counts in the unit {unit}" in line
    assert "reproject" in line


@pytest.mark.parametrize("command", ["run", "clean"])
@pytest.mark.parametrize("system", [FEET, "EPSG:28992+6360"], ids=["no number", "heights in feet"])
def test_feet_are_noticed_in_a_system_without_a_number_and_in_heights(
    call, points, tmp_path, command, system
):
    cloud = tmp_path / "feet.laz"
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales = np.full(3, 0.001)
    header.add_crs(CRS.from_user_input(system))
    las = laspy.LasData(header)
    las.xyz = points
    las.write(cloud)
    more = ["--out", tmp_path / "out", "--no-picture"] if command == "run" else ["-o", tmp_path / "c.laz"]
    line = complaint(call(command, cloud, *more), 1)
    assert f"{cloud}: its reference system counts in the unit US survey foot" in line
    assert "reproject" in line


def test_a_system_in_degrees_is_wrong_usage(run, sapling, tmp_path):
    assert "counts in the unit degree" in complaint(run(sapling, "--crs", "EPSG:4326"), 2)
    assert not (tmp_path / "out").exists()


def test_longitudes_without_a_system_are_guessed(run, points, tmp_path):
    cloud = tmp_path / "degrees.xyz"
    np.savetxt(cloud, points * [1e-5, 1e-5, 1] + [4.9, 52.3, 0], fmt="%.9f")
    assert "where x and y are degrees, reproject" in complaint(run(cloud), 1)


def test_a_skeleton_is_not_made_of_points_that_are_not_finite(call, tmp_path, points):
    cloud = save(tmp_path / "holes.xyz", np.vstack([points, np.full((3, 3), np.nan)]))
    line = complaint(call("skeleton", cloud, "-o", tmp_path / "s.skeleton.ply"), 1)
    assert "3 points of" in line
    assert "`treepipe clean`" in line


def test_a_cloud_elsewhere_than_the_skeleton_is_refused(call, made, tmp_path, points):
    """It would be searched for points for hours."""
    cloud = save(tmp_path / "far.xyz", points + [500_000, 0, 0])
    skeleton = made / "sapling" / "sapling.skeleton.ply"
    line = complaint(call("fit", skeleton, "--cloud", cloud, "-o", tmp_path / "m.npz"), 1)
    assert f"{cloud}: lies elsewhere than {skeleton}" in line


def test_the_cloud_of_fit_is_named_alone(call, made, tmp_path):
    skeleton, cloud = made / "sapling" / "sapling.skeleton.ply", tmp_path / "absent.laz"
    line = complaint(call("fit", skeleton, "--cloud", cloud, "-o", tmp_path / "m.npz"), 1)
    assert line.startswith(f"treepipe: {cloud}: there is no such file")


def test_a_command_that_is_not_there_is_answered_with_the_nearest(call):
    assert "do you mean 'skeleton'?" in complaint(call("skeletton", "a.laz"), 2)
    assert "No such command 'nothing'" in complaint(call("nothing"), 2)


def test_more_than_one_tree_can_be(run, tmp_path, points):
    cloud = save(tmp_path / "wide.xyz", np.vstack([points, points + [150, 20, 0]]))
    assert "treepipe batch" in complaint(run(cloud), 1)


def test_a_missing_file(run, tmp_path):
    assert "no such file" in complaint(run(tmp_path / "gone.xyz"), 1)


@pytest.mark.parametrize("name", ["a.xyz", "a.laz", "a.ply", "a.pcd"])
def test_an_empty_file(run, tmp_path, name):
    (tmp_path / name).touch()
    assert "(0 bytes)" in complaint(run(tmp_path / name), 1)


def test_a_file_without_points(run, tmp_path):
    (tmp_path / "a.xyz").write_text("# x y z\n")
    assert "a.xyz" in complaint(run(tmp_path / "a.xyz"), 1)


def test_a_folder_without_clouds(run, tmp_path):
    folder = tmp_path / "nothing"
    folder.mkdir()
    line = complaint(run(folder), 1)
    assert str(folder) in line
    assert "no point clouds" in line


def test_a_wrong_suffix_is_found_before_any_work(run, tmp_path, sapling):
    (tmp_path / "a.doc").write_text("1 2 3")
    assert "convert it" in complaint(run(sapling, tmp_path / "a.doc"), 2)
    assert not (tmp_path / "out").exists()


def test_a_truncated_laz(run, tmp_path, samples):
    whole = samples / "maple.laz"
    if not whole.is_file():
        pytest.skip("data/samples is not made; run scripts/make_samples.py")
    (tmp_path / "a.laz").write_bytes(whole.read_bytes()[:20000])
    assert str(tmp_path / "a.laz") in complaint(run(tmp_path / "a.laz"), 1)


def test_text_in_a_column_of_numbers(run, tmp_path):
    (tmp_path / "a.xyz").write_text("1 2 3\n4 five 6\n7 8 9\n")
    assert str(tmp_path / "a.xyz") in complaint(run(tmp_path / "a.xyz"), 1)


def test_single_points_that_are_not_finite_are_dropped(run, tmp_path, points):
    spoilt = points.copy()
    spoilt[5], spoilt[9, 2] = np.nan, np.inf
    assert run(save(tmp_path / "a.xyz", spoilt)).exit_code == 0
    assert json.loads((tmp_path / "out" / "a" / "report.json").read_text())["dropped"]["invalid"] == 2


def test_what_fails_does_not_stop_the_rest(run, tmp_path, sapling):
    result = run(tmp_path / "gone.xyz", sapling)
    complaint(result, 1)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert [entry["status"] for entry in summary["inputs"]] == ["failed", "ok"]
    assert (summary["ok"], summary["failed"]) == (1, 1)
    assert (tmp_path / "out" / "sapling" / "report.json").is_file()
    assert "1 of 2 done, 1 failed" in result.stdout


def test_an_unexpected_error_is_one_line_and_no_traceback(run, tmp_path, sapling, monkeypatch):
    def broken(*_arguments):
        return 1 / 0

    monkeypatch.setattr("pipeline.jobs.reconstruction.reconstruct", broken)
    line = complaint(run(sapling), 1)
    assert "unexpected ZeroDivisionError" in line
    assert "-v" in line
    assert "Traceback" in run(sapling, "-v", "--overwrite").stderr
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["failed"] == 1


def test_a_file_where_the_folder_should_be(run, tmp_path, sapling):
    (tmp_path / "out").write_text("")
    line = complaint(run(sapling, "--overwrite"), 1)
    assert str(tmp_path / "out") in line
    assert "--out" in line


def test_a_file_where_the_folder_of_a_tree_should_be(run, tmp_path, sapling):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "sapling").write_text("")
    assert str(tmp_path / "out" / "sapling") in complaint(run(sapling, "--overwrite"), 1)


@pytest.mark.parametrize("command", ["skeleton", "fit"])
def test_coordinates_beyond_all_measure_are_refused(call, tmp_path, made, command):
    cloud = save(tmp_path / "far.xyz", 1e300 * (1 + LINE))
    given = (cloud,) if command == "skeleton" else (next(made.rglob("*.skeleton.ply")), "--cloud", cloud)
    target = tmp_path / ("a.skeleton.ply" if command == "skeleton" else "a.npz")
    line = complaint(call(command, *given, "-o", target), 1)
    assert "200 points of 200 without plausible coordinates" in line


def test_a_file_that_looks_like_an_option(call, sapling, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("-a.xyz").write_bytes(sapling.read_bytes())
    assert "No such option" in complaint(call("info", "-a.xyz"), 2)
    assert "give the file as ./-a.xyz, or see" in complaint(call("info", "-a.xyz"), 2)
    assert call("info", "./-a.xyz").exit_code == 0
    assert "give the file" not in complaint(call("info", "-b.xyz"), 2)


def test_what_nobody_expected_is_one_line_too(call, sapling, monkeypatch):
    def broken(_path):
        msg = "first line\n\nsecond line"
        raise RuntimeError(msg)

    monkeypatch.setattr("pipeline.cloud.read_cloud", broken)
    assert "unexpected RuntimeError: first line second line; run it with -v" in complaint(
        call("info", sapling), 1
    )


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere every name is text")
def test_a_name_whose_bytes_are_no_text(sapling, tmp_path):
    def treepipe(*arguments: object) -> None:  # apart: the name in a log would end a worker of the tests
        command = [sys.executable, "-m", "pipeline", *map(os.fspath, arguments)]
        ended = subprocess.run(command, capture_output=True, check=False)
        assert ended.returncode == 0, ended.stderr.decode(errors="replace")

    cloud = tmp_path / os.fsdecode(b"oak\xe4.xyz")
    cloud.write_bytes(sapling.read_bytes())
    treepipe("run", cloud, "--out", tmp_path / "out", "--no-picture")
    folder = tmp_path / "out" / cloud.stem
    treepipe("convert", folder / f"{cloud.stem}.ls.json", folder / f"{cloud.stem}.ls.json.zst")
    treepipe("info", folder / f"{cloud.stem}.ls.json.zst")
    told = json.loads((folder / "report.json").read_text(encoding="utf-8"))["source"]["path"]
    assert os.fsencode(told) == os.fsencode(cloud)


def test_a_full_disk_leaves_no_half_written_file(run, tmp_path, sapling, monkeypatch):
    plain = Path.replace

    def full(self, target):
        if Path(target).name.endswith(".city.json"):
            raise OSError(errno.ENOSPC, "No space left on device")
        return plain(self, target)

    monkeypatch.setattr(Path, "replace", full)
    line = complaint(run(sapling), 1)
    assert "No space left on device" in line
    assert "free space" in line
    names = {path.name for path in (tmp_path / "out" / "sapling").iterdir()}
    assert names == {"sapling.ls.json"}
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["failed"] == 1


def test_a_missing_ground_file(run, tmp_path, sapling):
    assert "--ground" in complaint(run(sapling, "--ground", tmp_path / "gone.laz"), 1)
