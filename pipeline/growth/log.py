"""What a tree remembers of its years: entries of the log of its growth."""

from __future__ import annotations

from dataclasses import dataclass

from pipeline.model import Ints


@dataclass(frozen=True)
class Entry:
    """Something that happened in or after a year of growth."""

    year: int


@dataclass(frozen=True)
class YearReport(Entry):
    """What a year has brought.

    Attributes
    ----------
    light : float
        All buds' light, in units of `full_light` of one bud.
    resource : float
        What it became at the root; the buds share exactly this.
    grown, shed : int
        Metamers that came and went.
    metamers : int
        Those there are at the end of the year, the foot not counted.
    """

    light: float
    resource: float
    grown: int
    shed: int
    metamers: int


@dataclass(frozen=True, eq=False)
class Removal(Entry):
    """What a cut has taken away.

    Attributes
    ----------
    cut : tuple of int
        The metamers that were cut off, in the numbers before.
    removed : int
        Metamers gone, all those above included.
    number : (N,) array of int32
        The new number of every old metamer, -1 where it is gone.
    """

    cut: tuple[int, ...]
    removed: int
    number: Ints
