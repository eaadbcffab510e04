"""Milliseconds of CPU that one airborne tree costs, stage by stage.

    python tests/benchmarks/airborne_tree.py

Trees are columns of points cut from the real tiles, thinned to 300, 1,000 and 3,000 points. The first
round compiles and is not counted; the least of three others is. Target: 50 ms for a tree of 1,000
points, modelled and written.
"""

from __future__ import annotations

import gc
import os
import tempfile
from collections import defaultdict
from pathlib import Path
from time import process_time

os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.spatial import ConvexHull

from pipeline.airborne import modelling
from pipeline.airborne.modelling import Stages
from pipeline.airborne.raster import Raster
from pipeline.airborne.segmentation import AirborneTree
from pipeline.batch.rows import Survey, row, table
from pipeline.cityjson import SeqWriter
from pipeline.cloud import read_cloud
from pipeline.config import read_config
from pipeline.formats import geoparquet
from pipeline.lsystem import ArchiveWriter, encode
from pipeline.model import PointCloud

SIZES = (300, 1000, 3000)
TREES = 8
REACH_M = 7.0
ROUNDS = 3
STAGES = ("clean", "find_trunk", "fit", "fallback")

times: dict[str, float] = defaultdict(float)


def clocked(stage, function):
    """Return the function, adding its seconds to those of a stage."""

    def run(*inputs, **options):
        start = process_time()
        try:
            return function(*inputs, **options)
        finally:
            times[stage] += process_time() - start

    return run


def columns(tile: PointCloud, count: int) -> list[tuple[PointCloud, AirborneTree, Raster]]:
    """Cut the columns about the highest points."""
    classes = tile.attributes["classification"]
    soil, waiting = tile.xyz[classes == 2], tile.xyz[classes == 1]
    ground = float(np.median(soil[:, 2]))
    terrain = Raster(np.full((400, 400), ground), np.floor(tile.xyz[:, :2].min(axis=0)) - 50.0, 0.5)
    waiting = waiting[waiting[:, 2] > ground + 1.0]
    out = []
    while len(out) < count and len(waiting):
        apex = waiting[np.argmax(waiting[:, 2])]
        ours = np.linalg.norm(waiting[:, :2] - apex[:2], axis=1) < REACH_M
        if ours.sum() >= min(SIZES):
            cloud = PointCloud(waiting[ours], tile.origin, "EPSG:28992")
            hull = ConvexHull(cloud.xyz[:, :2])
            ring, area = cloud.xyz[hull.vertices, :2], float(hull.volume)
            wide = float(2 * np.sqrt(area / np.pi))
            tree = AirborneTree(np.arange(len(cloud)), apex, ground, apex[:2], ring, area, wide, 10.0)
            out.append((cloud, tree, terrain))
        waiting = waiting[~ours]
    return out


def thinned(cloud: PointCloud, tree: AirborneTree, size: int) -> AirborneTree:
    """Return a tree with `size` of its points, evenly chosen."""
    at = np.linspace(0, len(cloud) - 1, size).astype(np.int64)
    return AirborneTree(at, *(getattr(tree, name) for name in list(tree.__dataclass_fields__)[1:]))


def work(trees, folder: Path) -> int:
    """Model and write all trees; return how many are fallbacks."""
    config = read_config(preset="airborne")
    stages = Stages(config.clean, config.skeleton, config.cylinders)
    archive = ArchiveWriter(folder / "a.lsjson.jsonl.zst")
    sequence = SeqWriter(folder / "a.city.jsonl", options=config.cityjson)
    rows = []
    gc.disable()
    with archive, sequence:
        for number, (cloud, tree, terrain) in enumerate(trees):
            made = clocked("model", modelling.model_tree)(cloud, tree, terrain, stages=stages)
            document = clocked("encode", encode)(made.tree, options=config.lsystem)
            clocked("archive", archive.add)(str(number), document)
            clocked("cityjson", sequence.add)(made.tree, str(number))
            survey = Survey("als", "0_0_500", "", crs_assumed=False)
            rows.append(clocked("row", row)(str(number), made, tree, cloud, survey=survey))
        start = process_time()
    times["archive"] += process_time() - start
    clocked("table", lambda: geoparquet.write(table(rows), folder / "t.parquet", crs="EPSG:7415"))()
    gc.enable()
    return sum("fallback" in one["flags"] for one in rows)


def main() -> None:
    """Print a table: a line a stage, a column a size."""
    for stage in STAGES:
        setattr(modelling, stage, clocked(f"  {stage}", getattr(modelling, stage)))
    data = Path(os.environ.get("TREEPIPE_DATA", Path(__file__).parents[2] / ".." / "shared" / "data"))
    tiles = [read_cloud(data / "tiles" / f"{name}.laz") for name in ("ahn4_2496_9727", "ahn3_2386_9702")]
    cut = [each for tile in tiles for each in columns(tile, TREES)]
    results, names = [], []
    for size in SIZES:
        trees = [(c, thinned(c, t, size), terrain) for c, t, terrain in cut if len(c) >= size]
        rounds = []
        for _ in range(ROUNDS + 1):
            times.clear()
            with tempfile.TemporaryDirectory() as folder:
                fallbacks = work(trees, Path(folder))
                sizes = {path.suffix: path.stat().st_size for path in Path(folder).iterdir()}
            spent = {stage: 1000 * seconds / len(trees) for stage, seconds in times.items()}
            spent["total"] = sum(value for stage, value in spent.items() if not stage.startswith(" "))
            rounds.append(spent)
        spent = min(rounds[1:], key=lambda one: one["total"])
        kilobytes = {f"kB {suffix}": size / len(trees) / 1000 for suffix, size in sizes.items()}
        results.append({**spent, **kilobytes, "trees": len(trees), "fallbacks": fallbacks})
        names += [name for name in results[-1] if name not in names]
    print(f"{'ms of CPU a tree':<18}" + "".join(f"{size:>9,}" for size in SIZES))
    for name in names:
        print(f"{name:<18}" + "".join(f"{result.get(name, 0.0):9.1f}" for result in results))


if __name__ == "__main__":
    main()
