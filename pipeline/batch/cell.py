"""All that is done for one cell: its points in, its trees, their models and the inventory out."""

from __future__ import annotations

import gc
import hashlib
import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from pipeline.airborne.grid import Cell
from pipeline.airborne.modelling import Stages, model_tree, near_stems
from pipeline.airborne.raster import Raster
from pipeline.airborne.segmentation import Segmented, segment
from pipeline.airborne.tree import AirborneTree
from pipeline.batch.job import Job
from pipeline.batch.rows import Survey, row, table, tree_ids
from pipeline.cityjson import SeqWriter
from pipeline.cloud import read_cloud
from pipeline.cloud.parts import read_part
from pipeline.config import Config
from pipeline.errors import OutputError, PipelineError
from pipeline.formats import geoparquet
from pipeline.lsystem import ArchiveWriter, encode
from pipeline.model import PointCloud
from pipeline.output import write_text
from pipeline.report import peak_rss_mb

TABLE, MODELS, CITY, MANIFEST = (
    "trees.parquet",
    "models.lsjson.jsonl.zst",
    "trees.city.jsonl",
    "manifest.json",
)

COLLECT_EVERY = 500
"""Trees between two collections of garbage: a collection looks at all that lives, which is much."""

PIECE = 1_000_000
"""Points that are looked at together where all of them are."""

EDITION = "als"
"""What trees are called where no survey is named."""


ZERO_M = 100_000.0
"""Vertices are counted from the corner of a block so wide, whatever the cells that it is cut into."""


@dataclass(frozen=True)
class CellTask:
    """What a worker needs to know of one cell.

    Parameters
    ----------
    cell : Cell
    points : Path
        The points of core and buffer: LAS that the batch wrote.
    folder : Path
        Where the four files go, ``DIR/cells/<cell>``.
    config_json : str
        A `Config` as JSON.
    config_hash, input_hash : str
        Written to the manifest.
    edition : str
        Which survey the points are of; the first part of every tree_id.
    crs : str, optional
        Reference system of the tiles.
    crs_assumed : bool
        Whether the tiles do not say it.
    ground : Path, optional
        Points of the ground, where they are not among `points`.
    """

    cell: Cell
    points: Path
    folder: Path
    config_json: str = "{}"
    config_hash: str = ""
    input_hash: str = ""
    edition: str = EDITION
    crs: str | None = None
    crs_assumed: bool = False
    ground: Path | None = None

    @property
    def config(self) -> Config:
        """The options."""
        return Config.model_validate_json(self.config_json)


def work(cell: Cell, points: Path, folder: Path, job: Job) -> dict[str, Any]:
    """Do a cell of a job of the engine; ``edition`` and ``ground`` come from its `extra`."""
    task = CellTask(
        cell,
        points,
        folder,
        config_json=job.config_json,
        config_hash=job.config_hash,
        input_hash=job.input_hash,
        edition=job.extra.get("edition") or EDITION,
        crs=job.crs or None,
        crs_assumed=job.crs_assumed,
        ground=job.extra.get("ground"),
    )
    return work_cell(task)


def work_cell(task: CellTask) -> dict[str, Any]:
    """Find, model and write the trees of a cell.

    A tree belongs to the cell whose half-open core holds its apex, and keeps all its points, those in
    the buffer included. Every tree is written, be it as a fallback.

    Parameters
    ----------
    task : CellTask

    Returns
    -------
    dict
        The manifest, which is written last.

    Raises
    ------
    PipelineError
        If the points cannot be read.
    OutputError
        If a file cannot be written; then none of the cell is left.
    """
    begin = perf_counter()
    with _all_or_none(task):
        config = task.config
        cloud = read_part(task.points, crs=task.crs)
        cloud = replace(cloud, metadata={**cloud.metadata, "crs_assumed": task.crs_assumed})
        ground = None if task.ground is None else read_cloud(task.ground)
        found = _segmented(cloud, ground, config)
        told = _write_trees(task, config, cloud, found)
        core = _count_in_core(cloud, task.cell)
        manifest = {
            "cell": task.cell.name,
            "config_hash": task.config_hash,
            "input_hash": task.input_hash,
            "edition": task.edition,
            "crs": task.crs,
            "crs_assumed": task.crs_assumed,
            **told,
            "points": core,
            "seconds": round(perf_counter() - begin, 3),
            "peak_rss_mb": peak_rss_mb(),
            "files": {name: _sha256(task.folder / name) for name in (TABLE, MODELS, CITY)},
        }
        write_text(task.folder / MANIFEST, json.dumps(manifest, indent=2, ensure_ascii=False) + "\n")
    return manifest


def _count_in_core(cloud: PointCloud, cell: Cell) -> int:
    """Count the points in the half-open core, without a copy of all coordinates."""
    pieces = range(0, len(cloud), PIECE)
    return sum(int(cell.contains(cloud.xyz[p : p + PIECE, :2] + cloud.origin[:2]).sum()) for p in pieces)


def own_trees(trees: Sequence[AirborneTree], cloud: PointCloud, cell: Cell) -> list[AirborneTree]:
    """Return the trees whose apex lies in the half-open core of a cell, by x, y and z of it."""
    if not trees:
        return []
    apexes = np.array([tree.apex for tree in trees]) + cloud.origin
    order = np.lexsort(apexes.T[::-1])
    return [trees[k] for k in order.tolist() if cell.contains(apexes[k, :2])]


def _segmented(cloud: PointCloud, ground: PointCloud | None, config: Config) -> Segmented:
    if not len(cloud):
        nowhere = Raster(np.full((1, 1), np.nan), np.zeros(2), 1.0)
        return Segmented((), nowhere, np.zeros(0, dtype=bool))
    options = config.airborne
    return segment(cloud, ground=ground, options=options)


def _stages(config: Config) -> Stages:
    options = config.airborne_models
    return Stages(config.clean, config.skeleton, config.cylinders, options)


def _write_trees(task: CellTask, config: Config, cloud: PointCloud, found: Segmented) -> dict[str, Any]:
    """Write models and rows of all trees, holding one model at a time; return what the manifest tells."""
    stages = _stages(config)
    trees = own_trees(found.trees, cloud, task.cell)
    stems = dict(zip(map(id, found.trees), near_stems(cloud, found.trees, found.terrain), strict=True))
    survey = Survey(task.edition, task.cell.name, task.config_hash, task.crs_assumed)
    names = tree_ids(task.edition, np.array([tree.apex for tree in trees]).reshape(-1, 3) + cloud.origin)
    rows, errors, fallbacks = [], {}, 0
    archive = ArchiveWriter(task.folder / MODELS)
    zero = np.array([np.floor(edge / ZERO_M) * ZERO_M for edge in (task.cell.x0, task.cell.y0)] + [0.0])
    sequence = SeqWriter(task.folder / CITY, options=config.cityjson, zero=zero)
    with _calm_garbage(), archive, sequence:
        for number, (name, tree) in enumerate(zip(names, trees, strict=True), 1):
            made = model_tree(cloud, tree, found.terrain, stages=stages, beside=stems[id(tree)])
            flags = made.tree.metadata["flags"]
            archive.add(name, encode(made.tree, options=config.lsystem))
            sequence.add(made.tree, name)
            rows.append(row(name, made, tree, cloud, survey=survey))
            fallbacks += "fallback" in flags
            if "failed" in flags:
                errors[name] = made.error
            if number % COLLECT_EVERY == 0:
                gc.collect()
    geoparquet.write(table(rows), task.folder / TABLE, crs=task.crs)
    return {"trees": len(trees), "fallback_trees": fallbacks, "failures": errors}


@contextmanager
def _all_or_none(task: CellTask) -> Iterator[None]:
    """Remove the old files first and, if anything fails, the new ones, so that no half of a cell is left."""
    _remove(task.folder)
    try:
        try:
            yield
        except OutputError as error:
            msg = f"cell {task.cell.name}: {error}; then run the same command again"
            raise OutputError(msg) from error
        except PipelineError:
            raise
        except OSError as error:
            reason = error.strerror or str(error)
            msg = f"cell {task.cell.name}: {reason}; free space on the disk, then run the same command again"
            raise OutputError(msg) from error
    except BaseException:
        if not (task.folder / MANIFEST).exists():  # else another worker has done the cell meanwhile
            _remove(task.folder)
        raise


def _remove(folder: Path) -> None:
    for name in (MANIFEST, TABLE, MODELS, CITY):
        with suppress(OSError):
            (folder / name).unlink(missing_ok=True)


@contextmanager
def _calm_garbage() -> Iterator[None]:
    """Collect no garbage meanwhile: models and documents are large trees of lists without circles."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


def _sha256(path: Path) -> str:
    with path.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()
