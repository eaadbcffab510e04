"""Where the work is done: a Dask cluster of our own, or one that is there already."""

from __future__ import annotations

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import Any

from pipeline.batch.extra import missing
from pipeline.batch.tasks import version_there
from pipeline.errors import InputMissingError, UsageError
from pipeline.jobs.crew import one_thread
from pipeline.version import __version__

CONNECT_S = 10
"""How long a scheduler may take to answer."""

SETTINGS = {
    "distributed.worker.multiprocessing-method": "forkserver",  # a worker that died is back in no time
    "distributed.worker.memory.target": False,  # no data is kept on workers, so nothing to spill
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    "distributed.worker.memory.terminate": 0.95,
    "distributed.worker.memory.monitor-interval": "50ms",
    "distributed.scheduler.work-stealing": False,
    "distributed.comm.timeouts.connect": "30s",
}

PRELOADED = ["distributed", "pipeline.batch.tasks", "pipeline.batch.cell"]
"""What workers load."""

ENDING = "pipeline.batch.orphans"
"""What lets a worker of our own end with its driver."""


@contextmanager
def cluster(
    workers: int, scheduler: str | None, memory_gb: float | None, *, allowed_failures: int
) -> Iterator[tuple[Any, str]]:
    """Give a Dask client, and the address of the dashboard.

    Parameters
    ----------
    workers : int
        Processes of a cluster of our own, with one thread each.
    scheduler : str, optional
        ``tcp://HOST:PORT`` of a cluster that is there; it stays as it is.
    memory_gb : float, optional
        What a worker of our own may use; by default its share of the machine.
    allowed_failures : int
        Workers that a task may cost before the scheduler gives it up.

    Raises
    ------
    MissingExtraError
        If Dask is not installed.
    InputMissingError
        If nobody answers at `scheduler`.
    UsageError
        If its workers have another version.
    """
    one_thread()
    _quiet()
    try:
        dask, distributed = import_module("dask"), import_module("distributed")
    except ImportError as error:
        name = "dask[distributed]"
        raise missing(name) from error
    _quiet()
    with dask.config.set({**SETTINGS, "distributed.scheduler.allowed-failures": allowed_failures}):
        if scheduler is not None:
            yield from _theirs(distributed, scheduler)
        else:
            yield from _ours(distributed, workers, memory_gb)


def _theirs(distributed: Any, address: str) -> Iterator[tuple[Any, str]]:
    try:
        client = distributed.Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        msg = f"--scheduler {address}: nobody answers there; start `dask scheduler` and `dask worker`"
        raise InputMissingError(msg) from error
    try:
        _check_versions(client, address)
        yield client, client.dashboard_link
    finally:
        client.close(timeout=CONNECT_S)


def _check_versions(client: Any, address: str) -> None:
    """Make sure that the workers that are there can read their tasks: otherwise they would never answer.

    Raises
    ------
    UsageError
        If one of them lacks this version, or something that it needs.
    """
    for worker, told in sorted(client.run(version_there, on_error="return").items()):
        if told != __version__:
            lacks = f"has version {told}" if isinstance(told, str) else f"cannot load it ({told})"
            msg = (
                f"--scheduler {address}: the worker {worker} {lacks}, but this is treepipe {__version__}; "
                'install the same version on all machines with `pip install "treepipe[batch]"`'
            )
            raise UsageError(" ".join(msg.split()))


def _load_once(distributed: Any) -> None:
    """Let workers be forked from a process that has loaded all packages: they share it, and begin at once."""
    distributed.utils.get_mp_context().set_forkserver_preload(PRELOADED)  # over what it has set itself


def _ours(distributed: Any, workers: int, memory_gb: float | None) -> Iterator[tuple[Any, str]]:
    _load_once(distributed)
    limit = "auto" if memory_gb is None else f"{memory_gb}GB"
    theirs = distributed.worker.dask.config.get("distributed.worker.preload")
    own = distributed.LocalCluster(
        n_workers=workers,
        preload=[*theirs, ENDING],
        threads_per_worker=1,
        processes=True,
        memory_limit=limit,
        dashboard_address="127.0.0.1:0",
        host="127.0.0.1",
        silence_logs=logging.CRITICAL,
    )
    client = distributed.Client(own, set_as_default=False)
    ended = False
    try:
        yield client, own.dashboard_link
        ended = True
    finally:
        if not ended:
            _kill(own)
        client.close(timeout=CONNECT_S)
        own.close(timeout=CONNECT_S)


def _kill(own: Any) -> None:
    """End the workers at once: what they have half written is swept afterwards."""
    for nanny in own.workers.values():
        nanny.auto_restart = False
        process = nanny.process.process if nanny.process is not None else None
        if process is not None and process.pid is not None:
            os.kill(process.pid, 9)


def _quiet() -> None:
    """Leave it to the run to say what happened to workers."""
    os.environ.setdefault("DASK_LOGGING__DISTRIBUTED", "critical")
    for name in ("", ".client", ".nanny", ".scheduler", ".worker"):
        logging.getLogger(f"distributed{name}").setLevel(logging.CRITICAL)
