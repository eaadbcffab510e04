"""What a worker does with one task; whatever goes wrong is a value, so that only its own task is lost.

While a task runs, a claim file names it, its process and its worker. A claim that is still there
when the task begins again is that of a process that died of it: after `Order.attempts` of them the task
is not tried any more, whatever the scheduler thinks.
"""

from __future__ import annotations

import errno
import json
import os
import socket
import traceback
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path

from distributed import get_worker

from pipeline.airborne.grid import Cell, can_split
from pipeline.batch import manifests
from pipeline.batch.explode import Slice, explode, exploded
from pipeline.batch.gather import Sources, gather
from pipeline.batch.job import Job, Outcome
from pipeline.cloud.parts import Frame
from pipeline.errors import OutputError, PipelineError
from pipeline.output import write_text
from pipeline.version import __version__

WIDEST_M = 1000.0
"""Cells with a wider core are split: rasters take 215 bytes a square metre, points 97 each."""


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
