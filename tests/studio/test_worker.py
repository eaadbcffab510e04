"""The worker: the latest wish only, ended at any step, and alive whatever goes wrong."""

from itertools import count
from threading import Event

import pytest

from pipeline.errors import UsageError
from pipeline.studio.worker import Worker

PATIENCE_S = 30
ENDLESS = None


class Watcher:
    """Keeps what the worker tells, and lets a test wait for it."""

    def __init__(self):
        self.made, self.sentences, self.steps, self.stops = [], [], [], 0
        self.begun, self.over = Event(), Event()

    def begins(self, wish):
        """Keep nothing."""

    def growing(self, step):
        """Keep a step."""
        self.steps.append(step)
        self.begun.set()

    def done(self, result):
        """Keep a result."""
        self.made.append(result)
        self.over.set()

    def stopped(self):
        """Count a stop."""
        self.stops += 1
        self.over.set()

    def failed(self, sentence):
        """Keep a sentence."""
        self.sentences.append(sentence)
        self.over.set()

    def wait(self, event="over"):
        """Wait for what a test waits for, and make ready for the next."""
        assert getattr(self, event).wait(PATIENCE_S)
        getattr(self, event).clear()


def counted(wish, told):
    """Tell as many steps as are wished for; raise what is wished for."""
    if isinstance(wish, Exception):
        raise wish
    for step in count() if wish is ENDLESS else range(wish):
        told(step)
    return -wish


@pytest.fixture
def watcher():
    return Watcher()


@pytest.fixture
def worker(watcher):
    made = Worker(counted, watcher, gather_s=0.001)
    yield made
    made.close()


def test_it_makes_what_is_wanted_and_tells_every_step(worker, watcher):
    worker.ask(3)
    watcher.wait()
    assert (watcher.made, watcher.steps) == ([-3], [0, 1, 2])


def test_of_many_wishes_the_last_one_is_made(watcher):
    held = Event()
    watcher.begins = lambda _wish: held.wait(PATIENCE_S)
    worker = Worker(counted, watcher)
    for wish in range(1, 5):
        worker.ask(wish)
    held.set()
    watcher.wait()
    worker.close()
    assert watcher.made == [-4]


def test_it_is_busy_until_there_is_a_result_or_none_is_wanted(watcher):
    seen = []
    worker = Worker(counted, watcher)
    watcher.done = lambda _result: (seen.append(worker.busy), watcher.over.set())
    assert not worker.busy
    worker.ask(2)
    watcher.wait()
    worker.ask(ENDLESS)
    watcher.wait("begun")
    seen.append(worker.busy)
    worker.stop()
    seen.append(worker.busy)
    worker.close()
    assert seen == [False, True, False]


def test_a_newer_wish_overtakes_long_work(worker, watcher):
    worker.ask(ENDLESS)
    watcher.wait("begun")
    worker.ask(2)
    watcher.wait()
    assert (watcher.made, watcher.stops) == ([-2], 0)


def test_long_work_can_be_stopped_and_the_worker_lives_on(worker, watcher):
    worker.ask(ENDLESS)
    watcher.wait("begun")
    worker.stop()
    watcher.wait()
    assert (watcher.stops, watcher.made) == (1, [])
    worker.ask(1)
    watcher.wait()
    assert watcher.made == [-1]


@pytest.mark.parametrize(
    ("error", "says"),
    [
        (UsageError("no tree; give more points"), "no tree; give more points"),
        (MemoryError(), "this does not fit into memory; ask for something smaller"),
        (ValueError("odd"), "unexpected ValueError: odd (test_worker.py, line "),
    ],
)
def test_whatever_goes_wrong_is_a_sentence_and_the_worker_lives_on(worker, watcher, error, says):
    worker.ask(error)
    watcher.wait()
    assert watcher.sentences[0].startswith(says)
    worker.ask(1)
    watcher.wait()
    assert watcher.made == [-1]


@pytest.mark.parametrize("told", ["begins", "growing", "done"])
def test_what_the_watcher_does_wrong_is_a_sentence_too(worker, watcher, told, monkeypatch):
    def broken(_given):
        raise RuntimeError(told)

    with monkeypatch.context() as patch:
        patch.setattr(watcher, told, broken)
        worker.ask(1)
        watcher.wait()
    assert f"unexpected RuntimeError: {told}" in watcher.sentences[0]
    worker.ask(1)
    watcher.wait()
    assert watcher.made == [-1]
