"""The LsJSON file: its keys, their checks, reading and writing.

A document is a plain dict, as `json` gives it. `docs/lsystem.md` says what each key means.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from pipeline.errors import InputFormatError, InputMissingError
from pipeline.lsystem.storage.compressed import read_compressed, write_compressed
from pipeline.model import RadiusSource
from pipeline.output import write_text

FORMAT: Literal["lsjson"] = "lsjson"
VERSION = 1
RULE: Literal["pipe"] = "pipe"
EXPONENT = 0.5
"""Shares the cross-section by length; also for files of 2021, which state no rule."""

_ORDER = (
    *("format", "id", "crs", "growth", "degrees", "dimensions", "trunk", "radius", "recursions", "rules"),
    "axiom",
)

GROWN = "grown"
"""Flag of a tree that holds more than was measured; its document tells how it grew, under ``growth``."""

COMPRESSED = ".zst"
"""Suffix of files that hold the same text in a Zstandard frame."""


def _in_space(point: object) -> object:
    """Put a point of a plane at height 0."""
    return [*point, 0.0] if isinstance(point, list) and len(point) == 2 else point


Point = Annotated[list[float], Field(min_length=3, max_length=3), BeforeValidator(_in_space)]
Length = Annotated[float, Field(ge=0)]


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, frozen=True, allow_inf_nan=False)


class Format(_Part):
    """What wrote the file's keys; absent in files of 2021."""

    name: Literal["lsjson"]
    version: Annotated[int, Field(ge=1, le=VERSION)]


class Dimensions(_Part):
    """What a symbol without a value stands for; the defaults are those of 2021."""

    forward: float = 3.0
    rotation: float = 22.5
    roll: float = 20.0


class BreastHeight(_Part):
    """The diameter at breast height in metres, as `pipeline.model.Trunk`; `ground` is a height of the CRS."""

    diameter: Length | None
    low: Length | None
    high: Length | None
    arc: float
    source: RadiusSource | None
    ground: float


class Foot(_Part):
    """Where the tree stands, in its CRS, and its radius there in metres."""

    anchor: Point
    radius: Length
    breast_height: BreastHeight | None = None


class RadiusRule(_Part):
    """How radii that are not written follow from the structure."""

    rule: Literal["pipe"] = RULE
    exponent: Length = EXPONENT
    source: str | None = None


class Document(_Part):
    """A checked LsJSON; keys that we do not know are passed over."""

    axiom: str
    trunk: Foot
    rules: dict[str, str] = Field(default_factory=dict)
    recursions: Annotated[int, Field(ge=0)] = 0
    dimensions: Dimensions = Dimensions()
    degrees: bool = True
    format: Format | None = None
    id: str | None = None
    crs: str | None = None
    growth: dict[str, Any] | None = None
    radius: RadiusRule = RadiusRule()

    @property
    def applications(self) -> int:
        """How often the rules apply: files of 2021 say 0 where they mean once."""
        return 1 if self.format is None and self.rules and not self.recursions else self.recursions


def checked(document: object) -> Document:
    """Check the keys of a document, ours or of 2021, so that all else may trust them.

    Raises
    ------
    InputFormatError
        Naming the key and what is wrong with it.
    """
    try:
        return Document.model_validate(document)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        key = ".".join(map(str, first["loc"])) or "the document"
        remedy = "mend it as docs/lsystem.md says"
        if key == "format.version":
            remedy = f"this treepipe reads version {VERSION}, a newer one may read it"
        said = f"{first['msg'][0].lower()}{first['msg'][1:]}"
        if first["type"] in ("model_type", "dict_type"):
            said = "should be a JSON object {...} of keys"
        msg = f"not an LsJSON: {key}: {said}; {remedy}"
        raise InputFormatError(msg) from None


def write_lsjson(document: Mapping[str, Any], path: str | os.PathLike[str]) -> None:
    """Write a document, whole or not at all: one key a line in a fixed order, the axiom last.

    A name that ends in ``.zst`` gets the same text compressed.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    known = [key for key in _ORDER if key in document]
    keys = known + sorted(set(document) - set(known))
    lines = [f"{_json(key)}: {_json(document[key])}" for key in keys]
    text = "{\n" + ",\n".join(lines) + "\n}\n"
    if Path(path).suffix == COMPRESSED:
        write_compressed(path, text)
    else:
        write_text(path, text)


def read_lsjson(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Read a document and check its keys; ours and the files of 2021 alike, compressed or not.

    An anchor of two coordinates stays so; `is_flat` tells.

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If the file is not JSON in UTF-8, or a key is missing or wrong.
    """
    source = Path(path)
    if not source.is_file():
        msg = f"{source}: no such file; give the name of an .ls.json file"
        raise InputMissingError(msg)
    try:
        packed = source.suffix == COMPRESSED
        text = read_compressed(source) if packed else source.read_text(encoding="utf-8-sig")
        document: dict[str, Any] = json.loads(text)
        checked(document)
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, RecursionError) as error:
        msg = f"{source}: cannot be read as JSON in UTF-8 ({error}); give an .ls.json file"
        raise InputFormatError(msg) from error
    except InputFormatError as error:
        msg = str(error) if str(error).startswith(f"{source}: ") else f"{source}: {error}"
        raise InputFormatError(msg) from error
    return document


def is_flat(document: Mapping[str, Any]) -> bool:
    """Whether the anchor of a document has no height, which then counts as 0."""
    return len(document["trunk"]["anchor"]) == 2


def _json(value: object) -> str:
    return json.dumps(value, ensure_ascii=False, allow_nan=False)
