"""An operation from its name and parameters, as files and the command line give them."""

from __future__ import annotations

from collections.abc import Mapping
from numbers import Real
from typing import Any

from pipeline.choosing import chosen, named
from pipeline.errors import UsageError
from pipeline.growth.pruning.operation import Operation
from pipeline.growth.pruning.table import OPERATIONS

POINTS_LIKE = {"position": "1.5,0.2,3", "direction": "0,0,-1"}
"""Keys of three numbers, and how they may look."""


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
        _check_points(operation, values)
        return chosen(operation, values)
    except UsageError as error:
        msg = f"{name}: {error}"
        raise UsageError(msg) from None


def _check_points(operation: type[Operation], values: Mapping[str, Any]) -> None:
    """Make sure that places and ways have three numbers."""
    for key in POINTS_LIKE.keys() & values.keys() & operation.model_fields.keys():
        value, what = values[key], operation.model_fields[key].description
        if value is None:
            continue
        parts = value if isinstance(value, list | tuple) else ()
        if len(parts) != 3 or not all(
            isinstance(part, Real) and not isinstance(part, bool) for part in parts
        ):
            shown = ",".join(map(str, parts)) if parts else str(value)
            like = POINTS_LIKE[key]
            msg = f"{key} = {shown} is not allowed; give three numbers x,y,z, for example {like}: {what}"
            raise UsageError(msg)
        if key == "direction" and not any(parts):
            msg = "a direction of no length leads nowhere; give for example 0,0,1 for upright"
            raise UsageError(msg)
