"""What the Scan tab's worker tells, brought from its thread into the server's."""

from __future__ import annotations

from typing import Any, Protocol

from pipeline.studio.scan.making import Shown, Wish
from pipeline.studio.scan.stages import Stage
from pipeline.studio.scan.telling import progress_of
from pipeline.studio.shell import Shell

TELL_S = 1.0  # least time between two messages of one stage
STOPPED = "stopped; what is shown is from before. Change an option or undo to go on."


class Reader(Protocol):
    """Whom the news is for, in the server's thread."""

    def show(self, shown: Shown) -> None:
        """Show what was made."""

    def give_up(self, said: str, trouble: str = "") -> None:
        """Go back to what is shown, and say why."""


class News:
    """The watcher of the worker.

    Parameters
    ----------
    shell : Shell
    reader : Reader
    """

    def __init__(self, shell: Shell, reader: Reader) -> None:
        self._shell, self._reader = shell, reader
        self._stage: tuple[Stage | None, float, float] = (None, 0.0, 0.0)

    def begins(self, _wish: Wish) -> None:
        """Nothing is to be prepared."""

    def growing(self, stage: Stage) -> None:
        """Tell which stage it is, and how long it takes."""
        before, begun, told = self._stage
        now = self._shell.clock()
        if stage != before:
            begun = now
        elif now - told < TELL_S:
            return
        self._stage = stage, begun, now
        said: dict[str, Any] = progress_of(stage, now - begun)
        self._shell.soon(lambda: self._shell.state.update(said))

    def done(self, shown: Shown) -> None:
        """Show what was made."""
        self._shell.soon(lambda: self._reader.show(shown))

    def stopped(self) -> None:
        """Tell that it has been stopped."""
        self._shell.soon(lambda: self._reader.give_up(STOPPED))

    def failed(self, sentence: str) -> None:
        """Tell what cannot be made."""
        self._shell.soon(lambda: self._reader.give_up("", sentence))
