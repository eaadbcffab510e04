"""The store makes a stage's result once per set of inputs, and keeps time."""

from __future__ import annotations

import pytest

from pipeline.options import Options
from pipeline.store import Store


class Step(Options):
    """Options of the stage below."""

    by: int = 1


def test_a_stage_runs_again_only_when_something_changed():
    calls = []

    def add(value, *, options):
        calls.append(options.by)
        return [*value, options.by]

    store, start = Store(), [0]
    first = store.remember("add", add, start, options=Step())
    assert store.remember("add", add, start, options=Step()) is first
    assert store.remember("add", add, start, options=Step(by=2)) == [0, 2]
    assert store.remember("add", add, [0], options=Step(by=2)) == [0, 2]
    assert calls == [1, 2, 2]
    assert store.seconds["add"] >= 0


def test_clock_adds_up_and_counts_failures():
    def fail():
        raise ZeroDivisionError

    store = Store()
    with pytest.raises(ZeroDivisionError):
        store.clock("write", fail)
    before = store.seconds["write"]
    assert store.clock("write", sum, [1, 2]) == 3
    assert store.seconds["write"] >= before
