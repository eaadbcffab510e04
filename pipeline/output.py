"""Writing files whole or not at all: a temporary name first, then one atomic replace."""

from __future__ import annotations

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pipeline.errors import OutputError, PipelineError

FORBIDDEN = (errno.EACCES, errno.EPERM, errno.EROFS)
NO_TEXT = "backslashreplace"
"""Bytes of a file's name that are no UTF-8 are written as escapes, which JSON reads back as they were."""


def legible(text: str) -> str:
    r"""Return a text in which what is no text, in the name of a file, is an escape.

    Examples
    --------
    >>> legible("oak\udce4"), legible("Jülich")
    ('oak\\udce4', 'Jülich')
    """
    return text.encode("utf-8", NO_TEXT).decode("utf-8")


@contextmanager
def whole_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path beside `path`; on success it replaces `path`, else it is removed.

    The temporary name keeps the suffixes of `path`, for libraries that choose a format by suffix.

    Parameters
    ----------
    path : path-like
        Where the file shall stand in the end. Its folder is made if need be.

    Raises
    ------
    OutputError
        If the folder or the file cannot be written (read-only, disk full, a directory). Errors that name
        a file elsewhere pass as they are.
    """
    target = Path(path)
    temporary: Path | None = None
    try:
        if target.is_dir():
            msg = f"{target}: is a directory; give the name of a file"
            raise OutputError(msg)
        target.parent.mkdir(parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(prefix=".tmp-", suffix=f"-{target.name}", dir=target.parent)
        os.close(handle)
        temporary = Path(name)
        yield temporary
        umask = os.umask(0)
        os.umask(umask)
        temporary.chmod(0o666 & ~umask)
        temporary.replace(target)
    except PipelineError:
        raise
    except OSError as error:
        if temporary is not None and _is_elsewhere(error, target):
            raise
        reason = error.strerror or str(error)
        remedy = "name a folder that you may write to"
        if error.errno not in FORBIDDEN:
            remedy = "free space, or write it to another folder"
        msg = f"{target}: cannot be written ({reason}); {remedy}"
        raise OutputError(msg) from error
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)


def _is_elsewhere(error: OSError, target: Path) -> bool:
    """Tell whether an error names a file of another folder, one that was read while writing, say."""
    return isinstance(error.filename, str) and Path(error.filename).parent != target.parent


def write_text(path: str | os.PathLike[str], text: str) -> None:
    """Write `text` as UTF-8 with plain line feeds, whole or not at all."""
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8", errors=NO_TEXT, newline="\n")


def write_bytes(path: str | os.PathLike[str], content: bytes) -> None:
    """Write `content`, whole or not at all."""
    with whole_file(path) as temporary:
        temporary.write_bytes(content)
