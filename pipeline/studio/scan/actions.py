"""What the buttons of the Scan tab do."""

from __future__ import annotations

from typing import Protocol

from pipeline.studio.scan.scene import ScanScene
from pipeline.studio.shell import Shell


class Actions(Protocol):
    """What a tab offers to those who lay it out."""

    shell: Shell
    scene: ScanScene

    def undo(self) -> None:
        """Take the last step back."""

    def redo(self) -> None:
        """Do again what was undone."""

    def reset(self) -> None:
        """Give all options the values of the start."""

    def stop(self) -> None:
        """Stop what is being made."""

    def fit(self) -> None:
        """Show all."""

    def list_files(self) -> None:
        """Look what the folders hold."""
