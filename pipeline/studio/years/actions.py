"""What the buttons and sliders of the Years tab do."""

from __future__ import annotations

from typing import Any, Protocol

from pipeline.studio.shell import Shell
from pipeline.studio.years.board import Board
from pipeline.studio.years.film import Film


class Actions(Protocol):
    """What a tab offers to those who lay it out."""

    shell: Shell
    board: Board
    film: Film

    def act(self, name: str, /, *given: Any) -> bool:
        """Let the session do something, and grow what comes of it."""

    def undo(self) -> None:
        """Take the last step back."""

    def redo(self) -> None:
        """Do again what was undone."""

    def grow(self) -> None:
        """Let the years of the plan grow, as far as they have not."""

    def stop(self) -> None:
        """Stop growing."""

    def settle(self) -> None:
        """End a drag."""

    def fit(self) -> None:
        """Show the whole tree."""

    def begin_with_model(self) -> None:
        """Begin with the tree of the Model tab."""

    def refresh(self) -> None:
        """List the models in the folders anew."""

    def unpick(self) -> None:
        """Pick nothing."""

    def edit(self, number: int, /) -> None:
        """Edit an event of the list."""

    def new_event(self) -> None:
        """Edit no event, but prepare another one."""

    def save(self) -> None:
        """Write what replays these years into the folder."""
