"""What the Years tab's worker tells, brought from its thread into the server's."""

from __future__ import annotations

from typing import Any

from pipeline.studio.shell import Shell
from pipeline.studio.years.board import Board
from pipeline.studio.years.growing import Story
from pipeline.studio.years.plan import Plan

TELL_S = 0.2  # least time between two pictures of a growth
COMPILES = "; the very first ones take half a minute, as their code is compiled"
STOPPED = "stopped; the years that are there stay. Press Grow to go on, or undo."


class News:
    """The watcher of the worker.

    Parameters
    ----------
    shell : Shell
    board : Board
        Shows the years.
    """

    def __init__(self, shell: Shell, board: Board) -> None:
        self._shell, self._board = shell, board
        self._told = 0.0
        self._grew = False

    def begins(self, plan: Plan) -> None:
        """Say that it grows."""
        self._told = self._shell.clock()
        doing = f"growing: {plan.years} years{'' if self._grew else COMPILES}"
        self._say({"years_busy": True, "years_progress": 0, "years_doing": doing})

    def growing(self, story: Story) -> None:
        """Show the years so far, not too often; the whole story is told when it is done."""
        self._grew = True
        now = self._shell.clock()
        if now - self._told >= TELL_S and not story.whole:
            self._told = now
            self._shell.soon(lambda: self._board.show_story(story))

    def done(self, story: Story) -> None:
        """Show the years."""
        self._shell.soon(lambda: self._board.show_story(story))

    def stopped(self) -> None:
        """Tell that growth has been stopped."""
        self._say({"years_busy": False, "years_doing": STOPPED})

    def failed(self, sentence: str) -> None:
        """Tell what cannot grow."""
        self._say({"years_busy": False, "years_doing": ""})
        self._shell.soon(lambda: self._shell.trouble(sentence))

    def _say(self, said: dict[str, Any]) -> None:
        self._shell.soon(lambda: self._shell.state.update(said))
