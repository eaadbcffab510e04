"""Nested lists of indices, as CityJSON's boundaries are: checked and flattened level by level."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain
from typing import Any

LARGEST = 2**53
"""Whole numbers up to here are exact in every JSON reader."""


def is_nested(values: Any, depth: int) -> bool:
    """Tell whether `values` are lists of lists, `depth` deep, of nothing but whole numbers.

    Parameters
    ----------
    values : object
    depth : int
        1 for a plain list.

    Returns
    -------
    bool
        False where a list is empty, or a leaf is True, False or beyond `LARGEST`.

    Examples
    --------
    >>> is_nested([[0, 1], [2]], 2), is_nested([[0, 1], 2], 2), is_nested([[]], 2)
    (True, False, False)
    """
    level = [values]
    for _ in range(depth):
        if not all(type(part) is list and part for part in level):
            return False
        level = list(chain.from_iterable(level))
    return all(type(part) is int and -LARGEST < part < LARGEST for part in level)


def flat(values: Sequence[Any], depth: int) -> list[int]:
    """Return the leaves of lists that are `depth` deep."""
    for _ in range(depth - 1):
        values = list(chain.from_iterable(values))
    return list(values)
