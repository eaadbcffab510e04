"""The film: one year after the other."""

from __future__ import annotations

from collections.abc import Callable

from pipeline.studio.shell import Shell

FRAME_S = 0.35  # between two years


class Film:
    """Turns to year after year, while its tab is shown.

    Parameters
    ----------
    shell : Shell
    turn_to : callable
        Shows a year.
    tab : str
    """

    def __init__(self, shell: Shell, turn_to: Callable[[int], None], tab: str) -> None:
        self._shell, self._state, self._turn_to, self._tab = shell, shell.state, turn_to, tab

    def play(self) -> None:
        """Show year after year, or stop that; after the last one it begins anew."""
        self._state.years_playing = not self._state.years_playing
        if self._state.years_playing:
            if self._state.years_year >= self._state.years_last:
                self._turn_to(0)
            self._shell.later(FRAME_S, self._frame)

    def _frame(self) -> None:
        """Show the next year."""
        if not self._state.years_playing:
            return
        if self._state.years_year >= self._state.years_last or self._state.tab != self._tab:
            self._state.years_playing = False
            return
        self._turn_to(int(self._state.years_year) + 1)
        self._shell.later(FRAME_S, self._frame)
