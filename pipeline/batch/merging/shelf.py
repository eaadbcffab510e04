"""Columns of numbers that wait on the disk until all trees are there, and are then read one by one."""

from __future__ import annotations

import os
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryFile, gettempdir
from typing import Any

import numpy as np

from pipeline.errors import OutputError


class Shelf:
    """Keep tables of numbers, added at their end, in a file without a name that goes with this object.

    Parameters
    ----------
    columns : int
    folder : Path, optional
        Where the file takes its room, 4 bytes a number; else where the system keeps such files.

    Raises
    ------
    OutputError
        On creation and by `add`, if there is no room, or the folder cannot be written.
    """

    def __init__(self, columns: int, folder: Path | None = None) -> None:
        self._columns = columns
        self._folder = folder or Path(gettempdir())
        self._lengths: list[int] = []
        with self._told():
            self._file = TemporaryFile(dir=self._folder)  # noqa: SIM115 (open as long as this object is)
        weakref.finalize(self, self._file.close)

    def add(self, rows: Any) -> None:
        """Add (N, columns) numbers."""
        with self._told():
            self._file.seek(0, os.SEEK_END)
            self._file.write(np.ascontiguousarray(rows.T, dtype=np.float32).tobytes())
            self._file.flush()
        self._lengths.append(len(rows))

    def column(self, number: int) -> Any:
        """Return a column of all rows, float32."""
        values, at = np.empty(sum(self._lengths), np.float32), 0
        for length in self._lengths:
            self._file.seek(4 * (self._columns * at + number * length))
            values[at : at + length] = np.frombuffer(self._file.read(4 * length), np.float32)
            at += length
        return values

    @contextmanager
    def _told(self) -> Iterator[None]:
        """Say what is wrong with the disk, and what helps."""
        try:
            yield
        except OSError as error:
            msg = f"{self._folder}: cannot be written ({error.strerror}); free space, then merge again"
            raise OutputError(msg) from error
