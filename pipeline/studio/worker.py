"""One thread that models what was asked for last; what is being grown for an earlier wish ends at once."""

from __future__ import annotations

from threading import Condition, Thread
from typing import Protocol

from pipeline.errors import PipelineError
from pipeline.geometry.colonization import Progress
from pipeline.studio.modelling import Modelled, Modeller
from pipeline.synthetic.colonization import ColonizationOptions

GATHER_S = 0.015  # how long wishes are gathered: a slider that is dragged makes many


class Watcher(Protocol):
    """Is told how the work goes, in the worker's thread."""

    def begins(self, options: ColonizationOptions) -> None:
        """A tree is begun; what takes its time may be done here."""

    def growing(self, progress: Progress) -> None:
        """An iteration is done."""

    def done(self, modelled: Modelled) -> None:
        """What was asked for is made."""

    def stopped(self) -> None:
        """It was stopped by `Worker.stop`."""

    def failed(self, sentence: str) -> None:
        """It cannot be made."""


class _Overtaken(Exception):  # no error: something newer is wanted, or nothing
    pass


class Worker:
    """Models in a thread of its own, the latest wish only.

    Parameters
    ----------
    modeller : Modeller
    watcher : Watcher
    gather_s : float, optional
        How long it waits for newer wishes before it begins, seconds.
    """

    def __init__(self, modeller: Modeller, watcher: Watcher, gather_s: float = GATHER_S) -> None:
        self._modeller, self._watcher, self._gather_s = modeller, watcher, gather_s
        self._change = Condition()
        self._wanted: ColonizationOptions | None = None
        self._stop = self._end = False
        self._thread = Thread(target=self._work, name="modelling", daemon=True)
        self._thread.start()

    @property
    def waiting(self) -> bool:
        """Whether something newer is wanted than what is being made."""
        return self._wanted is not None

    def ask(self, options: ColonizationOptions) -> None:
        """Want a tree; whatever was wanted before is not any more."""
        with self._change:
            self._wanted, self._stop = options, False
            self._change.notify_all()

    def stop(self) -> None:
        """Stop what is being made, as soon as the present iteration is over."""
        with self._change:
            self._wanted, self._stop = None, True
            self._change.notify_all()

    def close(self) -> None:
        """End the thread, at the next iteration."""
        with self._change:
            self._end = self._stop = True
            self._change.notify_all()

    def _work(self) -> None:
        while (options := self._next()) is not None:
            self._make(options)

    def _next(self) -> ColonizationOptions | None:
        """Wait for a wish, and a little longer for a newer one; None at the end."""
        with self._change:
            self._change.wait_for(lambda: self._wanted is not None or self._end)
            self._change.wait_for(lambda: self._end, self._gather_s)
            if self._end:
                return None
            options, self._wanted = self._wanted, None
        if options is None:  # stopped while it was gathered
            self._watcher.stopped()
            return self._next()
        return options

    def _make(self, options: ColonizationOptions) -> None:
        try:
            self._watcher.begins(options)
            modelled = self._modeller.model(options, self._told)
        except _Overtaken:
            if self._stop:
                self._watcher.stopped()
        except PipelineError as error:
            self._watcher.failed(str(error))
        except MemoryError:
            self._watcher.failed("this tree does not fit into memory; make the crown smaller")
        except Exception as error:  # the last resort: the page goes on and says so
            self._watcher.failed(f"unexpected {type(error).__name__}: {error}; undo the last change")
        else:
            self._watcher.stopped() if self._stop else self._watcher.done(modelled)

    def _told(self, progress: Progress) -> None:
        if self._stop or self._wanted is not None:
            raise _Overtaken
        self._watcher.growing(progress)
