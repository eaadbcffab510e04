"""What a worker does with one task; whatever goes wrong is a value, so that only its own task is lost.

While a task runs, a claim file names it, its process and its worker. A claim that is still there
when the task begins again is that of a process that died of it: after `Order.attempts` of them the task
is not tried any more, whatever the scheduler thinks.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import socket
import traceback
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

from distributed import get_worker

from pipeline.airborne.grid import Cell, GridOptions, can_split
from pipeline.batch import manifests
from pipeline.batch.explode import Slice, explode, exploded
from pipeline.batch.gather import Sources, gather
from pipeline.cloud.parts import Frame
from pipeline.errors import OutputError, PipelineError
from pipeline.output import write_text
from pipeline.version import __version__

WIDEST_M = 1000.0
"""Cells with a wider core are split: rasters take 215 bytes a square metre, points 97 each."""

Status = Literal["done", "failed", "crashed", "memory", "split"]


@dataclass(frozen=True)
class Job:
    """What all cells of a run share, and the function that does one.

    Parameters
    ----------
    work : callable
        ``work(cell, points, folder, job) -> manifest``: makes the files of a cell in `folder`, the
        manifest last, from the file `points`.
    out : Path
    grid : GridOptions
    config_hash, input_hash : str
    config_json : str
    crs : str
    crs_assumed : bool
    attempts : int
        Processes that a task may cost.
    extra : dict
        What else `work` needs.
    """

    work: Callable[[Cell, Path, Path, Job], dict[str, Any]]
    out: Path
    grid: GridOptions
    config_hash: str
    input_hash: str
    config_json: str = "{}"
    crs: str = ""
    crs_assumed: bool = False
    attempts: int = 2
    extra: dict[str, Any] = field(default_factory=dict)

    @property
    def points(self) -> Path:
        """Where the points of cells are."""
        return self.out / "work"

    @property
    def run(self) -> str:
        """Name of the run: a scheduler that serves two of them tells their cells apart by it."""
        told = (str(self.out), self.config_hash, self.input_hash)
        return hashlib.sha256(json.dumps(told).encode()).hexdigest()[:12]


@dataclass(frozen=True)
class Outcome:
    """What became of a task.

    Parameters
    ----------
    status : str
    facts : dict
        Of a cell, its manifest; of a slice, what `explode` returns; of a split cell, its ``points`` or
        ``size_m``, which are too many or too large.
    error, trace : str, optional
    deaths : tuple of (str, int)
        Worker and process of the attempts that were lost.
    """

    status: Status
    facts: dict[str, Any] = field(default_factory=dict)
    error: str | None = None
    trace: str | None = None
    deaths: tuple[tuple[str, int], ...] = ()


def do_slice(job: Job, piece: Slice, cells: tuple[Cell, ...], frame: Frame) -> Outcome:
    """Explode a slice of a tile."""
    there = exploded(piece, cells, job.points)
    if there is not None:  # the answer of an earlier attempt was lost
        return Outcome("done", there)
    return _guarded(
        job, piece.name, lambda: Outcome("done", explode(piece, cells, job.grid, frame, job.points))
    )


def do_cell(job: Job, cell: Cell, root: Cell, sources: Sources) -> Outcome:
    """Gather the points of a cell and do its work, unless it is more than a worker's memory holds."""
    there = manifests.done(job.out, cell, job.config_hash, job.input_hash)
    if there is not None:
        return Outcome("done", there)

    if cell.size_m > WIDEST_M and can_split(cell):
        return Outcome("split", {"size_m": cell.size_m})

    def run() -> Outcome:
        own = job.points / root.name / f"{cell.name}.gathered.las"
        found = gather(sources, cell, job.grid.buffer_m, own)
        try:
            if found.points > job.grid.most_points and can_split(cell):
                return Outcome("split", {"points": found.points})
            folder = job.out / "cells" / cell.name
            folder.mkdir(parents=True, exist_ok=True)
            return Outcome("done", job.work(cell, found.path, folder, job))
        finally:
            own.unlink(missing_ok=True)

    return _guarded(job, cell.name, run)


def _guarded(job: Job, name: str, run: Callable[[], Outcome]) -> Outcome:
    """Run a task under a claim, and turn every error into an outcome."""
    claims = job.points / "claims" / name
    deaths = lost(claims)
    if len(deaths) >= job.attempts:
        return Outcome("crashed", deaths=deaths)
    try:
        with _claim(claims):
            return run()
    except MemoryError as error:
        return Outcome("memory", error=f"it needs more memory than there is ({error})")
    except OutputError as error:  # a disk may be free again, a file server back: tried once more
        return Outcome("failed", error=" ".join(str(error).split()), trace=traceback.format_exc())
    except PipelineError as error:
        return Outcome("failed", error=" ".join(str(error).split()))
    except Exception as error:  # it shall not cost the other cells
        text = " ".join(f"unexpected {type(error).__name__}: {error}".split())
        if isinstance(error, OSError) and error.errno == errno.ENOSPC:
            text = (
                f"the disk of {job.out} is full; free space, run `treepipe batch retry {job.out}` and go on"
            )
        return Outcome("failed", error=text, trace=traceback.format_exc())


@contextmanager
def _claim(claims: Path) -> Iterator[None]:
    """Say that this process works on it, until it is done or has failed."""
    path = claims / f"{uuid.uuid4().hex}.json"
    told = {"worker": worker_address(), "pid": os.getpid(), "host": socket.gethostname()}
    write_text(path, json.dumps(told))
    try:
        yield
    finally:
        path.unlink(missing_ok=True)


def still_at_work(points: Path) -> list[int]:
    """Return the processes of this machine that live and claim a task: workers whose driver was killed."""
    pids = set()
    for path in (points / "claims").glob("*/*.json"):
        try:
            told = json.loads(path.read_text(encoding="utf-8"))
            if told["host"] == socket.gethostname():
                os.kill(int(told["pid"]), 0)
                pids.add(int(told["pid"]))
        except (OSError, ValueError, LookupError):  # it is gone
            continue
    return sorted(pids)


def lost(claims: Path) -> tuple[tuple[str, int], ...]:
    """Return worker and process of the claims that are there."""
    found = []
    for path in sorted(claims.glob("*.json")):
        try:
            told = json.loads(path.read_text(encoding="utf-8"))
            found.append((str(told["worker"]), int(told["pid"])))
        except (OSError, ValueError, LookupError):  # half written by a process that died there
            found.append(("", 0))
    return tuple(found)


def version_there() -> str:
    """Return the version that a worker has, if it can load what does a cell."""
    import_module("pipeline.batch.cell")
    return __version__


def worker_address() -> str:
    """Return the address of the worker that this runs on; nothing outside a cluster."""
    try:
        return str(get_worker().address)
    except ValueError:
        return ""
