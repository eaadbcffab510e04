"""One Dask task per cell, never per tree: a run from its plan to its summary.

Every decision (done, split, quarantined) is a file before it is counted, so that a driver that is
killed goes on where it was.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Mapping
from pathlib import Path
from time import perf_counter, sleep
from typing import Any

from pipeline.airborne.grid import Cell
from pipeline.batch import folder, quarantine
from pipeline.batch.cluster import cluster
from pipeline.batch.dispatch import Dispatch
from pipeline.batch.job import Job
from pipeline.batch.plan import Plan
from pipeline.batch.progress import Progress
from pipeline.batch.tasks import still_at_work
from pipeline.output import write_text

ORPHANS_S = 30.0
"""How long workers of a driver that was killed may take to notice."""


def run_batch(
    plan: Plan,
    job: Job,
    *,
    workers: int = 1,
    scheduler: str | None = None,
    memory_gb: float | None = None,
    watch: Callable[[Progress], None] | None = None,
) -> dict[str, Any]:
    """Do all cells of a plan that are not done yet.

    Parameters
    ----------
    plan : Plan
    job : Job
        Where to, and the function that does one cell.
    workers : int
        Processes of a cluster of our own.
    scheduler : str, optional
        ``tcp://HOST:PORT`` of a cluster that is there.
    memory_gb : float, optional
        What each worker of our own may use.
    watch : callable, optional
        Called with the progress at least once a second.

    Returns
    -------
    dict
        What summary.json says.

    Raises
    ------
    UsageError
        If the folder holds results of other settings or tiles.
    OutputError
        If it cannot be written, or another run works in it.
    ClusterLostError
        If the scheduler or all workers are gone.
    """
    with folder.locked(job.out):
        folder.claim(job.out, plan)
        _let_end(job)
        folder.sweep(job.out)
        run = Dispatch(plan, job, watch or (lambda _: None))
        try:
            if run.open:
                most = max(4, sum(map(len, run.open.values())))
                with cluster(min(workers, most), scheduler, memory_gb, allowed_failures=job.attempts) as (
                    client,
                    link,
                ):
                    run.progress.dashboard = link
                    run.work_through(client)
        finally:
            folder.sweep(job.out)
        if not run.progress.quarantined and plan.only is None:
            shutil.rmtree(job.points, ignore_errors=True)
        else:
            folder.drop_slices(job.out)
        held = _held(job.out, plan)
        broken = {str(facts["tile"]): str(facts["error"]) for facts in held if facts.get("tile")}
        failures = {**plan.failures, **broken, **_treeless(plan, run.progress)}
        return _summary(job.out, run.progress, failures, held)


def _held(out: Path, plan: Plan) -> list[dict[str, Any]]:
    """Return what is known of the plan's cells that are quarantined."""
    cells = quarantine.quarantined(out)
    return [
        {"cell": name, **{key: facts.get(key) for key in ("reason", "error", "tile")}}
        for name, facts in cells.items()
        if plan.only is None or plan.only.covers(Cell.named(name))
    ]


def _treeless(plan: Plan, progress: Progress) -> dict[str, str]:
    """Return what to say of each tile if the run found no tree at all; a cell without trees is usual."""
    if progress.trees or progress.done < progress.planned:
        return {}
    where = f"cell {plan.only.name} of it" if plan.only else "it"
    text = f"no tree was found in {where}; see whether it holds vegetation higher than airborne.min_height_m"
    return {str(tile.path): f"{tile.path}: {text}" for tile in plan.tiles}


def _let_end(job: Job) -> None:
    """Wait for workers whose driver was killed: they would write into what is swept and done again."""
    until = perf_counter() + ORPHANS_S
    while still_at_work(job.points) and perf_counter() < until:
        sleep(0.2)


def write_nothing(out: Path, failures: Mapping[str, str]) -> None:
    """Write the summary of a run whose tiles all failed, unless there are results."""
    if not (out / "summary.json").exists():
        _summary(out, Progress(), failures, [])


def _summary(
    out: Path, progress: Progress, failures: Mapping[str, str], held: list[dict[str, Any]]
) -> dict[str, Any]:
    failed = [{"path": path, "error": error} for path, error in failures.items()]
    summary = progress.summary() | {"failed": failed, "quarantine": held}
    write_text(out / "summary.json", json.dumps(summary, indent=2, ensure_ascii=False) + "\n")
    return summary
