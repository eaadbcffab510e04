"""What shall become of a tree: what it begins with, how it grows, for how long, and what is done to it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pipeline.choosing import chosen
from pipeline.errors import UsageError
from pipeline.growth import GrowthOptions
from pipeline.growth.events import MOST_YEARS, Programme
from pipeline.growth.species import SPECIES, species_named
from pipeline.jobs.simulation import bud
from pipeline.model import TreeModel

YEARS = 25
"""Of a tree that grows from a bud; a default tree has 2 300 metamers then."""
YEARS_ON = 10
"""Of a tree that stands already."""


@dataclass(frozen=True, eq=False)
class Start:
    """The tree of year 0.

    Parameters
    ----------
    name : str
        What people call it; names of downloads begin with it.
    tree : TreeModel
    path : Path, optional
        The file it was read from.
    """

    name: str = "bud"
    tree: TreeModel = field(default_factory=bud)
    path: Path | None = None

    @property
    def is_bud(self) -> bool:
        """Whether everything is still to grow."""
        return len(self.tree) < 2


@dataclass(frozen=True)
class Plan:
    """All that decides what a tree is in every year.

    Parameters
    ----------
    start : Start
    options : GrowthOptions
    years : int
    seed : int
    species : str or None
        Whose parameters were taken; noted in the models, as `treepipe simulate --species` does.
    programmes : tuple of Programme
        What is done in which years; those of one year in this order.
    """

    start: Start = field(default_factory=Start)
    options: GrowthOptions = field(default_factory=GrowthOptions)
    years: int = YEARS
    seed: int = 0
    species: str | None = None
    programmes: tuple[Programme, ...] = ()

    def due(self, year: int) -> tuple[int, ...]:
        """Return the numbers of the programmes that act in a year, in their order."""
        return tuple(i for i, one in enumerate(self.programmes) if year in one.timing.years)

    def with_(self, **values: Any) -> Plan:
        """Return the plan with other values for some of its parts.

        Raises
        ------
        UsageError
            If years or seed are out of range.
        """
        other = replace(self, **values)
        if not 0 <= other.years <= MOST_YEARS:
            msg = f"a tree cannot grow for {other.years} years; give 0 to {MOST_YEARS}"
            raise UsageError(msg)
        if other.seed < 0:
            msg = f"seed {other.seed} is not possible; give a whole number from 0"
            raise UsageError(msg)
        return other

    def of_species(self, name: str) -> Plan:
        """Take the parameters of a species; of none, the defaults.

        Raises
        ------
        UsageError
            If there is no such species.
        """
        if not name:
            return replace(self, species=None, options=GrowthOptions())
        return replace(self, species=name, options=chosen(GrowthOptions, species_named(name)))

    def with_options(self, **values: Any) -> Plan:
        """Give some parameters of growth other values.

        Raises
        ------
        UsageError
            If a value is out of range.
        """
        return replace(self, options=chosen(GrowthOptions, self.options.model_dump() | values))

    def from_start(self, start: Start) -> Plan:
        """Begin with another tree, to which nothing is done: events stay with the tree that they are of."""
        years = self.years if start.is_bud == self.start.is_bud else YEARS if start.is_bud else YEARS_ON
        return replace(self, start=start, years=years, programmes=())

    def long_enough(self) -> Plan:
        """Return the plan with years enough for all events to begin."""
        last = max((one.timing.year for one in self.programmes), default=0)
        return replace(self, years=max(self.years, last))

    def adding(self, programmes: Iterable[Programme]) -> Plan:
        """Do something more; each goes behind what is done in its first year or before."""
        held = list(self.programmes)
        for one in programmes:
            held.insert(_place(held, one), one)
        return replace(self, programmes=tuple(held))

    def changing(self, number: int, programme: Programme) -> Plan:
        """Replace an event; it keeps its place unless its year is another.

        Raises
        ------
        UsageError
            If there is no such event.
        """
        held = list(self.programmes)
        old = held.pop(self._checked(number))
        place = number if old.timing.year == programme.timing.year else _place(held, programme)
        held.insert(place, programme)
        return replace(self, programmes=tuple(held))

    def without(self, number: int) -> Plan:
        """Leave an event out.

        Raises
        ------
        UsageError
            If there is no such event.
        """
        number = self._checked(number)
        return replace(self, programmes=self.programmes[:number] + self.programmes[number + 1 :])

    def moved(self, number: int, by: int) -> Plan:
        """Do an event earlier or later among those of the list; at its ends nothing changes.

        Raises
        ------
        UsageError
            If there is no such event.
        """
        held = list(self.programmes)
        one = held.pop(self._checked(number))
        held.insert(max(number + by, 0), one)
        return replace(self, programmes=tuple(held))

    def _checked(self, number: int) -> int:
        if not 0 <= number < len(self.programmes):
            msg = f"there is no event {number + 1} in a list of {len(self.programmes)}; choose one of them"
            raise UsageError(msg)
        return number


def species_choices() -> Mapping[str, str]:
    """Return the species by name, and no species, with what people read."""
    return {"": "default parameters", **{name: name for name in sorted(SPECIES)}}


def _place(held: list[Programme], programme: Programme) -> int:
    """Return where a programme goes: behind the last one that begins no later."""
    before = [i for i, one in enumerate(held) if one.timing.year <= programme.timing.year]
    return before[-1] + 1 if before else 0
