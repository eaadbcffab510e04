"""What the batch needs beyond the plain installation, named with its remedy."""

from __future__ import annotations

from importlib.util import find_spec

from pipeline.errors import MissingExtraError, UsageError

REMEDY = 'pip install "treepipe[batch]"'

NEEDED = ("distributed", "pyarrow", "pyogrio", "shapely")
"""Packages without which no cell can be done."""


class MissingBatchError(MissingExtraError, UsageError):
    """The packages of the batch are absent, found before any work."""

    exit_code = 2


def missing(names: str) -> MissingBatchError:
    """Return the error for packages that are not installed."""
    return MissingBatchError(f"treepipe batch needs {names}; install what is missing with: {REMEDY}")


def check_installed() -> None:
    """Make sure, before any work, that all packages of the batch are there.

    Raises
    ------
    MissingBatchError
        If one is not.
    """
    absent = [name for name in NEEDED if find_spec(name) is None]
    if absent:
        raise missing(" and ".join(absent))
