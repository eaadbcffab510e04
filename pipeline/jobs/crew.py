"""Worker processes, each with one task at a time: when one dies, only its own task is lost."""

from __future__ import annotations

import os
import signal
from collections import deque
from collections.abc import Callable, Generator, Sequence
from contextlib import suppress
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from types import FrameType
from typing import Any, Generic, TypeVar

from pipeline.jobs.interrupts import resend_lost_interrupts
from pipeline.jobs.starting import held_back, let_through

Task = TypeVar("Task")
Result = TypeVar("Result")

THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""What the linear algebra libraries read when they are loaded."""

PATIENCE_S = 5.0
"""How long a worker that is asked to stop may take to remove what it has half written."""


def one_thread() -> None:
    """Let linear algebra run on one thread, so that sums are in the same order everywhere.

    Works for libraries that are loaded later, in this process and in those that it starts.
    """
    os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))


def work_through(
    work: Callable[[Task], Result],
    tasks: Sequence[Task],
    *,
    workers: int,
    lost: Callable[[Task, int | None], Result],
) -> Generator[tuple[int, Result], None, None]:
    """Give every task to `work`, on other processes, so that none takes this one along.

    Parameters
    ----------
    work : callable
        Can be pickled; what goes wrong with a task is part of its result.
    tasks : sequence
    workers : int
        Number of processes. With 1 and a single task the work is done in this one.
    lost : callable
        Makes the result of a task whose process died, from the task and the exit code.

    Yields
    ------
    int, result
        Number of the task and its result, as they are done.
    """
    if workers == 1 and len(tasks) <= 1:
        yield from enumerate(map(work, tasks))
        return
    one_thread()
    waiting = deque(range(len(tasks)))
    idle: list[_Worker[Task, Result]] = []
    busy: dict[Any, tuple[int, _Worker[Task, Result]]] = {}
    try:
        while waiting or busy:
            while waiting and len(busy) < workers:
                number = waiting.popleft()
                worker = idle.pop() if idle else _Worker(work)
                worker.give(tasks[number])
                busy[worker.line] = number, worker
            for line in wait(list(busy)):
                number, worker = busy.pop(line)
                try:
                    result = worker.take()
                    idle.append(worker)
                except (EOFError, OSError):
                    result = lost(tasks[number], worker.end())
                yield number, result
    finally:
        for _, worker in busy.values():
            worker.process.terminate()
        for worker in (*idle, *(worker for _, worker in busy.values())):
            worker.end()


class _Worker(Generic[Task, Result]):
    """A process and the line to it."""

    def __init__(self, work: Callable[[Task], Result]) -> None:
        context = get_context("spawn")
        self.line, far_end = context.Pipe()
        self.process: BaseProcess = context.Process(target=_serve, args=(far_end, work), daemon=True)
        with held_back():
            self.process.start()
        far_end.close()  # else the end of the process would go unnoticed

    def give(self, task: Task) -> None:
        """Send a task; that the process is dead already is found by `take`."""
        with suppress(OSError):
            self.line.send(task)

    def take(self) -> Result:
        """Wait for the result of the task."""
        result: Result = self.line.recv()
        return result

    def end(self) -> int | None:
        """Close the line, at which the process ends, and return its exit code."""
        self.line.close()
        self.process.join(PATIENCE_S)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()
        return self.process.exitcode


def _serve(line: Connection, work: Callable[[Task], Result]) -> None:
    """Work off what comes down the line, until it is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent decides
    let_through()
    try:
        signal.signal(signal.SIGTERM, _break_off)
        resend_lost_interrupts(signal.SIGTERM)
        while True:
            line.send(work(line.recv()))
    except (EOFError, OSError, KeyboardInterrupt):
        return


def _break_off(_number: int, _frame: FrameType | None) -> None:
    """Leave by an exception, so that half-written files are removed on the way out."""
    raise KeyboardInterrupt
