"""`treepipe batch` as a user calls it, with a work function that does little."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from tests.batch.stubs import count, listing, make_tile, treeless
from tests.batch.workerless import Given

ROOT = Path(__file__).resolve().parent.parent.parent
SMALL = ("--core-m", 50, "--buffer-m", 5)


@pytest.fixture
def tile(tmp_path) -> Path:
    return make_tile(tmp_path / "tile.laz", size_m=99.0)


@pytest.fixture
def little(monkeypatch):
    """Let cells be counted instead of modelled."""
    from pipeline.batch import cell

    monkeypatch.setattr(cell, "work", count)


@pytest.mark.usefixtures("little")
def test_a_run_is_done_told_resumed_and_refused_for_other_settings(call, tile, tmp_path):
    out = tmp_path / "out"
    absent = tmp_path / "absent.laz"
    first = call("batch", tile, absent, "--out", out, *SMALL, "--workers", 2, "--no-merge", "-v")
    assert first.exit_code == 1, first.output
    assert f"{absent}: there is no such file" in first.stderr
    assert "dashboard of the workers: http://" in first.stderr
    assert "4 of 4 cells done, 0 quarantined, 4000 trees" in first.stdout
    summary = json.loads((out / "summary.json").read_text())
    assert summary["failed"][0]["path"] == str(absent)
    assert (summary["planned"], summary["done"], summary["trees"]) == (4, 4, 4000)
    before = listing(out)

    again = call("batch", tile, "--out", out, *SMALL, "--no-merge")
    assert again.exit_code == 0, again.output
    assert listing(out) == before
    assert json.loads((out / "summary.json").read_text())["trees"] == 4000

    other = call("batch", tile, "--out", out, *SMALL, "--set", "clean.voxel_m=0.03")
    assert other.exit_code == 2
    assert "config_hash" in other.stderr

    told = call("batch", "status", out)
    assert told.exit_code == 0
    assert told.stdout.splitlines()[-1] == "4 cells, 4 done, 0 quarantined, 0 missing, 4000 trees"
    (out / "cells" / "121000_487000_50" / "manifest.json").unlink()
    (out / "quarantine").mkdir(exist_ok=True)
    (out / "quarantine" / "121050_487000_50.json").write_text('{"reason": "failed", "error": "bad luck"}')
    (out / "cells" / "121050_487000_50" / "manifest.json").unlink()
    states = json.loads(call("batch", "status", out, "--json").stdout)
    assert (states["done"], states["quarantined"], states["missing"]) == (2, 1, 1)
    assert states["cells"][2] == {
        "cell": "121050_487000_50", "state": "quarantined", "trees": None, "fallback_trees": None,
        "points": None, "seconds": None, "reason": "failed", "error": "bad luck",
    }  # fmt: skip
    freed = call("batch", "retry", out)
    assert freed.exit_code == 0
    assert freed.stdout.splitlines()[0] == "121050_487000_50"
    assert json.loads(call("batch", "status", out, "--json").stdout)["missing"] == 2


def test_a_dry_run_writes_nothing(call, tile, tmp_path):
    result = call("batch", tile, "--out", tmp_path / "out", *SMALL, "--dry-run", "-v", "--workers", 2)
    assert result.exit_code == 0, result.output
    hours = "hours            about 0.00026 in an open town, 0.0011 in dense forest"
    for word in (
        "cells            4 of 50 m",
        "0.004 million",
        "GB",
        hours,
        "on 2 workers",
        "121050_487050_50",
    ):
        assert word in result.stdout
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("little")
def test_a_dry_run_tells_of_the_run_that_its_folder_holds(call, tile, tmp_path, monkeypatch):
    monkeypatch.setattr("pipeline.batch.engine.cluster", Given)
    out = tmp_path / "out"
    call("batch", tile, "--out", out, *SMALL, "--no-merge", "--only", "121050_487000_50")
    before = listing(out)
    same = call("batch", tile, "--out", out, *SMALL, "--dry-run")
    assert same.exit_code == 0, same.output
    assert "begun            1 done, 0 quarantined, 3 missing" in same.stdout
    for other, what in (
        (("--set", "clean.voxel_m=0.03"), "settings"),
        (("--edition", "x"), "tiles or areas"),
    ):
        refused = call("batch", tile, "--out", out, *SMALL, "--dry-run", *other)
        assert refused.exit_code == 2, refused.output
        assert f"holds results of other {what}" in refused.stderr
    assert listing(out) == before


@pytest.mark.usefixtures("little")
def test_the_areas_of_a_run_are_those_of_its_statistics(call, tile, tmp_path, monkeypatch):
    monkeypatch.setattr("pipeline.batch.engine.cluster", Given)
    asked = {}
    monkeypatch.setattr("pipeline.batch.merge.merge", lambda _, **how: asked.update(how) or {"notes": []})
    area = tmp_path / "wijk.geojson"
    ring = [[121_000, 487_000], [121_040, 487_000], [121_000, 487_040], [121_000, 487_000]]
    shape = {"type": "Polygon", "coordinates": [ring]}
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::28992"}}
    feature = {"type": "Feature", "properties": {"wijk": "Oost"}, "geometry": shape}
    area.write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": [feature]}))
    done = call("batch", tile, "--out", tmp_path / "out", *SMALL, "--aoi", area)
    assert done.exit_code == 0, done.output
    assert asked["areas"] == area
    call("batch", tile, "--out", tmp_path / "other", *SMALL)
    assert asked["areas"] is None


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--bbox", "1,2,3"), "west,south,east,north"),
        (("--bbox", "1,2,3,4", "--aoi", "f"), "exclude each other"),
        (("--bbox", "1,2,3,4"), "no tile has a part"),
        (("--only", "nonsense"), "is no cell"),
        (("--only", "1_2_50"), "no cell of these tiles"),
        (("--workers", "2", "--scheduler", "tcp://x:1"), "exclude each other"),
        (("--core-m", "49.9"), "multiple of 0.5"),
        (("--set", "batch.cores=5"), "batch.core"),
        (("--crs", "EPSG:0"), "no known reference system"),
    ],
)
def test_wrong_usage_is_found_before_any_work(call, tile, tmp_path, arguments, words):
    result = call("batch", tile, "--out", tmp_path / "out", *SMALL, *arguments)
    assert result.exit_code == 2, result.output
    assert words in result.stderr
    assert not (tmp_path / "out").exists()


def test_tiles_that_all_fail_are_each_told(call, tmp_path):
    empty = make_tile(tmp_path / "empty.laz", points=0)
    result = call("batch", empty, tmp_path / "absent.laz", "--out", tmp_path / "out")
    assert result.exit_code == 1
    assert len(result.stderr.splitlines()) == 2
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert [Path(each["path"]).name for each in summary["failed"]] == ["empty.laz", "absent.laz"]


def test_a_folder_of_something_else_is_refused(call, tmp_path):
    for words in (("status",), ("retry",), ("merge",)):
        result = call("batch", *words, tmp_path)
        assert result.exit_code == 1
        assert "is no folder of a batch" in result.stderr


def test_a_tree_of_an_archive_is_told_as_any_model(call, tmp_path):
    from pipeline.lsystem import ArchiveWriter, encode
    from pipeline.model import Skeleton, TreeModel

    axis = np.column_stack([np.zeros((4, 2)), np.arange(4.0)])
    tree = TreeModel(Skeleton(axis, np.arange(4) - 1), np.full(4, 0.1), np.zeros(4), np.zeros(4))
    archive = tmp_path / "models.lsjson.jsonl.zst"
    with ArchiveWriter(archive) as writer:
        writer.add("als_1_2", encode(tree))
    result = call("info", f"{archive}#als_1_2", "--json")
    assert result.exit_code == 0, result.stderr
    told = json.loads(result.stdout)
    assert (told["kind"], told["nodes"], told["height_m"], told["bytes"]) == ("tree", 4, 3.0, None)


def test_an_area_without_any_tree_is_told_by_words_summary_and_exit_code(call, tile, tmp_path, monkeypatch):
    monkeypatch.setattr("pipeline.batch.cell.work", treeless)
    monkeypatch.setattr("pipeline.batch.engine.cluster", Given)
    out = tmp_path / "out"
    for _ in range(2):  # also when nothing is left to do
        result = call("batch", tile, "--out", out, *SMALL, "--no-merge")
        assert result.exit_code == 1, result.output
        assert f"{tile}: no tree was found in it; see whether it holds vegetation" in result.stderr
        assert "4 of 4 cells done, 0 quarantined, 0 trees" in result.stdout
        summary = json.loads((out / "summary.json").read_text())
        assert [each["path"] for each in summary["failed"]] == [str(tile)]


def test_a_batch_without_a_done_cell_cannot_be_merged(call, tmp_path):
    (tmp_path / "plan.json").write_text("{}")
    result = call("batch", "merge", tmp_path)
    assert result.exit_code == 1
    assert f"{tmp_path}: holds no cell that is done; run `treepipe batch TILE... --out" in result.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == ["plan.json"]


def test_help_shows_the_options_and_the_commands(call):
    for words in (("batch", "--help"), ("batch", "-h"), ("batch",)):
        result = call(*words)
        for word in ("--scheduler", "--dry-run", "status", "retry", "merge"):
            assert word in result.output


DRIVER = """
from pipeline.batch import cell
from pipeline.batch.job import Job
from pipeline.cli.main import main
from tests.batch.stubs import slowly
if __name__ == "__main__":
    cell.work = slowly
    main({arguments!r})
"""


def test_an_interrupt_leaves_nothing_half_written(tile, tmp_path):
    out = tmp_path / "out"
    arguments = [*map(str, ("batch", tile, "--out", out, *SMALL, "--workers", 2))]
    (tmp_path / "driver.py").write_text(DRIVER.format(arguments=arguments))
    process = subprocess.Popen(
        [sys.executable, str(tmp_path / "driver.py")],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    for _ in range(600):
        if list(out.glob("cells/*/.tmp-*")) or process.poll() is not None:
            break
        time.sleep(0.1)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does, to the workers too
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130, said
    assert said.splitlines()[-1] == "treepipe: interrupted; no half-written file is left"
    assert "Traceback" not in said
    assert not list(out.rglob(".tmp-*"))
    assert not list(out.glob("cells/*/manifest.json"))
