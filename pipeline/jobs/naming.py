"""Errors of stages, which know no files, with the name of the file that they are about."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pipeline.errors import PipelineError


@contextmanager
def named(path: Path) -> Iterator[None]:
    """Put `path` in front of the text of a `PipelineError` that names no file."""
    try:
        yield
    except PipelineError as error:
        text = str(error)
        if str(path) in text:
            raise
        msg = f"{path}: {text}"
        raise type(error)(msg) from error
