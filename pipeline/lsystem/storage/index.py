"""Where each tree of an archive is: the last frame of the file, which Zstandard tools skip.

| bytes | what |
|---|---|
| 4 | ``0x184D2A5E``, little endian: a frame to be skipped |
| 4 | size of all that follows, little endian |
| .. | the index, JSON compressed |
| 8 | offset of this frame in the file, little endian |
| 4 | ``LSJA`` |

The last 12 bytes of the file lead to the index, and the index to every tree.
"""

from __future__ import annotations

from itertools import accumulate
from pathlib import Path
from typing import Annotated, BinaryIO, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from pipeline.errors import InputFormatError
from pipeline.lsystem.storage.compressed import LARGEST_BYTES, compress, decompress

SKIPPABLE = (0x184D2A5E).to_bytes(4, "little")
SIGNATURE = b"LSJA"
_HEAD, _FOOT = 8, 12

Count = Annotated[int, Field(ge=1)]
Size = Annotated[int, Field(ge=1, le=LARGEST_BYTES)]


class Frame(NamedTuple):
    """Where a frame stands in the file, in bytes, and how many lines it holds."""

    offset: int
    size: Size
    lines: Count


class Index(BaseModel):
    """The frames in the order of the file, the ids in the order of the lines."""

    model_config = ConfigDict(frozen=True)

    version: Literal[1] = 1
    frames: tuple[Frame, ...] = ()
    ids: tuple[str, ...] = ()


def index_frame(index: Index, offset: int, path: Path) -> bytes:
    """Return the frame that stands at `offset`, behind all others."""
    content = compress(index.model_dump_json().encode("utf-8"), path)
    body = content + offset.to_bytes(8, "little") + SIGNATURE
    return SKIPPABLE + len(body).to_bytes(4, "little") + body


def read_index(path: Path) -> Index:
    """Read the index from the tail of an archive, and nothing else of it.

    Raises
    ------
    InputFormatError
        If there is none, or it does not fit the file.
    OSError
        If the file cannot be read.
    """
    size = path.stat().st_size
    with path.open("rb") as file:
        foot = bytes_at(file, max(size - _FOOT, 0), _FOOT)
        start = int.from_bytes(foot[:8], "little")
        if size < _HEAD + _FOOT or foot[8:] != SIGNATURE or start > size - _HEAD - _FOOT:
            what = "it was cut off or is no archive of trees" if size else "the file is empty"
            msg = f"{path}: has no index at its end ({what}); write or copy it again"
            raise InputFormatError(msg)
        length = size - start - _HEAD
        head = SKIPPABLE + length.to_bytes(8, "little")[:4]
        if length > LARGEST_BYTES or bytes_at(file, start, _HEAD) != head:
            msg = f"{path}: its last 12 bytes point where no index is; write or copy it again"
            raise InputFormatError(msg)
        content = bytes_at(file, start + _HEAD, length - _FOOT)
    return _checked(decompress(content, path), start, path)


def bytes_at(file: BinaryIO, offset: int, size: int) -> bytes:
    """Read a part of a file."""
    file.seek(offset)
    return file.read(size)


def _checked(content: bytes, start: int, path: Path) -> Index:
    """Check that the frames fill the file up to the index and hold a line for every id."""
    try:
        index = Index.model_validate_json(content)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        key = ".".join(map(str, first["loc"])) or "its beginning"
        msg = f"{path}: the index is wrong at {key}: {first['msg']}; write the archive again"
        raise InputFormatError(msg) from None
    ends = list(accumulate((frame.size for frame in index.frames), initial=0))
    lines = sum(frame.lines for frame in index.frames)
    if [*(frame.offset for frame in index.frames), start] != ends or lines != len(index.ids):
        msg = f"{path}: the index does not fit the file; write or copy it again"
        raise InputFormatError(msg)
    if len(set(index.ids)) != lines:
        msg = f"{path}: two trees have one id in the index; write the archive again"
        raise InputFormatError(msg)
    return index
