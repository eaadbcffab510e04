"""What a worker makes of one task, and what the run makes of its end; without any worker process."""

from __future__ import annotations

import errno
import json
import os
import socket
from concurrent.futures import CancelledError
from dataclasses import replace
from importlib import import_module

import pytest

pytest.importorskip("distributed", reason="needs the extra batch")

from pipeline.airborne.grid import Cell, GridOptions
from pipeline.batch import engine, quarantine, tasks
from pipeline.batch.cluster import PRELOADED
from pipeline.batch.dispatch import Dispatch
from pipeline.batch.engine import run_batch
from pipeline.batch.explode import slices_of
from pipeline.batch.gather import Sources
from pipeline.batch.job import Outcome
from pipeline.batch.tasks import do_cell, do_slice, still_at_work
from tests.batch.stubs import count, job_of, make_tile, plan_of, treeless
from tests.batch.workerless import Client, Given

CORNER = "121000_487000_50"


class KilledWorker(Exception):
    """As Dask tells that a task ended all the workers it was given to."""


@pytest.fixture
def tile(tmp_path):
    return make_tile(tmp_path / "tile.laz", size_m=99.0)


def through(plan, job, client) -> Dispatch:
    job.out.mkdir(exist_ok=True)
    run = Dispatch(plan, job, lambda _: None)
    run.work_through(client)
    told = run.progress
    assert told.done + told.quarantined == told.planned
    return run


def full(*_):
    raise OSError(errno.ENOSPC, "No space left on device")


def test_a_full_disk_in_a_cell_is_told_with_what_to_do(tile, tmp_path):
    plan = plan_of(tile)
    out = tmp_path / "out"
    through(plan, replace(job_of(plan, out), work=full), Client())
    held = quarantine.quarantined(out)
    assert len(held) == 4
    assert all("is full; free space, run `treepipe batch retry" in facts["error"] for facts in held.values())
    quarantine.release(out)
    assert through(plan, job_of(plan, out), Client()).progress.done == 4


def full_for_once(cell, points, folder, job):
    mark = job.out / f"{cell.name}.tried"
    if not mark.exists():
        mark.write_text("")
        return full()
    return count(cell, points, folder, job)


def test_what_fails_once_is_done_the_second_time(tile, tmp_path):
    plan = plan_of(tile)
    client = Client()
    run = through(plan, replace(job_of(plan, tmp_path / "out"), work=full_for_once), client)
    assert (run.progress.done, run.progress.quarantined) == (4, 0)
    assert sum(key.endswith(f"{CORNER}-try2") for key in client.keys) == 1


def hungry(cell, points, folder, job):
    if cell.contains((121_001.0, 487_001.0)):
        raise MemoryError
    return count(cell, points, folder, job)


def test_a_cell_out_of_memory_is_split_until_it_is_too_small_and_then_quarantined(tmp_path):
    tile = make_tile(tmp_path / "tile.laz", size_m=199.0)
    plan = plan_of(tile, grid=GridOptions(core_m=200, buffer_m=5))
    out = tmp_path / "out"
    run = through(plan, replace(job_of(plan, out), work=hungry), Client())
    assert (run.progress.planned, run.progress.done, run.progress.quarantined) == (7, 6, 1)
    assert {name: facts["reason"] for name, facts in quarantine.quarantined(out).items()} == {
        CORNER: "memory"
    }
    reasons = [json.loads(path.read_text())["reason"] for path in sorted((out / "splits").iterdir())]
    assert reasons == ["memory", "memory"]


def test_a_worker_that_its_nanny_ended_for_its_memory_splits_the_cell(tmp_path):
    tile = make_tile(tmp_path / "tile.laz", size_m=99.0)
    plan = plan_of(tile, grid=GridOptions(core_m=100, buffer_m=5))
    job = job_of(plan, tmp_path / "out")
    whole = plan.cells[0].name

    def fate(key, run):
        if f"-{whole}-" in key:
            claim = job.points / "claims" / whole / "1.json"
            claim.parent.mkdir(parents=True)
            claim.write_text(json.dumps({"worker": "tcp://w", "pid": 7, "host": "h"}))
            raise KilledWorker
        return run()

    run = through(plan, job, Client(fate, events=[{"worker": "tcp://w", "pid": 7}]))
    assert (run.progress.planned, run.progress.done) == (4, 4)


def test_an_answer_that_is_lost_is_asked_for_again(tile, tmp_path):
    plan = plan_of(tile)

    def fate(key, run):
        done = run()
        if key.endswith("try1"):
            raise CancelledError
        return done

    client = Client(fate)
    assert through(plan, job_of(plan, tmp_path / "out"), client).progress.done == 4
    assert all(key.replace("try2", "try1") in client.keys for key in client.keys)


def test_two_runs_on_one_scheduler_are_told_apart(tile, tmp_path):
    plan = plan_of(tile)
    keys = []
    for name in ("one", "two", "one"):
        client = Client()
        through(plan, job_of(plan, tmp_path / name), client)
        keys.append(set(client.keys))
    assert not keys[0] & keys[1]
    other = plan_of(tile, config_hash="c1")
    assert job_of(plan, tmp_path).run != job_of(other, tmp_path).run


def test_a_tile_that_breaks_in_the_middle_fails_its_cells(tile, tmp_path):
    plan = plan_of(tile)
    tile.write_bytes(tile.read_bytes()[: tile.stat().st_size * 2 // 3])
    out = tmp_path / "out"
    (piece,) = slices_of(plan.tiles[0])
    told = do_slice(job_of(plan, out), piece, plan.cells, plan.frame)
    assert told.status == "failed"
    assert str(tile) in (told.error or "")
    through(plan, job_of(plan, out), Client())
    held = quarantine.quarantined(out)
    assert {facts["reason"] for facts in held.values()} == {"tile"}
    assert {facts["tile"] for facts in held.values()} == {str(tile)}
    assert len(held) == 4


def test_the_summary_tells_the_broken_tile_once_and_every_cell(tile, tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(engine, "cluster", Given)
    plan = plan_of(tile)
    tile.write_bytes(tile.read_bytes()[: tile.stat().st_size * 2 // 3])
    out = tmp_path / "out"
    for _ in range(2):  # and again when nothing is left to do
        summary = run_batch(plan, job_of(plan, out))
        assert summary["done"] + summary["quarantined"] == summary["planned"] == 4
        (failed,) = summary["failed"]
        assert failed["path"] == str(tile)
        assert "copy or export it again" in failed["error"]
        assert {one["cell"] for one in summary["quarantine"]} == {cell.name for cell in plan.cells}
        assert json.loads((out / "summary.json").read_text()) == summary
    ours = [record for record in caplog.records if record.name == "treepipe"]
    assert not [one for one in ours if one.levelname == "ERROR"], "the command tells it"


def test_a_cell_in_quarantine_is_told_by_every_run(tile, tmp_path, monkeypatch, caplog):
    monkeypatch.setattr(engine, "cluster", Given)
    plan = plan_of(tile)
    lines = []
    for _ in range(2):
        summary = run_batch(plan, job_of(plan, tmp_path / "out", fails=[CORNER]))
        (held,) = summary["quarantine"]
        assert (held["cell"], held["reason"], summary["failed"]) == (CORNER, "failed", [])
        lines += [record.getMessage() for record in caplog.records if record.levelname == "ERROR"]
        caplog.clear()
    first, again = lines
    assert f"cell {CORNER}: quarantined" in first
    assert f"cell {CORNER}: still quarantined" in again
    assert "the stub was told to fail" in again
    alone = run_batch(plan.restricted(plan.cells[1].name), job_of(plan, tmp_path / "out"))
    assert (alone["quarantined"], alone["quarantine"]) == (0, [])


def test_a_cell_that_is_wider_than_rasters_may_be_is_split_before_it_is_read(tile, tmp_path):
    plan = plan_of(tile)
    wide = Cell(120_000.0, 486_000.0, 2000.0)
    sources = Sources((), (), plan.frame, whole=True)
    told = do_cell(job_of(plan, tmp_path / "out"), wide, wide, sources)
    assert told == Outcome("split", {"size_m": 2000.0})


def test_a_run_waits_for_workers_whose_driver_was_killed(tile, tmp_path, monkeypatch):
    job = job_of(plan_of(tile), tmp_path / "out")
    claims = job.points / "claims" / CORNER
    claims.mkdir(parents=True)
    gone = {"worker": "", "pid": 2**22 + 1, "host": socket.gethostname()}
    elsewhere = {"worker": "", "pid": os.getpid(), "host": "elsewhere"}
    for name, told in {"a": gone, "b": elsewhere}.items():
        (claims / f"{name}.json").write_text(json.dumps(told))
    (claims / "c.json").write_text("half")
    assert still_at_work(job.points) == []
    (claims / "d.json").write_text(json.dumps({**gone, "pid": os.getpid()}))
    assert still_at_work(job.points) == [os.getpid()]
    naps = []
    monkeypatch.setattr(engine, "sleep", lambda _: naps.append((claims / "d.json").unlink(missing_ok=True)))
    engine._let_end(job)
    assert len(naps) == 1


def test_a_run_without_any_tree_says_so_of_each_tile(tile, tmp_path, monkeypatch):
    monkeypatch.setattr(engine, "cluster", Given)
    plan = plan_of(tile)
    out = tmp_path / "out"
    summary = run_batch(plan, replace(job_of(plan, out), work=treeless))
    assert (summary["done"], summary["trees"]) == (4, 0)
    (failed,) = summary["failed"]
    assert failed["path"] == str(tile)
    assert "no tree was found in it; see whether it holds vegetation" in failed["error"]
    assert json.loads((out / "summary.json").read_text())["failed"] == [failed]
    again = run_batch(plan, replace(job_of(plan, out), work=treeless))
    assert again["failed"] == [failed], "also when nothing is left to do"


def test_the_claim_of_a_task_names_process_and_machine(tile, tmp_path):
    plan = plan_of(tile)
    seen = []

    def look(cell, points, folder, job):
        (path,) = (job.points / "claims" / cell.name).iterdir()
        seen.append(json.loads(path.read_text()))
        return count(cell, points, folder, job)

    job = replace(job_of(plan, tmp_path / "out"), work=look)
    through(plan, job, Client())
    assert {(told["pid"], told["host"]) for told in seen} == {(os.getpid(), socket.gethostname())}
    assert tasks.still_at_work(job.points) == []


def test_what_workers_are_forked_from_is_there():
    """A name that cannot be loaded is passed over in silence, and costs every worker seconds."""
    for name in PRELOADED:
        assert import_module(name)
