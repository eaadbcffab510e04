"""A line of an archive without its repetitions: the axiom taken apart into columns, and joined again.

Text spends most of its bytes on what is always the same: ``+(12.3)>(4.5)F(0.067)``. Packed, the nesting
is one string and every kind of value another, written as digits of base 64: all first digits, then all
second ones. Compressed, a fifth is saved. Nothing is lost: an axiom that would not come back character by
character is left as it is. `docs/lsystem.md` is the specification.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from pipeline.errors import InputFormatError
from pipeline.lsystem.tokens import number
from pipeline.model import Floats

Integers = NDArray[np.int64]

_ALPHABET = np.frombuffer(b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/", dtype=np.uint8)
_DIGITS = np.full(256, -1, dtype=np.int64)
_DIGITS[_ALPHABET] = np.arange(64)

_FINER_FROM_M = (0.0229, 0.229, 2.29, 22.9)
"""Lengths from which an angle has one, two, three, four decimals: where our writer needs them, or a
little below. Part of the format."""

_VALUE = r"\(([0-9]{1,6}(?:\.[0-9]{1,6})?)\)"
_NODE = re.compile(rf"([\[\]]*+)(?:([+-]){_VALUE})?(?:([<>]){_VALUE})?(?:!{_VALUE})?F{_VALUE}")

Places = Annotated[int, Field(ge=0, le=6)]
Planes = Annotated[list[str], Field(max_length=8)]


class _Part(BaseModel):
    model_config = ConfigDict(strict=True, frozen=True)


class Decimals(_Part):
    """What the integers count: units of 10^-decimals; of an angle the least number."""

    length: Places
    angle: Places
    radius: Places


class Packed(_Part):
    """An axiom in columns."""

    nodes: str
    decimals: Decimals
    length: Planes
    rotation: Planes
    roll: Planes
    radius: Planes


def pack(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a document with `packed` in place of its axiom, or unchanged if that would alter it.

    Parameters
    ----------
    document : mapping
        An LsJSON. What `encode` writes can be packed; files of 2021 and axioms with rules cannot.
    """
    axiom = document.get("axiom")
    columns = _columns(axiom) if isinstance(axiom, str) and "packed" not in document else None
    if columns is None or _axiom(columns) != axiom:
        return dict(document)
    others = {key: value for key, value in document.items() if key != "axiom"}
    return {**others, "packed": columns.model_dump()}


def unpack(document: Mapping[str, Any]) -> dict[str, Any]:
    """Return the document that `pack` was given; one that is not packed comes back as it is.

    Raises
    ------
    InputFormatError
        If the columns do not fit together, with what is wrong.
    """
    if "axiom" in document or "packed" not in document:
        return dict(document)
    others = {key: value for key, value in document.items() if key != "packed"}
    try:
        return {**others, "axiom": _axiom(Packed.model_validate(document["packed"]))}
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        key = ".".join(map(str, ("packed", *first["loc"])))
        msg = f"{key}: {first['msg'][0].lower()}{first['msg'][1:]}; write it again"
        raise InputFormatError(msg) from None


def _columns(axiom: str) -> Packed | None:
    """Take an axiom apart; what cannot be told in columns is left out, or the answer is `None`."""
    found, tail = _NODE.findall(axiom), axiom[axiom.rfind(")") + 1 :]
    if not found or tail.strip("[]"):
        return None
    brackets, turned, rotation, rolled, roll, radius, length = zip(*found, strict=True)
    written = [text for text in radius if text]
    length_places, radius_places = int(_places(length).max()), int(_places(written).max(initial=0))
    lengths = _integers(length, length_places)
    by_length = _angle_places(lengths / 10**length_places)
    angles = np.maximum(_places(rotation), _places(roll))
    least = int(angles[angles > by_length].max(initial=0))
    places = np.maximum(by_length, least)
    nodes = "".join([b + ("!" if r else "F") for b, r in zip(brackets, radius, strict=True)])
    return Packed(
        nodes=nodes + tail,
        decimals=Decimals(length=length_places, angle=least, radius=radius_places),
        length=_planes(lengths),
        rotation=_planes(_folded(_integers(rotation, places), np.array(turned) == "-")),
        roll=_planes(_folded(_integers(roll, places), np.array(rolled) == "<")),
        radius=_planes(_integers(written, radius_places)),
    )


def _axiom(packed: Packed) -> str:
    """Join the columns again."""
    kinds = packed.nodes.replace("[", "").replace("]", "")
    if kinds.strip("F!"):
        msg = f"packed.nodes: {kinds.strip('F!')[0]!r} is none of F ! [ ]; write it again"
        raise InputFormatError(msg)
    lengths = _values(packed.length, len(kinds), "length") / 10**packed.decimals.length
    scale = 10 ** np.maximum(_angle_places(lengths), packed.decimals.angle)
    rotations = (_unfolded(_values(packed.rotation, len(kinds), "rotation")) / scale).tolist()
    rolls = (_unfolded(_values(packed.roll, len(kinds), "roll")) / scale).tolist()
    radii = _values(packed.radius, kinds.count("!"), "radius") / 10**packed.decimals.radius
    widths = iter(radii.tolist())
    nodes = [
        _turn(rotation, "+-")
        + _turn(roll, "><")
        + (f"!({number(next(widths))})" if kind == "!" else "")
        + f"F({number(length)})"
        for kind, rotation, roll, length in zip(kinds, rotations, rolls, lengths.tolist(), strict=True)
    ]
    told = iter(nodes)
    return "".join([character if character in "[]" else next(told) for character in packed.nodes])


def _turn(angle: float, signs: str) -> str:
    return f"{signs[angle < 0]}({number(abs(angle))})" if angle else ""


def _places(texts: Sequence[str]) -> Integers:
    """Return how many decimals each number is written with."""
    return np.array([len(text.partition(".")[2]) for text in texts], dtype=np.int64)


def _integers(texts: Sequence[str], places: int | Integers) -> Integers:
    """Return numbers in units of 10^-places; 0 for an empty text."""
    numbers = np.array([float(text or 0) for text in texts])
    return np.rint(numbers * 10.0**places).astype(np.int64)


def _angle_places(lengths: Floats) -> Integers:
    return np.searchsorted(_FINER_FROM_M, lengths, side="right")


def _folded(sizes: Integers, negative: NDArray[np.bool_]) -> Integers:
    """Fold signs in: 0, -1, 1, -2, 2 become 0, 1, 2, 3, 4."""
    return np.where(negative & (sizes > 0), 2 * sizes - 1, 2 * sizes)


def _unfolded(folded: Integers) -> Integers:
    return np.where(folded % 2 == 1, -(folded + 1) // 2, folded // 2)


def _planes(values: Integers) -> list[str]:
    """Write numbers in base 64: one string of all first digits, and so on; no string if all are 0."""
    planes: list[str] = []
    while values.any():
        planes.insert(0, _ALPHABET[values % 64].tobytes().decode("ascii"))
        values = values // 64
    return planes


def _values(planes: Sequence[str], count: int, key: str) -> Integers:
    """Read what `_planes` wrote."""
    values = np.zeros(count, dtype=np.int64)
    for plane in planes:
        digits = _DIGITS[np.frombuffer(plane.encode("utf-8"), dtype=np.uint8)]
        if len(digits) != count or (digits < 0).any():
            msg = f"packed.{key}: {len(plane)} digits, not {count} of A-Z a-z 0-9 + /; write it again"
            raise InputFormatError(msg)
        values = values * 64 + digits
    return values
