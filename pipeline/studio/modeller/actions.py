"""What the buttons and sliders of the Model tab do."""

from __future__ import annotations

from typing import Any, Protocol

from pipeline.studio.modeller.scene import Scene
from pipeline.studio.shell import Shell


class Actions(Protocol):
    """What a tab offers to those who lay it out."""

    shell: Shell
    scene: Scene

    def act(self, name: str, /, *given: Any) -> None:
        """Let the session do something, and show what comes of it."""

    def hold(self) -> None:
        """Begin a drag."""

    def settle(self) -> None:
        """End a drag."""

    def stop(self) -> None:
        """Stop growing."""

    def fit(self) -> None:
        """Show the whole tree."""

    def save(self) -> None:
        """Write a file into the folder that the studio was started with."""
