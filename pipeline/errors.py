"""What can go wrong, each with its exit code: the text says what, where and the remedy."""

from __future__ import annotations

from typing import ClassVar


class PipelineError(Exception):
    """Root of every error that treepipe raises on purpose.

    Attributes
    ----------
    exit_code : int
        What the command line returns: 1 when an input or an output failed, 2 for wrong usage.
    """

    exit_code: ClassVar[int] = 1


class InputMissingError(PipelineError, FileNotFoundError):
    """A file that was asked for is not there, or is a directory."""


class InputFormatError(PipelineError, ValueError):
    """A file is there but cannot be read as what it should be."""


class NotATreeError(PipelineError, ValueError):
    """The points were read, but no tree can be made of them."""


class ModelError(PipelineError, ValueError):
    """Arrays that do not make a rooted tree (cycle, two roots, wrong shape, not finite)."""


class OutputError(PipelineError, OSError):
    """A result could not be written; whatever was half written has been removed."""


class OutputExistsError(PipelineError, FileExistsError):
    """A result exists already and overwriting was not asked for."""

    exit_code: ClassVar[int] = 2


class UsageError(PipelineError, ValueError):
    """Wrong usage, found before any work: an unknown option, key, format or suffix."""

    exit_code: ClassVar[int] = 2


class MissingExtraError(PipelineError, ImportError):
    """An optional package is absent; the text names the extra that brings it."""
