"""The folders that the command line gave: nothing is opened or written outside of them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pipeline.errors import InputMissingError, OutputExistsError, UsageError


class Folders:
    """The folders that the command line gave; no file outside them is opened or written.

    Parameters
    ----------
    given : sequence of Path
        Folders, and files whose folders count. The first one is where results go.

    Raises
    ------
    InputMissingError
        If there is no such file or folder.
    """

    def __init__(self, given: Sequence[Path]) -> None:
        for path in given:
            if not path.exists():
                msg = f"{path}: there is no such file or folder; check the name"
                raise InputMissingError(msg)
        folders = [(path if path.is_dir() else path.parent).resolve() for path in given]
        self.all: tuple[Path, ...] = tuple(dict.fromkeys(folders))

    def inside(self, path: Path) -> Path:
        """Return the path without links and dots, where it lies in one of the folders.

        Raises
        ------
        UsageError
            If it does not.
        """
        real = path.resolve()
        if not any(real.is_relative_to(folder) for folder in self.all):
            msg = f"{path}: lies outside the folders that the studio was started with; start it with {path}"
            raise UsageError(msg)
        return real

    def read(self, path: Path, most: int) -> bytes:
        """Return the first bytes of a file, at most so many.

        Raises
        ------
        UsageError
            If it lies outside the folders.
        InputMissingError
            If it cannot be read.
        """
        try:
            with self.inside(path).open("rb") as file:
                return file.read(most)
        except OSError as error:
            msg = f"{path}: cannot be read ({error.strerror}); check the name and who may read it"
            raise InputMissingError(msg) from error

    def to_write(self, name: str) -> Path:
        """Return where a result of that name goes.

        Raises
        ------
        UsageError
            If no folder was given, or the name is more than a name.
        OutputExistsError
            If the file is there already.
        """
        if not self.all:
            msg = "the studio was started without a folder; download instead, or start it with one"
            raise UsageError(msg)
        is_plain = name.isprintable() and Path(name).name == name and "\\" not in name
        if not name or not is_plain or name.startswith((".", "~")):
            msg = f"{name!r} is no plain name of a file; give one without folders, such as oak.obj"
            raise UsageError(msg)
        target = self.inside(self.all[0] / name)
        if target.exists():
            msg = f"{target}: exists already; give another name"
            raise OutputExistsError(msg)
        return target
