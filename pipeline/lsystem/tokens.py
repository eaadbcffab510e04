"""The letters of an L-string: text to symbols with values, and numbers to their shortest text."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError
from pipeline.model import Floats

FORWARD, RIGHT, LEFT = ord("F"), ord("+"), ord("-")
ROLL_RIGHT, ROLL_LEFT = ord(">"), ord("<")
WIDTH, OPEN, CLOSE = ord("!"), ord("["), ord("]")

TOKEN = re.compile(r"([A-Za-z+\-<>!]|[\[\]](?!\())(?:\(([^()]*)\))?")
# Without groups: Python's re loses its way where possessive repetition has some (a SystemError).
_TEXT = re.compile(r"(?:(?:[A-Za-z+\-<>!]|[\[\]](?!\())(?:\([^()]*\))?|\s)*+")


def tokenise(text: str) -> tuple[NDArray[np.uint8], Floats]:
    """Split an L-string into its symbols and their values.

    Letters other than ``F`` are symbols too: they move nothing, as the turtle of 2021 has it.

    Parameters
    ----------
    text : str
        An expanded L-string.

    Returns
    -------
    symbols : (T,) array of uint8
        The character code of every symbol.
    values : (T,) array of float64
        The value in parentheses behind it, NaN where there is none.

    Raises
    ------
    InputFormatError
        On a character that is no symbol or a value that is no finite number, with its position.
    """
    matched = _TEXT.match(text)
    end = matched.end() if matched else 0
    if end < len(text):
        msg = (
            f"{excerpt(text, end)} is not part of an L-string; "
            "it may hold F + - < > ! and letters, each with one value in parentheses, and [ ]"
        )
        raise InputFormatError(msg)
    found = TOKEN.findall(text)
    symbols = np.frombuffer("".join([symbol for symbol, _ in found]).encode("ascii"), dtype=np.uint8)
    written = [value for _, value in found]
    try:
        values = np.array([float(value) if value else np.nan for value in written])
    except ValueError:
        values = np.full(len(written), np.nan)
    if np.isnan(values).sum() != written.count("") or np.isinf(values).any():
        at = next(i for i, value in enumerate(written) if value and not _is_finite(value))
        msg = f"the value of {excerpt(text, position(text, at))} is not a finite number; mend it"
        raise InputFormatError(msg)
    return symbols, values


def position(text: str, token: int) -> int:
    """Return the character at which a token stands; for error texts."""
    return next(match.start() for i, match in enumerate(TOKEN.finditer(text)) if i == token)


def excerpt(text: str, at: int) -> str:
    """Return a place in an L-string for an error text: what stands there, and its position."""
    return f"{text[at : at + 12]!r} at character {at}"


def number(value: float) -> str:
    """Return the shortest text of a number that was rounded to at most four decimals."""
    return f"{value:.12g}"


def _is_finite(text: str) -> bool:
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False
