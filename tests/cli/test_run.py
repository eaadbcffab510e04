"""`treepipe run` on good input: files, table, the same bytes, and Ctrl-C."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

VARYING = {"seconds", "peak_rss_mb", "version", "source", "name"}
"""What may differ between two runs on the same points in other files."""

FILES = (".ls.json", ".city.json", ".skeleton.ply", ".mesh.ply", ".qsm.csv")


def shuffled(points, path: Path) -> Path:
    np.savetxt(path, np.random.default_rng(3).permutation(points), fmt="%.4f")
    return path


def figures(folder: Path) -> dict[str, object]:
    known = json.loads((folder / "report.json").read_text())
    return {key: value for key, value in known.items() if key not in VARYING}


def test_files_and_summary(made, sapling):
    names = {path.name for path in (made / "sapling").iterdir()}
    assert names == {"report.json", *(f"sapling{suffix}" for suffix in FILES)}
    summary = json.loads((made / "summary.json").read_text())
    assert list(summary) == ["inputs", "ok", "failed", "seconds", "version"]
    assert [(each["name"], each["path"]) for each in summary["inputs"]] == [("sapling", str(sapling))]


def test_the_report_is_of_this_tree(made, points):
    known = json.loads((made / "sapling" / "report.json").read_text())
    assert known["points_in"] == len(points)
    assert known["height_m"] == pytest.approx(np.ptp(points[:, 2]), abs=0.05)
    assert known["lsystem"]["max_error_mm"] < 1


def test_formats_crs_and_species_arrive(run, tmp_path, sapling):
    result = run(sapling, "--formats", "lsjson,qsm", "--crs", "EPSG:28992", "--species", "alder")
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[1].startswith("sapling")
    folder = tmp_path / "out" / "sapling"
    names = {path.name for path in folder.iterdir()}
    assert names == {"report.json", "sapling.ls.json", "sapling.qsm.csv"}
    known = json.loads((folder / "report.json").read_text())
    assert (known["crs"], known["crs_assumed"]) == ("EPSG:28992", True)
    assert "crs_assumed" in known["flags"]


def test_quiet_is_quiet(run, sapling):
    result = run(sapling, "--formats", "qsm", "-q")
    assert (result.exit_code, result.output) == (0, "")


def test_several_stems_are_told(call, tmp_path, points):
    cloud = tmp_path / "two.xyz"
    np.savetxt(cloud, np.vstack([points, points + [4, 0, 0]]), fmt="%.4f")
    result = call("run", cloud, "--out", tmp_path / "out", "--formats", "qsm", "--no-picture")
    flags = json.loads((tmp_path / "out" / "two" / "report.json").read_text())["flags"]
    assert ("treepipe batch" in result.stderr) == ("several_stems" in flags)


def test_a_picture_that_cannot_be_drawn_is_a_warning(call, tmp_path, sapling, monkeypatch):
    from pipeline.view.graphics import NoGraphicsError

    def blind(*_arguments, **_options):
        msg = "nothing to draw with"
        raise NoGraphicsError(msg)

    monkeypatch.setattr("pipeline.run.picture", blind)
    result = call("run", sapling, "--out", tmp_path, "--formats", "qsm")
    assert result.exit_code == 0
    assert result.stderr.strip() == f"treepipe: {sapling}: no picture: nothing to draw with"


@pytest.mark.slow
def test_row_order_and_workers_do_not_change_a_byte(call, made, points, tmp_path):
    """Two workers, rows shuffled, against one process and the rows as they were."""
    (tmp_path / "a").mkdir()
    clouds = [shuffled(points, tmp_path / "a" / name) for name in ("sapling.xyz", "other.xyz")]
    result = call("run", *clouds, "--out", tmp_path / "out", "--workers", 2, "--no-picture")
    assert result.exit_code == 0, result.output
    assert figures(tmp_path / "out" / "other") == figures(tmp_path / "out" / "sapling")
    assert figures(tmp_path / "out" / "sapling") == figures(made / "sapling")
    for suffix in FILES:
        here, there = tmp_path / "out" / "sapling" / f"sapling{suffix}", made / "sapling" / f"sapling{suffix}"
        assert here.read_bytes() == there.read_bytes()


@pytest.mark.slow
def test_any_number_of_workers_writes_the_same_bytes(call, sapling, points, made, tmp_path):
    other = shuffled(points, tmp_path / "other.xyz")
    result = call("run", sapling, other, "--out", tmp_path / "out", "--workers", 2, "--no-picture")
    assert result.exit_code == 0, result.output
    for suffix in FILES:
        here, there = tmp_path / "out" / "sapling" / f"sapling{suffix}", made / "sapling" / f"sapling{suffix}"
        assert here.read_bytes() == there.read_bytes(), suffix


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_ctrl_c(sapling, points, tmp_path, workers):
    clouds = [sapling, *(shuffled(points, tmp_path / f"{number}.xyz") for number in range(12))]
    out = tmp_path / "out"
    command = [sys.executable, "-m", "pipeline", "run", *clouds, "--out", out, "--workers", str(workers)]
    with subprocess.Popen([*command, "--no-picture"], stderr=subprocess.PIPE, text=True) as process:
        while process.poll() is None and not list(out.glob("*/report.json")):
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 130, said
    assert "Traceback" not in said
    assert "interrupted" in said
    assert not list(out.rglob(".tmp-*"))
    assert not (out / "summary.json").exists()
