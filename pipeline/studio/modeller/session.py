"""One sitting at the studio: the parameters with their history, and the tree that was made last."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from pipeline.output import write_bytes
from pipeline.studio.folders import Folders
from pipeline.studio.history import History
from pipeline.studio.modeller.files import packed, read_parameters, save_parameters, write_model
from pipeline.studio.modeller.modelling import Modelled
from pipeline.studio.modeller.parameters import changed, options_of
from pipeline.synthetic.colonization import PRESETS, ColonizationOptions

MOST_SEED = 2**31


class Session:
    """What a person has done, without a browser.

    Parameters
    ----------
    options : ColonizationOptions
        The first parameters.
    folders : Folders

    Attributes
    ----------
    history : History of ColonizationOptions
    shown : Modelled or None
        The tree that was made last.
    """

    def __init__(self, options: ColonizationOptions, folders: Folders) -> None:
        self.history = History(options)
        self.folders = folders
        self.shown: Modelled | None = None

    @property
    def options(self) -> ColonizationOptions:
        """The present parameters."""
        return self.history.present

    def move(self, name: str, value: Any) -> bool:
        """Give a parameter another value, as part of one gesture; return whether that is another tree.

        Raises
        ------
        UsageError
            If the value, or it with the others, makes no tree.
        """
        return self._become(changed(self.options, **{name: value}), name)

    def settle(self) -> None:
        """End the gesture: what follows is another step to undo."""
        self.history = self.history.settled()

    def new_seed(self) -> None:
        """Draw another seed; everything else keeps its value."""
        self._become(changed(self.options, seed=random_seed()))

    def reset(self) -> None:
        """Give every parameter its default, but the seed."""
        self._become(ColonizationOptions(seed=self.options.seed))

    def preset(self, name: str) -> None:
        """Take an example, with the present seed."""
        self._become(options_of({**PRESETS[name], "seed": self.options.seed}))

    def undo(self) -> None:
        """Take the last step back."""
        self.history = self.history.undo()

    def redo(self) -> None:
        """Do what was undone last."""
        self.history = self.history.redo()

    def open(self, content: bytes, name: str) -> None:
        """Take the parameters of a file.

        Raises
        ------
        InputFormatError
            If it is none of ours.
        """
        self._become(read_parameters(content, name, self.folders))

    def saved(self) -> bytes:
        """Return the parameters as a TOML file."""
        return save_parameters(self.options)

    def exported(self, format_name: str) -> tuple[str, bytes] | None:
        """Return name and content of the shown tree in a format, None before there is one."""
        return packed(self.shown, format_name, self.stem) if self.shown else None

    def save(self, name: str) -> Path | None:
        """Write the shown tree, or with .toml the parameters, into the first folder.

        Raises
        ------
        UsageError, OutputError, OutputExistsError
            If it cannot go there.
        """
        target = self.folders.to_write(name)
        if name.lower().endswith(".toml"):
            write_bytes(target, self.saved())
        elif self.shown is not None:
            write_model(self.shown, target)
        else:
            return None
        return target

    @property
    def stem(self) -> str:
        """Name of files without a suffix."""
        return f"tree-{self.options.seed}"

    def _become(self, options: ColonizationOptions, gesture: str | None = None) -> bool:
        before = self.options
        self.history = self.history.record(options, gesture)
        return self.options != before


def random_seed() -> int:
    """Return a seed that nobody has chosen."""
    return int(np.random.default_rng().integers(MOST_SEED))
