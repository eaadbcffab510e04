"""Bytes to Zstandard frames and back, bounded: what would not fit into memory is refused beforehand."""

from __future__ import annotations

import io
import os
from pathlib import Path

import zstandard

from pipeline.errors import InputFormatError, InputMissingError, OutputError
from pipeline.output import NO_TEXT, write_bytes

LEVEL = 19
LARGEST_BYTES = 64 * 2**20
"""What a file or a frame may hold, before and after compression: a tree of two million nodes."""
_CHUNK = 2**17


def write_compressed(path: str | os.PathLike[str], text: str, *, level: int = LEVEL) -> None:
    """Write a text as one frame, whole or not at all; ``zstdcat`` shows it again.

    Parameters
    ----------
    path : path-like
    text : str
    level : int
        1 is quick, 19 is small, 22 takes the most memory.

    Raises
    ------
    OutputError
        If the file cannot be written, or the text is longer than a reader would take.
    """
    write_bytes(path, compress(text.encode("utf-8", NO_TEXT), Path(path), level=level))


def read_compressed(path: str | os.PathLike[str]) -> str:
    """Read a text of one or more frames; a byte order mark is passed over.

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If a frame is cut off or corrupt, the text is not UTF-8, or it would be too long.
    """
    source = Path(path)
    if not source.is_file():
        msg = f"{source}: no such file; give the name of an .ls.json.zst file"
        raise InputMissingError(msg)
    try:
        with source.open("rb") as file:
            packed = file.read(min(source.stat().st_size, LARGEST_BYTES + 1))
        return decompress(packed, source).decode("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        msg = f"{source}: cannot be read as compressed text in UTF-8 ({error}); give an .ls.json.zst file"
        raise InputFormatError(msg) from error


def compress(content: bytes, path: Path, *, level: int = LEVEL, min_match: int = 0) -> bytes:
    """Compress bytes to one frame with its size and a checksum.

    Parameters
    ----------
    content : bytes
    path : Path
        Where they go, for error texts.
    level : int
    min_match : int
        Shortest repetition to look for, 3 to 7; 0 leaves it to the level.

    Raises
    ------
    OutputError
        If the content is longer than `decompress` would give back.
    """
    if len(content) > LARGEST_BYTES:
        msg = (
            f"{path}: {len(content):,} bytes are more than a reader takes at once ({LARGEST_BYTES:,}); "
            "write .ls.json"
        )
        raise OutputError(msg)
    settings = {"min_match": min_match} if min_match else {}
    parameters = zstandard.ZstdCompressionParameters.from_level(
        level, source_size=len(content), write_checksum=True, **settings
    )
    return zstandard.ZstdCompressor(compression_params=parameters).compress(content)


def decompress(packed: bytes, path: Path, *, limit: int = LARGEST_BYTES) -> bytes:
    """Give back the content of all frames; those that may be skipped hold none.

    The content is counted before it is kept, so that a few bytes which stand for gigabytes cost no
    memory.

    Parameters
    ----------
    packed : bytes
    path : Path
        Where they come from, for error texts.
    limit : int
        Most bytes, before and after.

    Raises
    ------
    InputFormatError
        If there is too much of it, or a frame is cut off or corrupt.
    """
    try:
        if len(packed) > limit or _is_longer(packed, limit):
            msg = (
                f"{path}: holds more than {limit:,} bytes, the most that is read at once; "
                "unpack it by zstd if you trust it"
            )
            raise InputFormatError(msg)
        return _content(packed, path)
    except zstandard.ZstdError as error:
        msg = f"{path}: is no sound Zstandard file ({error}); copy or write it again"
        raise InputFormatError(msg) from error


def _is_longer(packed: bytes, limit: int) -> bool:
    """Count the content without keeping it."""
    count = 0
    with zstandard.ZstdDecompressor().stream_reader(io.BytesIO(packed), read_across_frames=True) as reader:
        while count <= limit and (chunk := reader.read(_CHUNK)):
            count += len(chunk)
    return count > limit


def _content(packed: bytes, path: Path) -> bytes:
    pieces, whole = [], False
    while packed:
        frame = zstandard.ZstdDecompressor().decompressobj()
        pieces.append(frame.decompress(packed))
        packed, whole = frame.unused_data, frame.eof
    if not whole:
        msg = f"{path}: is cut off; copy or write it again"
        raise InputFormatError(msg)
    return b"".join(pieces)
