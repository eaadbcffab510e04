"""One thread that makes what was asked for last; work at an earlier wish ends at its next step."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from pathlib import Path
from threading import Condition, Thread
from typing import Generic, Protocol, TypeVar

from pipeline.errors import PipelineError

GATHER_S = 0.005  # how long wishes are gathered: a slider that is dragged makes many

W = TypeVar("W")  # wish
S = TypeVar("S")  # step
R = TypeVar("R")  # result
W_contra = TypeVar("W_contra", contravariant=True)
S_contra = TypeVar("S_contra", contravariant=True)
R_contra = TypeVar("R_contra", contravariant=True)

Job = Callable[[W, Callable[[S], None]], R]
"""Makes a result of a wish, and tells every step; what the telling raises must end it."""


class Watcher(Protocol[W_contra, S_contra, R_contra]):
    """Is told how the work goes, in the worker's thread."""

    def begins(self, wish: W_contra, /) -> None:
        """A wish is begun; what takes its time may be done here."""

    def growing(self, step: S_contra, /) -> None:
        """A step is done."""

    def done(self, result: R_contra, /) -> None:
        """What was asked for is made."""

    def stopped(self) -> None:
        """It was stopped by `Worker.stop`."""

    def failed(self, sentence: str, /) -> None:
        """It cannot be made."""


class _Overtaken(Exception):  # no error: something newer is wanted, or nothing
    pass


class Worker(Generic[W, S, R]):
    """Works in a thread of its own, at the latest wish only.

    Parameters
    ----------
    job : callable
        Makes a result of a wish. It calls its second argument after every step, with whatever is to be told
        of it; that call raises where the work is no longer wanted.
    watcher : Watcher
    gather_s : float, optional
        How long it waits for newer wishes before it begins, seconds.
    """

    def __init__(self, job: Job[W, S, R], watcher: Watcher[W, S, R], gather_s: float = GATHER_S) -> None:
        self._job, self._watcher, self._gather_s = job, watcher, gather_s
        self._change = Condition()
        self._wanted: list[W] = []  # the wish, or none
        self._stop = self._end = self._making = False
        self._thread = Thread(target=self._work, name="studio worker", daemon=True)
        self._thread.start()

    @property
    def busy(self) -> bool:
        """Whether something is wanted that is neither made, nor given up, nor told to stop."""
        with self._change:
            return (self._making or bool(self._wanted)) and not self._stop

    @property
    def stopping(self) -> bool:
        """Whether it was told to stop, and nothing is wanted since."""
        return self._stop

    def ask(self, wish: W) -> None:
        """Want something; whatever was wanted before is not any more."""
        with self._change:
            self._wanted, self._stop = [wish], False
            self._change.notify_all()

    def stop(self) -> None:
        """Stop what is being made, as soon as the present step is over."""
        with self._change:
            self._wanted, self._stop = [], True
            self._change.notify_all()

    def close(self) -> None:
        """End the thread, at the next step."""
        with self._change:
            self._end = self._stop = True
            self._change.notify_all()

    def _work(self) -> None:
        while wishes := self._next():
            self._make(wishes[0])

    def _next(self) -> list[W]:
        """Wait for a wish, and a little longer for a newer one; nothing at the end."""
        while True:
            with self._change:
                self._change.wait_for(lambda: bool(self._wanted) or self._end)
                self._change.wait_for(lambda: self._end, self._gather_s)
                if self._end:
                    return []
                wishes, self._wanted = self._wanted, []
                self._making = bool(wishes)
            if wishes:
                return wishes
            self._watcher.stopped()  # while it was gathered

    def _make(self, wish: W) -> None:
        """Make a result and tell of it; whatever goes wrong is told, and the thread lives on."""
        try:
            self._watcher.begins(wish)
            result = self._job(wish, self._told)
            self._making = False  # before it is told, so that who is told finds nothing at work
            self._watcher.stopped() if self._stop else self._watcher.done(result)
        except _Overtaken:
            self._making = False
            if self._stop:
                self._watcher.stopped()
        except Exception as error:  # the last resort: the page goes on and says so
            self._making = False
            self._watcher.failed(sentence_of(error))

    def _told(self, step: S) -> None:
        if self._stop or self._wanted:
            raise _Overtaken
        self._watcher.growing(step)


def sentence_of(error: BaseException) -> str:
    """Say what went wrong: an error of the project in its own words, any other one with its place."""
    if isinstance(error, PipelineError):
        return str(error)
    if isinstance(error, MemoryError):
        return "this does not fit into memory; ask for something smaller"
    places = traceback.extract_tb(error.__traceback__)
    place = f" ({Path(places[-1].filename).name}, line {places[-1].lineno})" if places else ""
    return f"unexpected {type(error).__name__}: {error}{place}; undo the last change"
