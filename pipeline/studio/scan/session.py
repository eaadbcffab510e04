"""One sitting with a scan: what is opened, the options with their history, and what was made last."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

from pipeline.config import Config
from pipeline.errors import UsageError
from pipeline.exchange import write
from pipeline.model import TreeModel
from pipeline.studio.downloads import packed_as
from pipeline.studio.folders import Folders
from pipeline.studio.history import History
from pipeline.studio.scan.beside import NOTHING_BESIDE, Beside
from pipeline.studio.scan.fields import changed, reset
from pipeline.studio.scan.making import Shown, Wish

Against = Path | Literal["before", "start"] | None
"""What to compare with: a file, the result before the last change, or that of the options at the start."""


_Place = tuple[Path | None, int, History[Config] | None, Against, Beside]


class ScanSession:
    """What a person has done, without a browser.

    Parameters
    ----------
    folders : Folders

    Attributes
    ----------
    path : Path or None
        What is opened, or is to be.
    history : History of Config, or None
        None until it is known what options a file was made with.
    against : Path or str or None
    aligned : bool
    beside : Beside
        What is known of the tree beside its points.
    shown : Shown or None
        What was made last.
    """

    def __init__(self, folders: Folders) -> None:
        self.folders = folders
        self.path: Path | None = None
        self.history: History[Config] | None = None
        self.against: Against = None
        self.aligned = False
        self.beside = NOTHING_BESIDE
        self.shown: Shown | None = None
        self._turn = self._turns = 0
        self._before: _Place = (None, 0, None, None, NOTHING_BESIDE)

    @property
    def config(self) -> Config:
        """The present options."""
        return self.history.present if self.history else Config()

    @property
    def start(self) -> Config:
        """The options at the start: those of a run, else the defaults."""
        return self.shown.opened.config if self.shown else Config()

    def open(self, path: Path) -> None:
        """Want a cloud, a model or the folder of a run.

        Raises
        ------
        UsageError
            If it lies outside the folders.
        """
        real = self.folders.inside(path)
        if self.history is not None:
            self._before = (self.path, self._turn, self.history, self.against, self.beside)
        self._turns += 1
        self.path, self._turn, self.history = real, self._turns, None
        self.against, self.beside = None, NOTHING_BESIDE

    def change(self, key: str, given: Any) -> bool:
        """Give an option another value, as part of one gesture; return whether that is another one.

        Raises
        ------
        UsageError
            If the value is not allowed, or nothing is opened.
        """
        if self.history is None:
            msg = "nothing is opened yet; open a cloud first"
            raise UsageError(msg)
        before = self.config
        self.history = self.history.record(changed(before, key, given), key)
        return self.config != before

    def settle(self) -> None:
        """End the gesture: what follows is another step to undo."""
        if self.history:
            self.history = self.history.settled()

    def reset(self) -> None:
        """Give all options the values of the start."""
        if self.history:
            self.history = self.history.record(reset(self.config, self.start))

    def undo(self) -> None:
        """Take the last change of an option back."""
        if self.history:
            self.history = self.history.undo()

    def redo(self) -> None:
        """Do what was undone last."""
        if self.history:
            self.history = self.history.redo()

    def compare(self, against: Against) -> None:
        """Choose the model to compare with, or none.

        Raises
        ------
        UsageError
            If the file lies outside the folders.
        """
        self.against = self.folders.inside(against) if isinstance(against, Path) else against

    def know(self, **given: Any) -> None:
        """Tell what is known beside the points: fields of `Beside`.

        Raises
        ------
        UsageError
            If nothing is opened, or the ground lies outside the folders.
        """
        if self.history is None:
            msg = "nothing is opened yet; open a cloud first"
            raise UsageError(msg)
        beside = self.beside._replace(**given)
        if beside.ground is not None:
            beside = beside._replace(ground=self.folders.inside(beside.ground))
        self.beside = beside

    def wish(self) -> Wish | None:
        """Return what is to be shown."""
        if self.path is None:
            return None
        config = self.history.present if self.history else None
        return Wish(self.path, self._turn, config, self._other(), self.aligned, self.beside)

    def take(self, shown: Shown) -> bool:
        """Take over what was made; return whether it is of another file than what was shown before."""
        new = self.shown is None or self.shown.wish.turn != shown.wish.turn
        self.shown = shown
        if self.history is None or shown.wish.turn != self._turn:
            self.path, self._turn, self.history = (
                shown.wish.path,
                shown.wish.turn,
                History(shown.result.config),
            )
        return new

    def is_late(self, shown: Shown) -> bool:
        """Tell whether something else was opened after it had been asked for."""
        return shown.wish.turn < self._turn

    def fail(self) -> None:
        """Forget what cannot be made: another file, or one to compare with; options can be undone."""
        if self.history is None:
            self.path, self._turn, self.history, self.against, self.beside = self._before
        elif self.shown is not None and self.beside != self.shown.wish.beside:
            self.beside = self.shown.wish.beside
        elif isinstance(self.against, Path) and (self.shown is None or self.shown.wish.other != self.against):
            self.against = None

    @property
    def stem(self) -> str:
        """Name of files without a suffix."""
        return self.shown.opened.name if self.shown else "tree"

    def saved(self) -> bytes:
        """Return the options of the shown model as a TOML file; ``treepipe run --config`` takes it."""
        config = self.shown.result.config if self.shown else self.config
        return config.to_toml().encode()

    def _other(self) -> Path | Config | None:
        if self.against == "start":
            return self.start
        if self.against == "before":
            past = self.history.settled().past if self.history else ()
            return past[-1] if past else None
        return self.against if isinstance(self.against, Path) else None


def packed(tree: TreeModel, format_name: str, stem: str, config: Config) -> tuple[str, bytes]:
    """Return the name and content of a download: one file, or a .zip where several belong together.

    Parameters
    ----------
    tree : TreeModel
    format_name : str
        Of `pipeline.exchange.FORMATS`.
    stem : str
        Name without a suffix.
    config : Config
        How formats are written.

    Raises
    ------
    UsageError
        If there is no such format.
    """
    return packed_as(format_name, stem, lambda target: write(tree, target, config))
