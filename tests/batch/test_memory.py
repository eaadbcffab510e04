"""What a point costs in a worker's memory: with it and `most_points`, a cell stays below 3 GB."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.airborne.grid import GridOptions

PROMISED_MB = 3000.0
WORKER_MB = 850.0
"""What a worker holds before a cell's points: libraries and machine code."""

SCRIPT = """
import gc, json, os, sys
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1")
from pathlib import Path
import numpy as np
from pipeline.airborne import vegetation
from pipeline.airborne.segmentation import segment
from pipeline.cloud.parts import RECORD, Frame, Lattice, append, finish_part, read_part, start_part

def forest(path, points, side_m):
    '''Write a forest of crowns side by side: nearly every point is asked whether it is vegetation.'''
    start_part(path, Frame(Lattice((0.001,) * 3, (0.0,) * 3)))
    rng = np.random.default_rng(1)
    records = np.zeros(points, RECORD)
    x, y = rng.random((2, points)) * side_m
    z = (14 + 8 * np.cos(x) * np.cos(y)) * rng.random(points) ** 0.5 * (rng.random(points) > 0.05)
    for name, metres in zip("XYZ", (x + 121_000, y + 487_000, z)):
        records[name] = np.rint(1000 * metres)
    records["bit_fields"], records["classification"] = 0x11, np.where(z == 0, 2, 1)
    append(path, records)
    finish_part(path)

def held(what):
    (line,) = (line for line in open("/proc/self/status") if line.startswith(what))
    return int(line.split()[1]) * 1024

folder, sizes, told = Path(sys.argv[1]), (40_000, 600_000, 2_200_000), []
vegetation.STRIP_POINTS = 200_000
for number, points in enumerate(sizes):
    forest(folder / f"{number}.las", points, (points / 68) ** 0.5)
for number in (0, 1, 2):  # the first one loads or compiles code
    gc.collect()
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    before = held("VmRSS")
    found = segment(read_part(folder / f"{number}.las"))
    told.append(held("VmHWM") - before)
    share = float(found.vegetation.mean())
    del found
print(json.dumps({"bytes": (told[2] - told[1]) / (sizes[2] - sizes[1]), "vegetation": share}))
"""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="asks Linux for the peak of a process")
def test_a_cell_of_most_points_fits_into_what_is_promised(tmp_path: Path) -> None:
    command = [sys.executable, "-c", SCRIPT, str(tmp_path)]
    own = {**os.environ, "MALLOC_MMAP_THRESHOLD_": "65536"}  # small arrays come and go as large ones do
    done = subprocess.run(command, env=own, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["vegetation"] > 0.8
    assert told["bytes"] > 38, "coordinates and attributes alone"
    most_mb = GridOptions().most_points * told["bytes"] / 1e6
    assert WORKER_MB + most_mb < PROMISED_MB, f"{told['bytes']:.0f} bytes a point"
