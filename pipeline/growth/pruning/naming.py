"""An operation from its name and parameters, as files and the command line give them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipeline.choosing import chosen, named
from pipeline.errors import UsageError
from pipeline.growth.pruning.operation import Operation
from pipeline.growth.pruning.table import OPERATIONS


def operation_of(name: str, values: Mapping[str, Any]) -> Operation:
    """Return an operation.

    Parameters
    ----------
    name : str
        One of `OPERATIONS`.
    values : mapping
        Its parameters and selectors.

    Raises
    ------
    UsageError
        If the operation or a key is unknown, which names the nearest, or a value is out of range.

    Examples
    --------
    >>> operation_of("crown-raise", {"height_m": 2.5}).height_m
    2.5
    """
    operation = named(name, OPERATIONS, "operation")
    try:
        return chosen(operation, values)
    except UsageError as error:
        msg = f"{name}: {error}"
        raise UsageError(msg) from None
