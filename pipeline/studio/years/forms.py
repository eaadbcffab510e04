"""What the page asks for before an operation: its parameters, as fields, and back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, get_args, get_origin

from pydantic.fields import FieldInfo

from pipeline.choosing import named
from pipeline.errors import UsageError
from pipeline.growth.events import Programme, Timing, programme_of
from pipeline.growth.pruning import OPERATIONS, Operation, Selector
from pipeline.model import Floats
from pipeline.toml import allowed

PLACES_M = 3
"""Digits of a picked position, metres; adding 0.0 takes the sign off a zero."""
PLACED = ("position", "within_m")
SUGGESTED = {
    ("limit-length", "length_m"): "1.0",
    ("crown-raise", "height_m"): "1.5",
    ("reduce", "width_m"): "3.0",
    ("reduce", "height_m"): "4.0",
}
"""What stands at first in fields that have no default."""


def operations() -> list[dict[str, str]]:
    """Return the operations as a list to choose from."""
    return [{"value": name, "title": name, "about": kind.about} for name, kind in OPERATIONS.items()]


def fields_of(operation: str) -> list[dict[str, Any]]:
    """Return the fields of an operation: when, its own parameters, and which branches it is for.

    Each has ``name``, ``label``, ``group`` ("when", "what" or "which"), ``kind`` ("number", "choice", "flag"
    or "text"), ``choices``, ``sentence``, and ``must`` where it has no default.

    Raises
    ------
    UsageError
        If there is no such operation.
    """
    kind = named(operation, OPERATIONS, "operation")
    which = set(Selector.model_fields) if issubclass(kind, Selector) else set()
    when = [_field(name, field, "when") for name, field in Timing.model_fields.items()]
    what = [_field(name, field, "what") for name, field in kind.model_fields.items() if name not in which]
    chosen = [_field(name, field, "which") for name, field in kind.model_fields.items() if name in which]
    return [*when, *what, *chosen]


def values_of(programme: Programme) -> dict[str, Any]:
    """Return the values of the fields of an event, as the browser edits them."""
    held = {**programme.timing.model_dump(), **programme.operation.model_dump()}
    return {name: _text(value) for name, value in held.items()}


def first_values(operation: str, year: int, place: Floats | None) -> dict[str, Any]:
    """Return the values of an operation that nothing has been said of.

    Parameters
    ----------
    operation : str
    year : int
    place : (3,) array or None
        What has been picked, in the coordinates of the tree.
    """
    kind = named(operation, OPERATIONS, "operation")
    fields = {**Timing.model_fields, **kind.model_fields}
    values = {
        name: SUGGESTED.get((operation, name), "") if field.is_required() else _text(field.default)
        for name, field in fields.items()
    }
    return values | {name: value for name, value in looked_at(year, place).items() if name in fields}


def looked_at(year: int, place: Floats | None) -> dict[str, str]:
    """Return the values that an event has of what is looked at: the year, and the place that is picked."""
    rounded = () if place is None else tuple(round(float(value), PLACES_M) + 0.0 for value in place)
    return {"year": _text(year), "position": _text(rounded)}


def programme_from(operation: str, values: Mapping[str, Any]) -> Programme:
    """Make an event of what stands in the fields.

    Raises
    ------
    UsageError
        If a value is missing, unreadable or out of range.
    """
    kind: type[Operation] = named(operation, OPERATIONS, "operation")
    table: dict[str, Any] = {"operation": operation}
    for name, field in {**Timing.model_fields, **kind.model_fields}.items():
        value = _value(name, field, values.get(name))
        if value is not None:
            table[name] = value
    return programme_of(table)


def _field(name: str, field: FieldInfo, group: str) -> dict[str, Any]:
    choices = get_args(field.annotation) if get_origin(field.annotation) is Literal else ()
    is_point = "tuple" in str(field.annotation)
    kind = "choice" if choices else "flag" if field.annotation is bool else "text" if is_point else "number"
    said = "three numbers, x, y, z" if is_point else allowed(field)
    return {
        "name": name,
        "label": name.replace("_", " "),
        "group": group,
        "kind": kind,
        "choices": list(choices),
        "sentence": f"{field.description}; {said}",
        "must": field.is_required(),
        "placed": name in PLACED,
    }


def _text(value: Any) -> Any:
    """Return a value as a field shows it; nothing for None."""
    if value is None or isinstance(value, bool | str):
        return "" if value is None else value
    if isinstance(value, tuple):
        return ", ".join(map(str, value))
    return str(value)


def _value(name: str, field: FieldInfo, given: Any) -> Any:
    """Read what stands in a field; None where it is empty."""
    if given is None or isinstance(given, bool | int | float):
        return given
    text = str(given).strip()
    if not text:
        return None
    if get_origin(field.annotation) is Literal:
        return text
    parts = text.strip("()[] ").replace(";", ",").split(",")
    try:
        numbers = [_number(part) for part in parts]
    except ValueError:
        msg = f"{name}: {text!r} is no number; give {_field(name, field, '')['sentence']}"
        raise UsageError(msg) from None
    return numbers if "tuple" in str(field.annotation) else numbers[0] if len(numbers) == 1 else numbers


def _number(text: str) -> int | float:
    number = float(text)
    return int(number) if number.is_integer() and "." not in text and "e" not in text.lower() else number
