"""The engine on real Dask processes: workers and drivers that die, cells that kill, and the same bytes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from pipeline.airborne.grid import Cell, GridOptions
from pipeline.batch import cluster, engine, quarantine, tasks
from pipeline.batch.dispatch import ClusterLostError
from pipeline.batch.engine import run_batch
from pipeline.batch.tasks import version_there
from pipeline.errors import InputMissingError, OutputError, UsageError
from tests.batch.stubs import job_of, listing, make_tile, plan_of
from tests.batch.workerless import Given

distributed = pytest.importorskip("distributed", reason="needs the extra batch")

ROOT = Path(__file__).resolve().parent.parent.parent
KILLER = "121050_487000_50"
FAILER = "121000_487050_50"


@pytest.fixture(scope="module")
def tiles(tmp_path_factory) -> list[Path]:
    folder = tmp_path_factory.mktemp("tiles")
    east = make_tile(folder / "east.laz", corner=(121_100.0, 487_000.0), size_m=99.0, seed=2)
    return [make_tile(folder / "west.laz", size_m=99.0), east]


@pytest.fixture(scope="module")
def expected(tiles, tmp_path_factory) -> dict[str, bytes]:
    """Return what one worker writes."""
    out = tmp_path_factory.mktemp("one") / "out"
    plan = plan_of(*tiles)
    summary = run_batch(plan, job_of(plan, out), workers=1)
    assert (summary["planned"], summary["done"], summary["quarantined"]) == (8, 8, 0)
    assert summary["trees"] == summary["points"] == 8000
    assert summary == json.loads((out / "summary.json").read_text())
    assert not (out / "work").exists()
    return listing(out)


def test_a_cell_that_kills_or_fails_is_quarantined_and_the_rest_is_done(tiles, expected, tmp_path):
    plan = plan_of(*tiles)
    summary = run_batch(plan, job_of(plan, tmp_path, kills=[KILLER], fails=[FAILER]), workers=2)
    assert (summary["planned"], summary["done"], summary["quarantined"]) == (8, 6, 2)
    held = quarantine.quarantined(tmp_path)
    assert {name: facts["reason"] for name, facts in held.items()} == {KILLER: "crashed", FAILER: "failed"}
    assert "told to fail" in held[FAILER]["error"]
    there = listing(tmp_path)
    assert there == {name: content for name, content in expected.items() if name.split("/")[1] not in held}

    again = run_batch(plan, job_of(plan, tmp_path), workers=2)
    assert again["quarantined"] == 2, "a quarantine lasts until it is lifted"
    assert sorted(quarantine.release(tmp_path)) == sorted([KILLER, FAILER])
    last = run_batch(plan, job_of(plan, tmp_path), workers=2)
    assert (last["done"], last["quarantined"]) == (8, 0)
    assert listing(tmp_path) == expected, "two workers write what one writes"


def test_a_worker_out_of_memory_makes_the_cell_smaller(tmp_path):
    tile = make_tile(tmp_path / "tile.laz", size_m=99.0)
    plan = plan_of(tile, grid=GridOptions(core_m=100, buffer_m=5))
    out = tmp_path / "out"
    job = replace(job_of(plan, out, most_m=60), attempts=1)
    summary = run_batch(plan, job, workers=1, memory_gb=1.0)
    assert (summary["planned"], summary["done"], summary["quarantined"]) == (4, 4, 0)
    assert summary["trees"] == 4000
    told = json.loads((out / "splits" / "121000_487000_100.json").read_text())
    assert told["reason"] == "memory"
    whole = run_batch(plan, job_of(plan, out, most_m=60), workers=1)
    assert whole["done"] == 4, "the split is remembered"


@pytest.fixture(scope="module")
def abroad(tmp_path_factory):
    """Give a cluster that is there already; each test may break it in the end."""
    with dask_processes(tmp_path_factory.mktemp("abroad")) as processes:
        yield processes


def test_workers_of_another_version_are_told_before_any_work(tiles, abroad, tmp_path, monkeypatch):
    monkeypatch.setattr(cluster, "__version__", "99.0")
    with distributed.Client(abroad.address, set_as_default=False) as client:
        client.wait_for_workers(2, timeout=60)
    out = tmp_path / "out"
    plan = plan_of(*tiles)
    with pytest.raises(UsageError, match=r"worker tcp://.* has version .* treepipe 99.0; install the same"):
        run_batch(plan, job_of(plan, out), scheduler=abroad.address)
    assert not list(out.glob("cells/*"))


def test_a_worker_that_is_killed_costs_nothing(tiles, expected, abroad, tmp_path):
    plan = plan_of(*tiles)
    log = tmp_path / "log"
    killed = []

    def kill_one(progress):
        if progress.done >= 2 and not killed:
            pid = int(log.read_text().split()[-1])
            killed.append(pid)
            os.kill(pid, signal.SIGKILL)

    job = job_of(plan, tmp_path / "out", log=str(log), seconds=0.3)
    summary = run_batch(plan, job, scheduler=abroad.address, watch=kill_one)
    assert killed
    assert all(worker.poll() is None for worker in abroad.workers), "the nannies are still there"
    assert (summary["done"], summary["quarantined"]) == (8, 0)
    assert listing(tmp_path / "out") == expected


def test_a_scheduler_that_dies_ends_the_run_but_no_cell(tiles, expected, abroad, tmp_path):
    plan = plan_of(*tiles)
    out = tmp_path / "out"

    def kill_it(progress):
        if progress.done:
            abroad.scheduler.kill()

    with pytest.raises(ClusterLostError, match="run the same command again"):
        run_batch(plan, job_of(plan, out, seconds=0.3), scheduler=abroad.address, watch=kill_it)
    there = listing(out)
    assert there
    assert there.items() <= expected.items(), "what is done is whole"


DRIVER = """
from pathlib import Path
from pipeline.batch.engine import run_batch
from tests.batch.stubs import job_of, plan_of
if __name__ == "__main__":
    plan = plan_of(*map(Path, {tiles!r}))
    run_batch(plan, job_of(plan, Path({out!r}), seconds=0.5, log={log!r}), workers=2)
"""


DEAF_DRIVER = """
from pipeline.batch.cluster import cluster
from tests.batch.stubs import deaf

if __name__ == "__main__":
    with cluster(1, None, None, allowed_failures=0) as (client, _):
        client.submit(deaf, {log!r}).result()
"""


def test_a_driver_that_is_killed_goes_on_where_it_was(tiles, expected, tmp_path):
    out, log = tmp_path / "out", tmp_path / "log"
    code = DRIVER.format(tiles=[str(tile) for tile in tiles], out=str(out), log=str(log))
    (tmp_path / "driver.py").write_text(code)
    driver = subprocess.Popen([sys.executable, str(tmp_path / "driver.py")], env=environment())
    wait_for(lambda: len(list(out.glob("cells/*/manifest.json"))) >= 2)
    plan = plan_of(*tiles)
    with pytest.raises(OutputError, match="another run works in this folder"):
        run_batch(plan, job_of(plan, out))
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    wait_for(lambda: not alive({int(line.split()[1]) for line in log.read_text().splitlines()}))
    finished = {path.parent.name for path in out.glob("cells/*/manifest.json")}
    assert len(finished) < 8
    (out / "cells" / KILLER).mkdir(exist_ok=True)
    (out / "cells" / KILLER / ".tmp-half").write_text("half")

    log.unlink()
    summary = run_batch(plan, job_of(plan, out, log=str(log)), workers=2)
    assert summary["done"] == 8
    assert {line.split()[0] for line in log.read_text().splitlines()} == {
        cell.name for cell in plan.cells
    } - finished
    assert listing(out) == expected

    other = plan_of(*tiles, config_hash="c1")
    with pytest.raises(UsageError, match=r"config_hash c0 there, c1 now.*--out"):
        run_batch(other, job_of(other, out))
    fewer = plan_of(tiles[0])
    with pytest.raises(UsageError, match=f"{plan.input_hash} there, {fewer.input_hash} now"):
        run_batch(fewer, job_of(fewer, out))


@pytest.mark.skipif(sys.platform != "linux", reason="only its kernel ends a process with its parent")
def test_a_worker_in_compiled_code_ends_with_its_driver(tmp_path):
    log = tmp_path / "log"
    code = DEAF_DRIVER.format(log=str(log))
    (tmp_path / "driver.py").write_text(code)
    driver = subprocess.Popen([sys.executable, str(tmp_path / "driver.py")], env=environment())
    wait_for(lambda: log.exists() and log.read_text().endswith(" "))
    worker = int(log.read_text())
    driver.send_signal(signal.SIGKILL)
    driver.wait()
    began = time.monotonic()
    wait_for(lambda: not alive({worker}))
    assert time.monotonic() - began < 10


def test_one_cell_alone_and_a_quarter_of_it(tiles, expected, tmp_path, monkeypatch):
    monkeypatch.setattr(engine, "cluster", Given)
    plan = plan_of(*tiles)
    name = "121100_487000_50"
    one = plan_of(*tiles).restricted(name)
    summary = run_batch(one, job_of(one, tmp_path))
    assert (summary["planned"], summary["done"]) == (1, 1)
    assert listing(tmp_path) == {key: value for key, value in expected.items() if key.split("/")[1] == name}
    assert not (tmp_path / "work").exists()
    with pytest.raises(UsageError, match="no cell of these tiles"):
        plan.restricted("0_0_50")


def test_one_cell_alone_leaves_what_a_run_that_goes_on_needs(tiles, expected, tmp_path, monkeypatch):
    monkeypatch.setattr(engine, "cluster", Given)
    plan = plan_of(*tiles)
    held = run_batch(plan, job_of(plan, tmp_path, fails=[FAILER]))
    assert held["quarantined"] == 1
    waiting = {path.relative_to(tmp_path) for path in tmp_path.glob("work/*/*")}
    one = plan_of(*tiles).restricted("121150_487000_50")
    (tmp_path / "cells" / one.only.name / "manifest.json").unlink()
    run_batch(one, job_of(one, tmp_path))
    assert {path.relative_to(tmp_path) for path in tmp_path.glob("work/*/*")} == waiting
    assert {path.parts[1] for path in waiting} == {FAILER, "slices"}
    quarantine.release(tmp_path)
    monkeypatch.setattr(tasks, "explode", None)  # nothing is exploded again
    run_batch(plan, job_of(plan, tmp_path))
    assert listing(tmp_path) == expected
    assert not (tmp_path / "work").exists()


def test_a_worker_that_cannot_load_its_work_is_told():
    class Client:
        def run(self, function, on_error):
            assert (function, on_error) == (version_there, "return")
            return {"tcp://b:1": version_there(), "tcp://a:1": Exception("No module named 'pipeline'")}

    with pytest.raises(UsageError, match=r"worker tcp://a:1 cannot load it \(No module named 'pipeline'\)"):
        cluster._check_versions(Client(), "tcp://s:1")


def test_no_scheduler_is_a_sentence(tiles, tmp_path, monkeypatch):
    monkeypatch.setattr("pipeline.batch.cluster.CONNECT_S", 1)
    plan = plan_of(*tiles)
    with pytest.raises(InputMissingError, match="dask scheduler"):
        run_batch(plan, job_of(plan, tmp_path), scheduler="tcp://127.0.0.1:1")


def test_a_crowded_cell_is_split_by_its_points(tmp_path, monkeypatch):
    monkeypatch.setattr(engine, "cluster", Given)
    tile = make_tile(tmp_path / "tile.laz", size_m=100.0 - 0.001, points=3000)
    grid = GridOptions(core_m=200, buffer_m=5, most_points=1000)
    plan = plan_of(tile, grid=grid)
    summary = run_batch(plan, job_of(plan, tmp_path / "out"))
    leaves = quarantine.leaves(tmp_path / "out", plan.cells[0])
    assert {leaf.size_m for leaf in leaves} == {50.0, 100.0}
    assert summary["planned"] == summary["done"] == len(leaves)
    assert summary["trees"] == 3000
    assert all(Cell.named(leaf.name) == leaf for leaf in leaves)


class dask_processes:  # reads as what it gives
    """A scheduler and two workers, as on a cluster."""

    def __init__(self, folder: Path) -> None:
        self.told = folder / "scheduler.json"

    def __enter__(self) -> dask_processes:
        dask = [sys.executable, "-m", "dask"]
        place = ["--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(self.told)]
        self.scheduler = self.start([*dask, "scheduler", *place, "--no-dashboard"])
        wait_for(lambda: self.told.is_file() and self.told.read_text().endswith("}"))
        self.address = json.loads(self.told.read_text())["address"]
        worker = [*dask, "worker", self.address, "--nthreads", "1", "--no-dashboard"]
        self.workers = [self.start(worker) for _ in range(2)]
        return self

    def __exit__(self, *_: object) -> None:
        for process in (*self.workers, self.scheduler):
            process.terminate()
        for process in (*self.workers, self.scheduler):
            process.wait(20)

    def start(self, command: list[str]) -> subprocess.Popen:
        """Start a process that says nothing."""
        quiet = subprocess.DEVNULL
        folder = self.told.parent
        return subprocess.Popen(command, env=environment(), stdout=quiet, stderr=quiet, cwd=folder)


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT)}


def wait_for(condition) -> None:
    for _ in range(1200):
        if condition():
            return
        time.sleep(0.05)
    pytest.fail("waited for a minute in vain")


def alive(pids: set[int]) -> set[int]:
    return {pid for pid in pids if Path(f"/proc/{pid}").exists()}
