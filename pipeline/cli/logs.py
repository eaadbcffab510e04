"""What a command says while it works: on stderr, and in a log file where one is asked for."""

from __future__ import annotations

import logging
import sys
from pathlib import Path

import click

from pipeline.errors import OutputError
from pipeline.output import NO_TEXT

LOGGER = logging.getLogger("treepipe")


class _Console(logging.Handler):
    """Writes to the stderr of this moment, which a progress bar or a test may have changed."""

    def emit(self, record: logging.LogRecord) -> None:
        clear = "\r\x1b[K" if sys.stderr.isatty() else ""  # a progress bar may stand on this line
        click.echo(f"{clear}treepipe: {record.getMessage()}", err=True)


class _File(logging.FileHandler):
    """Appends to a file."""


def say(text: str) -> None:
    """Tell an error: to the log too, once a command has started one."""
    if _ours():
        LOGGER.error("%s", text)
    else:
        click.echo(f"treepipe: {text}", err=True)


def stop_logging() -> None:
    """Close the log."""
    for handler in _ours():
        LOGGER.removeHandler(handler)
        handler.close()


def _ours() -> list[logging.Handler]:
    return [handler for handler in LOGGER.handlers if isinstance(handler, _Console | _File)]


def start_logging(level: int, file: Path | None) -> None:
    """Send messages from `level` on to stderr, and all of them to `file`.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    stop_logging()
    LOGGER.addHandler(_Console(level))
    LOGGER.setLevel(logging.INFO)
    LOGGER.propagate = False
    if file is None:
        return
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        handler = _File(file, encoding="utf-8", errors=NO_TEXT)
    except OSError as error:
        msg = f"{file}: no log can be written there ({error.strerror}); choose another file with --log"
        raise OutputError(msg) from error
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(message)s"))
    LOGGER.addHandler(handler)
