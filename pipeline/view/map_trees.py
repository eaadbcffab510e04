"""What the maps of an inventory draw: trees in plan, their crowns and figures; and the colours of heights."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Floats

RAMP = ("#f6e58d", "#b7d36a", "#63b365", "#1f8a70", "#155f7a", "#2b2a66")
"""From low to high: lighter to darker, told apart with any colour vision."""

UNKNOWN = "#b9b9b9"
"""Colour of what is not known."""

Window = tuple[float, float, float, float]
"""West, south, east and north, in metres."""


class Figure(NamedTuple):
    """One figure of every tree, NaN where unknown."""

    label: str
    unit: str
    values: Floats


class Text(NamedTuple):
    """One text of every tree."""

    label: str
    values: Sequence[str]


@dataclass(frozen=True, eq=False)
class TreeMap:
    """Trees in plan.

    Parameters
    ----------
    names : sequence of str
    xy : (N, 2) array
        Where the trees are, in metres.
    rings : (V, 2) array
        Vertices of all crowns, one tree after the other.
    ring_ends : (N + 1,) array of int
        Where the vertices of each tree begin; a tree may have none.
    figures : mapping of str to Figure
        The first one colours the map; ``crown_diam_m`` is the size of a tree without an outline.
    texts : mapping of str to Text
    crs : str or None
    frames : tuple of Window
        The cells, drawn as thin lines.
    total : int
        Trees of the inventory, of which these may be a part.
    source : str
        What the map is made of and when that was seen.
    """

    names: Sequence[str]
    xy: Floats
    rings: Floats
    ring_ends: NDArray[np.int64]
    figures: Mapping[str, Figure]
    texts: Mapping[str, Text] = field(default_factory=dict)
    crs: str | None = None
    frames: tuple[Window, ...] = ()
    total: int = 0
    source: str = ""

    def __len__(self) -> int:
        return len(self.xy)

    @property
    def window(self) -> Window:
        """The box around the trees; around the cells where there are none."""
        points = np.concatenate([self.xy, self.rings])
        if not len(points):
            points = np.array(self.frames).reshape(-1, 2)
        if not len(points):
            return 0.0, 0.0, 100.0, 100.0
        (west, south), (east, north) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
        return west, south, east, north

    @property
    def note(self) -> str:
        """How many trees are drawn of how many."""
        if len(self) < self.total:
            return f"{len(self):,} of {self.total:,} trees are drawn, evenly chosen; the tables hold all"
        return f"{len(self):,} trees"


def scale_end(values: Floats) -> float:
    """Return where the scale of colours ends: a round number that 99 % of the values stay below.

    Examples
    --------
    >>> scale_end(np.array([3.0, 12.0, 21.4]))
    25.0
    """
    known = values[np.isfinite(values)]
    most = float(np.percentile(known, 99)) if len(known) else 0.0
    if most <= 0:
        return 1.0
    power = 10.0 ** math.floor(math.log10(most))
    return float(next(k * power for k in (1, 1.5, 2, 2.5, 3, 4, 5, 6, 8, 10) if k * power >= most))


def bar_length(width_m: float) -> float:
    """Return the length of a scale bar: a round number of about a fifth of the width.

    Examples
    --------
    >>> bar_length(2300.0)
    500.0
    """
    power = 10.0 ** math.floor(math.log10(max(width_m, 1e-3) / 4))
    return float(max(k * power for k in (1, 2, 5) if k * power <= width_m / 4))


def length_text(metres: float) -> str:
    """Return a length for people.

    Examples
    --------
    >>> length_text(500.0), length_text(2000.0)
    ('500 m', '2 km')
    """
    return f"{metres / 1000:g} km" if metres >= 1000 else f"{metres:g} m"
