"""Tiles without meaning, and a work function that does little: what the engine is tested with."""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
import signal
import struct
import time
from pathlib import Path

import laspy
import numpy as np
from pyproj import CRS

from pipeline.airborne.grid import Cell, GridOptions, inside
from pipeline.batch.job import Job
from pipeline.batch.plan import Plan, make_plan
from pipeline.cloud.parts import read_part

GRID = GridOptions(core_m=50, buffer_m=5)


def make_tile(
    path: Path,
    *,
    corner=(121_000.0, 487_000.0),
    size_m=100.0,
    points=4000,
    seed=1,
    point_format=6,
    crs=None,
    scale=0.001,
    offset=(0.0, 0.0, 0.0),
) -> Path:
    """Write a tile with points all over it."""
    version = "1.4" if point_format >= 6 else "1.3" if point_format >= 4 else "1.2"
    header = laspy.LasHeader(version=version, point_format=point_format)
    header.scales, header.offsets = np.full(3, scale), np.array(offset)
    if crs is not None:
        header.add_crs(CRS.from_user_input(crs))
    las = laspy.LasData(header)
    rng = np.random.default_rng(seed)
    las.x, las.y = (corner[axis] + rng.random(points) * size_m for axis in range(2))
    las.z = rng.random(points) * 20
    las.classification = rng.integers(1, 3, points)
    las.return_number = las.number_of_returns = np.ones(points, np.uint8)
    if "gps_time" in header.point_format.dimension_names:
        las.gps_time = np.arange(points) + 1000.0 * seed
    path.parent.mkdir(parents=True, exist_ok=True)
    las.write(path)
    return path


def plan_of(*paths: Path, grid: GridOptions = GRID, config_hash: str = "c0", **more) -> Plan:
    return make_plan(paths, grid, config_hash=config_hash, **more)


def job_of(plan: Plan, out: Path, **extra) -> Job:
    return Job(count, out, plan.grid, plan.config_hash, plan.input_hash, extra=extra)


def count(cell: Cell, points: Path, folder: Path, job: Job) -> dict:
    """Write the digest of a cell's points, as if each point in the core were a tree."""
    trouble(cell, job)
    cloud = read_part(points)
    world = cloud.xyz + cloud.origin
    core = cell.contains(world[:, :2])
    assert inside(cell.window(job.grid.buffer_m), world[:, :2]).all()
    order = np.lexsort(world.T)
    digest = hashlib.sha256(world[order].tobytes() + cloud.attributes["gps_time"][order].tobytes())
    (folder / "trees.txt").write_text(f"{digest.hexdigest()} {len(world)}\n")
    manifest = {
        "cell": cell.name,
        "config_hash": job.config_hash,
        "input_hash": job.input_hash,
        "trees": int(core.sum()),
        "fallback_trees": 0,
        "points": int(core.sum()),
        "seconds": 0.0,
        "peak_rss_mb": 1.0,
        "files": {"trees.txt": digest.hexdigest()},
    }
    temporary = folder / ".tmp-manifest.json"
    temporary.write_text(json.dumps(manifest))
    temporary.replace(folder / "manifest.json")
    return manifest


def treeless(cell: Cell, points: Path, folder: Path, job: Job) -> dict:
    """Find nothing."""
    manifest = count(cell, points, folder, job) | {"trees": 0}
    (folder / "manifest.json").write_text(json.dumps(manifest))
    return manifest


def trouble(cell: Cell, job: Job) -> None:
    """Do what a test asks for: note the cell, take time, die, fail, or eat memory."""
    if log := job.extra.get("log"):
        with Path(log).open("a") as stream:
            stream.write(f"{cell.name} {os.getpid()}\n")
    time.sleep(job.extra.get("seconds", 0.0))
    if cell.name in job.extra.get("kills", ()):
        os.kill(os.getpid(), signal.SIGKILL)
    if cell.name in job.extra.get("fails", ()):
        msg = "the stub was told to fail"
        raise RuntimeError(msg)
    if cell.size_m > job.extra.get("most_m", 1e9):
        hog = [np.ones(10_000_000) for _ in range(100)]
        time.sleep(30)
        del hog


def listing(out: Path) -> dict[str, bytes]:
    """Return the bytes of all files of all cells."""
    return {
        path.relative_to(out).as_posix(): path.read_bytes()
        for path in sorted((out / "cells").rglob("*"))
        if path.is_file()
    }


def make_copc(path: Path, plain: Path) -> Path:
    """Write the points of a tile as COPC: one node that holds them all."""
    las = laspy.convert(laspy.read(plain), point_format_id=6)
    low, high = np.array(las.header.mins), np.array(las.header.maxs)
    half = float((high - low).max()) / 2 + 1
    info = struct.pack("<5dQQ2d11Q", *((low + high) / 2), half, half, 0, 32, 0, 0, *[0] * 11)
    las.header.vlrs.insert(0, laspy.VLR("copc", 1, "copc info", info))
    las.write(path)
    content = bytearray(path.read_bytes())
    at, table = struct.unpack_from("<I", content, 96)[0], 0
    table = struct.unpack_from("<q", content, at)[0]
    page = struct.pack("<4iQii", 0, 0, 0, 0, at + 8, table - at - 8, len(las.points))
    place = len(content)
    content += struct.pack("<H16sHQ32s", 0, b"copc", 1000, len(page), b"EPT hierarchy") + page
    struct.pack_into("<QI", content, 235, place, 1)  # where the extended record is
    struct.pack_into("<QQ", content, 375 + 54 + 40, place + 60, len(page))
    path.write_bytes(content)
    return path


def slowly(cell: Cell, points: Path, folder: Path, job: Job) -> dict:
    """Begin a file and never come to its end."""
    (folder / ".tmp-trees.txt").write_text("half")
    time.sleep(120)
    return count(cell, points, folder, job)


def deaf(log: str) -> None:
    """Tell who works, and let no other thread of this process run for a while, as compiled code does."""
    Path(log).write_text(f"{os.getpid()} ")
    ctypes.PyDLL(None).sleep(25)
