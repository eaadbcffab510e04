"""What a country costs: memory of a worker, CPU seconds a million points, and the load of 170,000 cells.

``python tests/benchmarks/airborne_scaling.py TILE.laz [--million 100] [--cells 5000] [--core-m 500]``

A tile is replicated with jitter until it has as many points as asked for, exploded, its fullest cell is
read and its trees are cut out, and then it is done whole; then cells without any points go through the
real engine. ``--steps explode segment`` leaves out the models. docs/scaling.md has the figures.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np

from pipeline.airborne.grid import Cell, GridOptions, cells_over
from pipeline.airborne.segmentation import segment
from pipeline.batch.engine import run_batch
from pipeline.batch.explode import explode, slices_of
from pipeline.batch.gather import Sources, gather
from pipeline.batch.job import Job
from pipeline.batch.plan import Plan, make_plan
from pipeline.cloud.parts import read_part
from pipeline.config import Config, read_config

JITTER = 10
"""Steps of the stored integers by which a copy differs."""

CORE = "AIRBORNE_SCALING_CORE_M"
"""Environment of the processes that do a step."""

ALL_CELLS = 170_000


def replicate(source: Path, target: Path, millions: float) -> None:
    """Write copies of a tile side by side, a copy at a time."""
    las = laspy.read(source)
    step = np.ceil((np.array(las.header.maxs) - las.header.mins)[:2] / las.header.scales[:2]).astype(int)
    copies = round(millions * 1e6 / len(las.points))
    side = max(1, round(copies**0.5))
    rng = np.random.default_rng(1)
    x, y, z = (np.array(las[axis]) for axis in "XYZ")
    with laspy.open(target, "w", header=las.header) as writer:
        for copy in range(copies):
            right, up = copy % side, copy // side
            las.X = x + right * step[0] + rng.integers(-JITTER, JITTER + 1, len(x))
            las.Y = y + up * step[1] + rng.integers(-JITTER, JITTER + 1, len(x))
            las.Z = z + rng.integers(-JITTER, JITTER + 1, len(x))
            writer.write_points(las.points)


def plan_and_job(tile: Path, folder: Path) -> tuple[Plan, Job]:
    from pipeline.batch.cell import work

    config = read_config(preset="airborne").with_settings([f"batch.core_m={os.environ.get(CORE, '500')}"])
    plan = make_plan([tile], config.batch, config_hash=config.config_hash)
    job = Job(
        work,
        folder,
        plan.grid,
        plan.config_hash,
        plan.input_hash,
        config_json=config.model_dump_json(),
        crs=plan.reference.crs,
        crs_assumed=plan.reference.assumed,
    )
    return plan, job


def step_explode(tile: Path, folder: Path) -> dict:
    """Explode all slices of a tile in this process."""
    plan, _ = plan_and_job(tile, folder)
    begin = time.process_time()
    for piece in slices_of(plan.tiles[0]):
        explode(piece, plan.cells, plan.grid, plan.frame, folder / "work")
    cpu = time.process_time() - begin
    return {"points": plan.tiles[0].points, "cells": len(plan.cells), "cpu_s": cpu}


def step_segment(tile: Path, folder: Path) -> dict:
    """Cut the trees out of the cell with the most points, after a small one that loads what is compiled."""
    plan, job = plan_and_job(tile, folder)
    options = Config.model_validate_json(job.config_json).airborne
    chosen = fullest(plan, folder)
    sources = Sources(plan.tiles, (parts_of(chosen, folder),), plan.frame, whole=False)
    small = gather(sources, Cell(chosen.x0, chosen.y0, chosen.size_m / 8), 20.0, folder / "small.las")
    whole = gather(replace(sources, whole=True), chosen, 20.0, folder / "whole.las")
    segment(read_part(small.path), options=options)
    begin = time.process_time()
    cloud = read_part(whole.path)
    read = time.process_time() - begin
    found = segment(cloud, options=options)
    cpu = time.process_time() - begin
    told = {"trees": len(found.trees), "vegetation": round(float(found.vegetation.mean()), 3)}
    return {**told, "points": len(cloud), "read_s": read, "segment_s": cpu - read, "cpu_s": cpu}


def parts_of(cell: Cell, folder: Path) -> tuple[Path, ...]:
    return tuple(sorted((folder / "work" / cell.name).glob("*.las")))


def fullest(plan: Plan, folder: Path) -> Cell:
    """Return the cell with the most points."""
    return max(plan.cells, key=lambda cell: sum(path.stat().st_size for path in parts_of(cell, folder)))


def step_cell(tile: Path, folder: Path) -> dict:
    """Do the cell with the most points in this process; a small one comes first, to load what is compiled."""
    plan, job = plan_and_job(tile, folder)
    chosen = fullest(plan, folder)
    small = Cell(chosen.x0, chosen.y0, chosen.size_m / 8)
    done = [one_cell(plan, job, cell, chosen, folder) for cell in (small, chosen)]
    return {**done[1], "warm_cpu_s": done[0]["cpu_s"]}


def one_cell(plan: Plan, job: Job, cell: Cell, root: Cell, folder: Path) -> dict:
    sources = Sources(plan.tiles, (parts_of(root, folder),), plan.frame, whole=cell == root)
    begin = time.process_time()
    gathered = gather(sources, cell, plan.grid.buffer_m, folder / "gathered.las")
    target = folder / "cells" / cell.name
    target.mkdir(parents=True)
    manifest = job.work(cell, gathered.path, target, job)
    size = sum(path.stat().st_size for path in target.iterdir())
    told = {key: manifest[key] for key in ("trees", "fallback_trees", "points")}
    cpu = time.process_time() - begin
    return {**told, "window_points": gathered.points, "result_bytes": size, "cpu_s": cpu}


def nothing(cell: Cell, points: Path, folder: Path, job: Job) -> dict:
    """Do a cell that costs nothing, so that what the engine costs is left."""
    del points
    manifest = {
        "cell": cell.name,
        "config_hash": job.config_hash,
        "input_hash": job.input_hash,
        "trees": 0,
        "points": 0,
        "files": {},
    }
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return manifest


def simulate(tile: Path, folder: Path, cells: int) -> dict:
    """Send cells without points through the engine."""
    plan, job = plan_and_job(tile, folder)
    side = int(np.ceil(cells**0.5))
    grid = GridOptions(core_m=10)
    west, south = plan.tiles[0].low[:2]
    far = cells_over((west + 1e5, south + 1e5, west + 1e5 + 10 * side, south + 1e5 + 10 * side), grid)
    plan = replace(plan, cells=far[:cells], grid=grid)
    job = replace(job, work=nothing, grid=grid)
    begin, cpu = time.perf_counter(), time.process_time()
    summary = run_batch(plan, job, workers=1)
    wall, own = time.perf_counter() - begin, time.process_time() - cpu
    assert summary["done"] == cells
    return {"cells": cells, "wall_s": wall, "driver_and_scheduler_cpu_s": own}


STEPS = {"explode": step_explode, "segment": step_segment, "cell": step_cell}


def in_a_process(step: str, tile: Path, folder: Path) -> dict:
    """Run a step in a process of its own; its peak memory and CPU time are those of the step."""
    command = [sys.executable, __file__, str(tile), "--folder", str(folder), "--step", step]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit(done.stderr)
    return json.loads(done.stdout.splitlines()[-1])


def measured(step: str, tile: Path, folder: Path) -> None:
    told = STEPS[step](tile, folder)
    usage = resource.getrusage(resource.RUSAGE_SELF)
    told |= {"peak_mb": usage.ru_maxrss / 1024, "process_cpu_s": usage.ru_utime + usage.ru_stime}
    print(json.dumps(told))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("tile", type=Path)
    parser.add_argument("--million", type=float, default=100.0)
    parser.add_argument("--cells", type=int, default=5000)
    parser.add_argument("--folder", type=Path)
    parser.add_argument("--core-m", type=float, default=500.0)
    parser.add_argument("--steps", choices=STEPS, nargs="*", default=list(STEPS))
    parser.add_argument("--step", choices=STEPS, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.step:
        measured(given.step, given.tile, given.folder)
        return
    os.environ[CORE] = str(given.core_m)
    folder = Path(tempfile.mkdtemp(dir=given.folder))
    try:
        if given.million:
            big = folder / "big.laz"
            replicate(given.tile, big, given.million)
            for step in given.steps:
                told = in_a_process(step, big, folder)
                millions = told["points"] / 1e6
                print(f"{step}: {told}", flush=True)
                each = told["cpu_s"] / millions
                print(f"{step}: {each:.2f} CPU-s a million points, peak {told['peak_mb']:.0f} MB")
        if given.cells:
            told = simulate(given.tile, folder / "sim", given.cells)
            each = told["driver_and_scheduler_cpu_s"] / told["cells"]
            print(f"engine: {told}; {1e3 * each:.2f} ms a cell, {ALL_CELLS * each / 60:.0f} min of all")
    finally:
        shutil.rmtree(folder)


if __name__ == "__main__":
    main()
