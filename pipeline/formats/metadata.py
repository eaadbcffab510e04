"""What is known of a tree as JSON and back: metadata of numpy values, and the trunk."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence, Set
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.errors import ModelError
from pipeline.model import Trunk


def to_json(value: Any) -> str:
    """Write a value as one line of compact ASCII JSON.

    Parameters
    ----------
    value : object
        Mappings, sequences, sets, numpy arrays and scalars, paths, text, numbers, None, nested
        however. Sets are sorted; what is not finite becomes null.

    Returns
    -------
    str

    Raises
    ------
    ModelError
        If there is anything else in it.
    """
    return json.dumps(_plain(value, "metadata"), separators=(",", ":"), allow_nan=False)


def from_json(text: str) -> Any:
    """Read what `to_json` writes; arrays come back as tuples, since metadata are never changed.

    Parameters
    ----------
    text : str

    Returns
    -------
    object

    Raises
    ------
    ValueError
        If the text is not JSON.
    """
    return _frozen(json.loads(text))


def trunk_to_plain(trunk: Trunk | None) -> dict[str, Any] | None:
    """Return the fields of a trunk, None for none."""
    return None if trunk is None else asdict(trunk)


def trunk_from_plain(fields: Mapping[str, Any] | None) -> Trunk | None:
    """Return the trunk of `trunk_to_plain`.

    Raises
    ------
    TypeError
        If a field is missing or unknown.
    """
    return None if fields is None else Trunk(**fields)


def _plain(value: Any, name: str) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _plain(inner, f"{name}.{key}") for key, inner in value.items()}
    if isinstance(value, Set):
        return sorted(_plain(inner, name) for inner in value)
    if isinstance(value, Sequence) and not isinstance(value, str | bytes):
        return [_plain(inner, name) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Path):
        return str(value)
    if value is None or isinstance(value, str | int | float):
        return value
    msg = f"{name} is of type {type(value).__name__}, which no file can hold; make it text or a number"
    raise ModelError(msg)


def _frozen(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _frozen(inner) for key, inner in value.items()}
    return tuple(_frozen(inner) for inner in value) if isinstance(value, list) else value
