"""Options as TOML in which every key is explained: description, unit and range from the fields."""

from __future__ import annotations

import json
from types import NoneType, UnionType
from typing import Any, Literal, Union, get_args, get_origin

import annotated_types
from pydantic.fields import FieldInfo

from pipeline.options import Options


def to_toml(options: Options, prefix: str = "") -> str:
    """Write options as TOML, every key commented.

    Parameters
    ----------
    options : Options
        Values are numbers, texts, flags, lists of these, or None (written as a comment), and tables.
    prefix : str
        Dotted name of the table, for the tables inside.

    Examples
    --------
    >>> from pydantic import Field
    >>> class Press(Options):
    ...     voxel_m: float = Field(0.01, gt=0, le=1, description="edge of a voxel, metres")
    >>> print(to_toml(Press()), end="")
    # edge of a voxel, metres; a number > 0 and <= 1
    voxel_m = 0.01
    """
    lines, tables = [], []
    for name, field in type(options).model_fields.items():
        value = getattr(options, name)
        if isinstance(value, Options):
            title = f"\n# {field.description}\n" if field.description else "\n"
            tables.append(f"{title}[{prefix}{name}]\n{to_toml(value, f'{prefix}{name}.')}")
            continue
        lines.append(f"# {field.description or name}; {allowed(field)}\n")
        lines.append(f"# {name} =\n" if value is None else f"{name} = {_literal(value)}\n")
    return "".join(lines + tables)


def allowed(field: FieldInfo) -> str:
    """Say which values a field takes, in words."""
    kinds = _kinds(field.annotation)
    bounds = [words for part in field.metadata if (words := _bound(part))]
    return " and ".join([" or ".join(kinds), *bounds]).replace("number and ", "number ", 1)


def _kinds(annotation: Any) -> list[str]:
    """Name the kinds of values that a type allows."""
    origin = get_origin(annotation)
    if origin is Literal:
        return ["one of " + ", ".join(json.dumps(choice) for choice in get_args(annotation))]
    if origin in {Union, UnionType}:
        return [kind for part in get_args(annotation) for kind in _kinds(part)]
    if origin in {tuple, list}:
        kind = _kinds(get_args(annotation)[0])[0]
        return [f"a list of {kind[2:]}s" if kind.startswith("a ") else f"a list of {kind}"]
    names = {
        bool: "true or false",
        int: "a whole number",
        float: "a number",
        str: "a text",
        NoneType: "nothing",
    }
    return [names.get(annotation, "a value")]


def _bound(part: Any) -> str:
    signs = {"ge": ">=", "gt": ">", "le": "<=", "lt": "<"}
    if isinstance(part, annotated_types.Ge | annotated_types.Gt | annotated_types.Le | annotated_types.Lt):
        name = type(part).__name__.lower()
        return f"{signs[name]} {getattr(part, name)}"
    return ""


def _literal(value: Any) -> str:
    """Write one value as TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    return "[" + ", ".join(_literal(part) for part in value) + "]"
