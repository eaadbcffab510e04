"""Rules: an axiom becomes an L-string by replacing every symbol at once, a given number of times."""

from __future__ import annotations

from collections.abc import Mapping

from pipeline.errors import InputFormatError

LONGEST = 20_000_000
"""Characters an expansion may reach: a tree of nearly a million nodes."""


def expand(axiom: str, rules: Mapping[str, str], recursions: int) -> str:
    """Apply the rules to every character at once, `recursions` times.

    Parameters
    ----------
    axiom : str
    rules : mapping of str to str
        One character each, and what takes its place.
    recursions : int
        0 leaves the axiom as it is.

    Raises
    ------
    InputFormatError
        If the predecessor of a rule is not one character, or the text would outgrow `LONGEST`.

    Examples
    --------
    >>> expand("A", {"A": "AB", "B": "A"}, 5)
    'ABAABABAABAAB'
    """
    for predecessor in rules:
        if len(predecessor) != 1:
            msg = f"rule {predecessor!r} does not replace one character; give one character per rule"
            raise InputFormatError(msg)
    table = str.maketrans(dict(rules))
    text = axiom
    for done in range(recursions):
        length = len(text) + sum(text.count(a) * (len(b) - 1) for a, b in rules.items())
        if length > LONGEST:
            msg = (
                f"the rules grow the L-string past {LONGEST:,} characters after {done} recursions; "
                "lower 'recursions'"
            )
            raise InputFormatError(msg)
        if length == len(text) and text == text.translate(table):
            break
        text = text.translate(table)
    return text
