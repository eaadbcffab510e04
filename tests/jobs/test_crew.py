"""Worker processes: order, deaths, breaking off. `eval` is a worker that every process can import."""

from __future__ import annotations

import multiprocessing
import os

import pytest

from pipeline.jobs.crew import work_through

DEATH = "__import__('os')._exit(9)"


def done(tasks, workers):
    return dict(work_through(eval, tasks, workers=workers, lost=lambda task, code: (task, code)))


def test_a_single_task_needs_no_process():
    assert done(["__import__('os').getpid()"], 1) == {0: os.getpid()}


@pytest.mark.parametrize("workers", [1, 2])
def test_every_task_has_its_result(workers):
    assert done(["1 + 1", "'a' * 3", "6 * 7"], workers) == {0: 2, 1: "aaa", 2: 42}


@pytest.mark.parametrize("workers", [1, 2])
def test_a_worker_that_dies_takes_only_its_own_task_along(workers):
    assert done(["1", DEATH, "3", DEATH, "5"], workers) == {0: 1, 1: (DEATH, 9), 2: 3, 3: (DEATH, 9), 4: 5}


def test_a_worker_that_is_killed_is_told_by_its_signal():
    kill = "__import__('os').kill(__import__('os').getpid(), 9)"
    assert done([kill, "2"], 2) == {0: (kill, -9), 1: 2}


def test_linear_algebra_runs_on_one_thread_in_the_workers():
    assert done(["__import__('os').environ['OMP_NUM_THREADS']", "0"], 2)[0] == "1"


def test_breaking_off_leaves_no_process():
    jobs = work_through(eval, ["1", "__import__('time').sleep(60)"], workers=2, lost=lambda _task, code: code)
    assert next(jobs) == (0, 1)
    jobs.close()
    assert not multiprocessing.active_children()
