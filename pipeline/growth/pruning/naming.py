"""An operation from its name and parameters, as files and the command line give them."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import Any

from pydantic import ValidationError

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
    if name not in OPERATIONS:
        msg = f"unknown operation {name!r}{meant(name, OPERATIONS)} known: {', '.join(OPERATIONS)}"
        raise UsageError(msg)
    try:
        return OPERATIONS[name].model_validate(dict(values))
    except ValidationError as error:
        msg = f"{name}: {_explained(error, OPERATIONS[name])}"
        raise UsageError(msg) from None


def meant(name: str, known: Iterable[str]) -> str:
    """Ask whether the nearest of the known names is meant.

    Examples
    --------
    >>> meant("hight_m", ["height_m", "share"])
    ', do you mean height_m?'
    """
    near = difflib.get_close_matches(name, list(known), n=1)
    return f", do you mean {near[0]}?" if near else ";"


def _explained(error: ValidationError, operation: type[Operation]) -> str:
    """Say in one sentence what is wrong with the first key; an unknown one comes first."""
    errors, fields = error.errors(include_url=False), operation.model_fields
    first = next((one for one in errors if one["type"] == "extra_forbidden"), errors[0])
    key = str(first["loc"][0]) if first["loc"] else ""
    why = first["msg"].removeprefix("Value error, ")
    if not key:
        return why
    if key not in fields:
        return f"unknown key {key}{meant(key, fields)} known: {', '.join(fields)}"
    if first["type"] == "missing":
        return f"{key} is missing; give it: {fields[key].description}"
    why = why.replace("Input", "it", 1)
    return f"{key} = {first['input']!r} is not possible: {why}; {key} is the {fields[key].description}"
