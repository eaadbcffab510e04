"""Radii that cost nothing: a rule gives them from the structure, only exceptions are written.

The rule is the pipe model: along an axis and into its branches the cross-section is shared in
proportion to the wood that is carried, ``r = r_parent (W / W_parent)^exponent``. It starts from the
radius of the trunk and goes on from every exception, so that one measured radius corrects all that
hang on it.

References
----------
Shinozaki, K. et al. (1964), A quantitative analysis of plant form: the pipe model theory. Here the
length of the wood above stands for the number of leaves above.
"""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError
from pipeline.geometry.compiled import compiled
from pipeline.model import PROPAGATED, RADIUS_SOURCES, Floats, Ints

_RUNS = re.compile(r"(?:[mpa]\d+)*")
_LETTERS = "".join(source[0] for source in RADIUS_SOURCES)


def shares(parent: Ints, wood: Floats, exponent: float) -> Floats:
    """Return the (N,) factor from the parent's radius to each node's, 1 at the root.

    Parameters
    ----------
    parent : (N,) array of int32
    wood : (N,) array of float64
        Length that each segment carries, its own included; the root's is that of all.
    exponent : float
        0.5 shares the cross-section by length.
    """
    below = wood[np.maximum(parent, 0)]
    share = np.ones(len(parent))
    np.divide(wood, below, out=share, where=below > 0)
    return np.asarray(share**exponent)


@compiled
def grow_radii(parent: Ints, share: Floats, given: Floats) -> Floats:
    """Fill in by the rule what is not given (NaN).

    Parameters
    ----------
    parent : (N,) array of int32
    share : (N,) array of float64
    given : (N,) array of float64
        Radii in metres; the root's must be there.
    """
    radius = given.copy()
    for i in range(1, len(parent)):
        if np.isnan(given[i]):
            radius[i] = radius[parent[i]] * share[i]
    return radius


@compiled
def exceptions(parent: Ints, share: Floats, radius: Floats, tolerance: float) -> NDArray[np.bool_]:
    """Return the (N,) nodes whose radius the rule misses by more than `tolerance`, both in metres."""
    told = radius.copy()
    missed = np.zeros(len(parent), dtype=np.bool_)
    for i in range(1, len(parent)):
        told[i] = told[parent[i]] * share[i]
        if abs(told[i] - radius[i]) > tolerance:
            missed[i] = True
            told[i] = radius[i]
    return missed


def sources_text(source: NDArray[np.uint8]) -> str:
    """Write where each radius comes from as runs: ``m12p300`` is 12 measured, then 300 propagated."""
    starts = np.flatnonzero(np.diff(source, prepend=255))
    counts = np.diff(starts, append=len(source))
    return "".join(f"{_LETTERS[source[s]]}{n}" for s, n in zip(starts.tolist(), counts.tolist(), strict=True))


def sources(text: str | None, count: int) -> NDArray[np.uint8]:
    """Read what `sources_text` wrote; without it every radius is propagated from the trunk's.

    Raises
    ------
    InputFormatError
        If the text is no list of runs, or its runs do not add up to `count`.
    """
    if text is None:
        return np.full(count, PROPAGATED, dtype=np.uint8)
    if not _RUNS.fullmatch(text):
        msg = f"radius.source is {text[:24]!r}; it must be runs of m, p and a with their counts, like m12p300"
        raise InputFormatError(msg)
    letters = [_LETTERS.index(letter) for letter in re.findall("[mpa]", text)]
    counts = [min(int(digits), count + 1) for digits in re.findall(r"\d+", text)]
    if sum(counts) != count:
        msg = f"radius.source counts {sum(counts)} nodes where the L-string has {count}; write the file anew"
        raise InputFormatError(msg)
    return np.repeat(np.array(letters, dtype=np.uint8), counts)
