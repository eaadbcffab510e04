"""What a LAS file cannot say of a cloud, as JSON: its metadata and which attributes it has."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.model import PointCloud


@dataclass(frozen=True)
class Notes:
    """The metadata of a cloud, the names of its attributes, and which of these are true or false."""

    metadata: Mapping[str, Any]
    attributes: tuple[str, ...]
    truths: tuple[str, ...]


def notes_to_json(cloud: PointCloud) -> bytes:
    """Return the notes on a cloud, the same bytes for the same cloud."""
    held = cloud.attributes
    document = {
        "points": len(cloud),
        "attributes": list(held),
        "truths": [name for name, values in held.items() if values.dtype == bool],
        "metadata": plain(cloud.metadata),
    }
    return json.dumps(document, separators=(",", ":")).encode()


def notes_from_json(text: bytes, points: int) -> Notes | None:
    """Return the notes, or None where there are none or the file has changed to `points` since.

    Lists come back as tuples: metadata are values that nobody changes.
    """
    if not text:
        return None
    document = json.loads(text)
    if document["points"] != points:
        return None
    metadata, *names = (frozen(document[key]) for key in ("metadata", "attributes", "truths"))
    return Notes(metadata, *names)


def plain(value: Any) -> Any:
    """Return `value` with NumPy's types, tuples, sets and mappings replaced by JSON's own."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, set | frozenset):
        return [plain(item) for item in sorted(value)]
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value if isinstance(value, str | int | float | None) else str(value)


def frozen(value: Any) -> Any:
    """Return `value` with every list in it as a tuple."""
    if isinstance(value, dict):
        return {key: frozen(item) for key, item in value.items()}
    return tuple(frozen(item) for item in value) if isinstance(value, list) else value
