"""Many trees in one file, `.lsjson.jsonl.zst`: small, readable by plain tools, and each tree within reach.

One document a line, in compressed frames of some 100 trees, so that ``zstdcat`` streams all lines. Behind
them stands a frame that Zstandard skips: the index. It says where each tree is, so that one tree costs
the index and one frame, however long the file. `docs/lsystem.md` is the specification.
"""

from __future__ import annotations

import difflib
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO

from pipeline.errors import InputFormatError, InputMissingError, OutputError, UsageError
from pipeline.lsystem.document import checked
from pipeline.lsystem.storage.compressed import LARGEST_BYTES, compress, decompress
from pipeline.lsystem.storage.index import Frame, Index, bytes_at, index_frame, read_index
from pipeline.lsystem.storage.packing import pack, unpack
from pipeline.output import whole_file

SUFFIX = ".lsjson.jsonl.zst"
FRAME_TREES = 100
FRAME_BYTES = 4 * 2**20
"""What a frame holds at most, one tree aside that is larger: this much is read to get at one tree."""

_MIN_MATCH = 6
"""Shorter repetitions of digits are chance; looking for them makes an archive larger by one percent."""


def split_member(name: str) -> tuple[str, str | None]:
    """Split `x.lsjson.jsonl.zst#oak` into the file and the tree; without a tree, or elsewhere, `None`.

    Examples
    --------
    >>> split_member("park.lsjson.jsonl.zst#oak#2")
    ('park.lsjson.jsonl.zst', 'oak#2')
    >>> split_member("tree#1.ls.json")
    ('tree#1.ls.json', None)
    """
    path, mark, member = name.partition(f"{SUFFIX}#")
    return (path + SUFFIX, member) if mark else (name, None)


class ArchiveWriter:
    """Write an archive tree by tree, whole or not at all, in the memory of one frame.

    Parameters
    ----------
    path : path-like
        Replaced when the last tree is written; left alone where something fails before.
    level : int
        Of the compression, 1 to 22.

    Examples
    --------
    ::

        with ArchiveWriter("park.lsjson.jsonl.zst") as archive:
            for name, tree in trees:
                archive.add(name, encode(tree))
    """

    def __init__(self, path: str | os.PathLike[str], *, level: int = 19) -> None:
        self.path, self._level = Path(path), level
        self._lines: list[bytes] = []
        self._bytes = 0
        self._frames: list[Frame] = []
        self._ids: dict[str, None] = {}
        self._stack = ExitStack()
        self._file: BinaryIO | None = None  # open inside `with`

    def __enter__(self) -> ArchiveWriter:
        with ExitStack() as stack:
            temporary = stack.enter_context(whole_file(self.path))
            self._file = stack.enter_context(temporary.open("wb"))
            self._stack = stack.pop_all()
        return self

    def __exit__(
        self, _kind: type[BaseException] | None, error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        with self._stack:
            if error is not None:
                raise error  # so that what is half written goes
            self._finish()
            self._file = None

    def add(self, id: str, document: Mapping[str, Any]) -> None:
        """Add a tree; its document comes back with `id` in it.

        Parameters
        ----------
        id : str
            Unlike those before.
        document : mapping
            An LsJSON.

        Raises
        ------
        UsageError
            If the id is empty, was there before, or the document says it is another tree; or
            outside ``with``.
        InputFormatError
            If the document is no LsJSON.
        OutputError
            If it cannot be written: disk full, or too long.
        """
        self._opened()
        self._check(id, document.get("id"))
        try:
            line = _line({**document, "id": id})
        except (TypeError, ValueError) as error:
            msg = f"{self.path}: tree {id!r} cannot be written ({error}); give what encode() returns"
            raise InputFormatError(msg) from error
        if len(line) > LARGEST_BYTES:
            msg = (
                f"{self.path}: tree {id!r} has {len(line):,} bytes, more than a reader takes "
                f"({LARGEST_BYTES:,}); simplify it"
            )
            raise OutputError(msg)
        full = len(self._lines) == FRAME_TREES or self._bytes + len(line) > FRAME_BYTES
        if full and self._lines:
            self._flush()
        self._ids[id] = None
        self._lines.append(line)
        self._bytes += len(line)

    def _opened(self) -> BinaryIO:
        if self._file is None:
            msg = f"{self.path}: is not open; add trees inside `with ArchiveWriter(...) as archive:`"
            raise UsageError(msg)
        return self._file

    def _check(self, id: str, own: object) -> None:
        if not id:
            msg = f"{self.path}: a tree has an empty id; name it"
            raise UsageError(msg)
        if id in self._ids:
            msg = f"{self.path}: tree {id!r} is there already; give every tree an id of its own"
            raise UsageError(msg)
        if own not in (None, id):
            msg = f"{self.path}: the document of tree {id!r} says that it is {own!r}; make them agree"
            raise UsageError(msg)

    def _flush(self) -> None:
        """Write the lines that wait as one frame."""
        frame = compress(b"".join(self._lines), self.path, level=self._level, min_match=_MIN_MATCH)
        self._frames.append(Frame(self._end, len(frame), len(self._lines)))
        self._write(frame)
        self._lines, self._bytes = [], 0

    def _finish(self) -> None:
        if self._lines:
            self._flush()
        index = Index(frames=tuple(self._frames), ids=tuple(self._ids))
        self._write(index_frame(index, self._end, self.path))

    @property
    def _end(self) -> int:
        return self._frames[-1].offset + self._frames[-1].size if self._frames else 0

    def _write(self, content: bytes) -> None:
        try:
            self._opened().write(content)
        except OSError as error:
            msg = f"{self.path}: cannot be written ({error.strerror}); free space or choose another folder"
            raise OutputError(msg) from error


class Archive:
    """Read an archive: any tree by its id, or all in order, in the memory of one frame.

    Iterating gives the documents; each says its `id`.

    Parameters
    ----------
    path : path-like

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If it is empty, cut off, no archive, or its index does not fit.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        if not self.path.is_file():
            msg = f"{self.path}: no such file; give the name of a {SUFFIX} file"
            raise InputMissingError(msg)
        try:
            self.index = read_index(self.path)
        except OSError as error:
            msg = f"{self.path}: cannot be read ({error.strerror}); check the disk and the file's permissions"
            raise InputFormatError(msg) from error

    @property
    def ids(self) -> tuple[str, ...]:
        """The ids of all trees, in the order in which they were added."""
        return self.index.ids

    def __len__(self) -> int:
        return len(self.index.ids)

    def __contains__(self, id: object) -> bool:
        return id in self._places

    def __iter__(self) -> Iterator[dict[str, Any]]:
        ids = iter(self.index.ids)
        for frame in self.index.frames:
            for line in self._frame_lines(frame):
                yield self._document(line, next(ids))

    def read(self, id: str) -> dict[str, Any]:
        """Read one tree.

        Raises
        ------
        InputMissingError
            If no tree has this id; the error names those that come near.
        InputFormatError
            If its frame or its line is corrupt.
        """
        if id not in self._places:
            near = difflib.get_close_matches(id, self.index.ids, 3)
            guess = f"near it are {', '.join(map(repr, near))}" if near else "no id comes near"
            msg = f"{self.path}: has no tree {id!r} among its {len(self):,} ({guess}); give one of its ids"
            raise InputMissingError(msg)
        frame, line = self._places[id]
        return self._document(self._frame_lines(frame)[line], id)

    @cached_property
    def _places(self) -> dict[str, tuple[Frame, int]]:
        places = ((frame, line) for frame in self.index.frames for line in range(frame.lines))
        return dict(zip(self.index.ids, places, strict=True))

    def _frame_lines(self, frame: Frame) -> list[bytes]:
        with self.path.open("rb") as file:
            lines = decompress(bytes_at(file, frame.offset, frame.size), self.path).splitlines()
        if len(lines) != frame.lines:
            msg = f"{self.path}: a frame has {len(lines)} lines, not {frame.lines}; write the archive again"
            raise InputFormatError(msg)
        return lines

    def _document(self, line: bytes, id: str) -> dict[str, Any]:
        try:
            document = unpack(json.loads(line))
            checked(document)
        except (ValueError, RecursionError) as error:  # JSON, UTF-8 and our own format errors are ValueErrors
            msg = f"{self.path}: tree {id!r} cannot be read ({error}); write the archive again"
            raise InputFormatError(msg) from error
        if document.get("id") != id:
            found = document.get("id")
            msg = f"{self.path}: tree {found!r} stands in the place of {id!r}; write the archive again"
            raise InputFormatError(msg)
        return document


def _line(document: Mapping[str, Any]) -> bytes:
    """Write a document as one line: the id first, the axiom last, so that the head shows what it is."""
    checked(document)
    packed = pack(document)
    keys = sorted(packed, key=lambda key: (key in ("axiom", "packed"), key != "id", key))
    ordered = {key: packed[key] for key in keys}
    text = json.dumps(ordered, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.encode("utf-8") + b"\n"
