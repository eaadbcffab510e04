"""Packages of the extra `batch`, loaded where they are used, or named with their remedy."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from pipeline.batch.extra import missing


def package(name: str) -> Any:
    """Return an optional package.

    Raises
    ------
    MissingExtraError
        If it is not installed.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise missing(name.partition(".")[0]) from error
