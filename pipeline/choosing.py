"""Options as people give them: what is wrong with a value, or which name was meant, said in one sentence."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from pipeline.errors import UsageError
from pipeline.toml import allowed

Chosen = TypeVar("Chosen", bound=BaseModel)
Held = TypeVar("Held")


def chosen(kind: type[Chosen], values: Mapping[str, Any], settings: Iterable[str] = ()) -> Chosen:
    """Make options of values, and of texts ``KEY=VALUE`` over them.

    Raises
    ------
    UsageError
        If a text is no setting, a key unknown (the nearest is named) or a value out of range.

    Examples
    --------
    >>> from pipeline.options import Options
    >>> class Press(Options):
    ...     weight_kg: int = 1
    >>> chosen(Press, {}, ["weight_kg=3"])
    Press(weight_kg=3)
    >>> chosen(Press, {"wait_kg": 3})
    Traceback (most recent call last):
    pipeline.errors.UsageError: unknown key wait_kg, do you mean weight_kg? known: weight_kg
    """
    try:
        return kind.model_validate(dict(values) | dict(map(setting, settings)))
    except ValidationError as error:
        raise UsageError(explained(error, kind)) from None


def named(name: str, known: Mapping[str, Held], what: str) -> Held:
    """Return what has a name.

    Raises
    ------
    UsageError
        If nothing has it, listing what there is.
    """
    if name in known:
        return known[name]
    msg = f"unknown {what} {name!r}{meant(name, known)} known: {', '.join(known) or 'none'}"
    raise UsageError(msg)


def setting(text: str) -> tuple[str, Any]:
    """Return key and value of ``KEY=VALUE``.

    Raises
    ------
    UsageError
        If it is none.
    """
    key, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not key:
        msg = f"--set {text}: is not KEY=VALUE; write for example --set seed=3"
        raise UsageError(msg)
    return key, value_of(value)


def value_of(text: str) -> Any:
    """Read a value as TOML does; what is no TOML value is a text.

    Examples
    --------
    >>> value_of("2.5"), value_of("true"), value_of("oak")
    (2.5, True, 'oak')
    """
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def meant(name: str, known: Iterable[str]) -> str:
    """Ask whether the nearest of the known names is meant; what is known may follow.

    Examples
    --------
    >>> meant("hight_m", ["height_m", "share"])
    ', do you mean height_m?'
    """
    near = difflib.get_close_matches(name, list(known), n=1)
    return f", do you mean {near[0]}?" if near else ";"


def explained(error: ValidationError, kind: type[BaseModel]) -> str:
    """Say in one sentence what is wrong with the first key, an unknown one before others, and what is right.

    Parameters
    ----------
    error : pydantic.ValidationError
    kind : type of Options
        What was to be made, without tables inside.
    """
    fields, errors = kind.model_fields, error.errors(include_url=False)
    first = next((one for one in errors if one["type"] == "extra_forbidden"), errors[0])
    why = first["msg"].removeprefix("Value error, ")
    if not first["loc"]:  # a rule of several keys says itself what is wrong
        return why
    key = str(first["loc"][0])
    if key not in fields:
        return f"unknown key {key}{meant(key, fields)} known: {', '.join(fields)}"
    field = fields[key]
    if first["type"] == "missing":
        return f"{key} is missing; give {allowed(field)}: {field.description}"
    own = f" ({why})" if first["type"] == "value_error" else ""
    return f"{key} = {first['input']!r} is not allowed{own}; give {allowed(field)}: {field.description}"
