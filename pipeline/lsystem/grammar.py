"""Rules: an axiom becomes an L-string by replacing every symbol at once, a given number of times."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

from pipeline.errors import InputFormatError

LONGEST = 20_000_000
"""Characters an expansion may reach: a tree of nearly a million nodes."""
MOST_RECURSIONS = 1_000
"""Recursions that are followed; beyond them the rules must have come to rest."""
COUNTLESS = 10**15
"""Characters beyond which counting stops."""


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
        If the predecessor of a rule is not one character, or the text would outgrow `LONGEST`:
        said with the length it would reach, before memory is used.

    Examples
    --------
    >>> expand("A", {"A": "AB", "B": "A"}, 5)
    'ABAABABAABAAB'
    """
    for predecessor in rules:
        if len(predecessor) != 1:
            msg = f"rule {predecessor!r} does not replace one character; give one character per rule"
            raise InputFormatError(msg)
    length, settles = expanded_length(axiom, rules, min(recursions, MOST_RECURSIONS))
    if recursions > MOST_RECURSIONS and not settles and length < COUNTLESS:
        msg = (
            f"the rules still change the L-string after {MOST_RECURSIONS:,} recursions (it has {length:,} "
            "characters by then); lower the recursions"
        )
        raise InputFormatError(msg)
    if length > LONGEST:
        most = f"{length:,}" if length < COUNTLESS else f"more than {COUNTLESS:,}"
        msg = (
            f"the rules grow the L-string to {most} characters in {recursions} recursions, "
            f"beyond the {LONGEST:,} that are held; lower the recursions"
        )
        raise InputFormatError(msg)
    table = str.maketrans(dict(rules))
    text = axiom
    for _ in range(recursions):
        before, text = text, text.translate(table)
        if text == before:
            break
    return text


def expanded_length(axiom: str, rules: Mapping[str, str], recursions: int) -> tuple[int, bool]:
    """Count the characters of the longest text on the way of an expansion, without expanding.

    Every symbol is counted, and the counts are replaced as the symbols would be.

    Parameters
    ----------
    axiom : str
    rules : mapping of str to str
        One character each, and what takes its place.
    recursions : int

    Returns
    -------
    length : int
        At most `COUNTLESS`, where the count stops.
    settles : bool
        Whether the rules change nothing any more.
    """
    counts, longest, settles = Counter(axiom), len(axiom), not rules
    made = {symbol: Counter(text) for symbol, text in rules.items()}
    for _ in range(recursions):
        following: Counter[str] = Counter()
        for symbol, times in counts.items():
            for product, each in made.get(symbol, {symbol: 1}).items():
                following[product] += times * each
        longest = max(longest, following.total())
        settles = following == counts and all(made.get(s, {s: 1}) == {s: 1} for s in counts)
        if settles or longest >= COUNTLESS:
            break
        counts = following
    return min(longest, COUNTLESS), settles
