"""Prunings in years, and files of them: one table ``[[event]]`` each.

A table has a `year`, an `operation`, and its parameters; ``until`` and ``every`` repeat it::

    [[event]]
    year = 3
    until = 20                  # done again every year up to this one
    every = 2                   # or every so many years
    operation = "crown-raise"
    height_m = 1.5
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import Field, ValidationError

from pipeline.choosing import meant
from pipeline.errors import InputFormatError, InputMissingError, UsageError
from pipeline.growth.pruning import OPERATIONS, Operation, Pruned, operation_of
from pipeline.growth.simulation import Growth
from pipeline.options import Options
from pipeline.output import write_text

MOST_YEARS = 1000


class Timing(Options):
    """When something is done."""

    year: int = Field(
        ge=0, le=MOST_YEARS, description="year after whose growth it is done; 0: before the first"
    )
    until: int | None = Field(None, ge=0, le=MOST_YEARS, description="last year; without it once")
    every: int = Field(1, ge=1, le=MOST_YEARS, description="years from one time to the next")

    @property
    def years(self) -> range:
        """All the years."""
        return range(self.year, (self.year if self.until is None else self.until) + 1, self.every)


@dataclass(frozen=True)
class Programme:
    """An operation and its years, as a table of a file tells them."""

    timing: Timing
    operation: Operation

    def events(self) -> tuple[PruningEvent, ...]:
        """Return one event for every year."""
        return tuple(PruningEvent(year, self) for year in self.timing.years)

    def to_toml(self) -> str:
        """Return the table; what has its default value is left out."""
        told = {
            "year": self.timing.year,
            **self.timing.model_dump(exclude_defaults=True),
            "operation": self.operation.name,
            **self.operation.model_dump(exclude_defaults=True),
        }
        return "\n".join(["[[event]]", *(f"{key} = {_literal(value)}" for key, value in told.items()), ""])


@dataclass(frozen=True)
class PruningEvent:
    """One time that an operation is done; see `pipeline.growth.simulation.Event`."""

    year: int
    programme: Programme

    def apply(self, growth: Growth) -> Pruned:
        """Do it; one that is repeated waits for its branches, as a tree has none at first.

        Raises
        ------
        UsageError
            If the operation is not possible on this tree; says which event it was.
        """
        try:
            if self.programme.timing.until is None:
                self.programme.operation.check_chosen(growth)
            return self.programme.operation.apply(growth)
        except UsageError as error:
            name = self.programme.operation.name
            msg = f"event of year {self.year}, {name}: {str(error).removeprefix(f'{name}: ')}"
            raise UsageError(msg) from error


def planned(
    operation: Operation, year: int, *, until: int | None = None, every: int = 1
) -> tuple[PruningEvent, ...]:
    """Return the events of an operation: once, or again and again.

    Parameters
    ----------
    operation : Operation
    year : int
        First year; 0 is before the first growth.
    until : int, optional
        Last year.
    every : int
        Years between.

    Raises
    ------
    UsageError
        If a year is out of range.

    Examples
    --------
    >>> from pipeline.growth.pruning import CrownRaise
    >>> [event.year for event in planned(CrownRaise(height_m=2), 3, until=8, every=2)]
    [3, 5, 7]
    """
    return Programme(_timing({"year": year, "until": until, "every": every}), operation).events()


def read_events(path: Path) -> tuple[PruningEvent, ...]:
    """Read the events of a file, in its order; a repeated one becomes one for every year.

    Raises
    ------
    InputMissingError, InputFormatError
        If there is no such file, or it is not TOML.
    UsageError
        If an operation or key is unknown (names the nearest), or a year or parameter out of range; says in
        which event of the file. If the file has other tables or keys.
    """
    tables = _tables(path)
    events: list[PruningEvent] = []
    for number, table in enumerate(tables, 1):
        try:
            events += programme_of(table).events()
        except UsageError as error:
            msg = f"{path}: event {number}: {error}"
            raise UsageError(msg) from None
    return tuple(events)


def write_events(events: Iterable[PruningEvent], path: Path) -> None:
    """Write events; those that an operation repeats are one table, in the place of the first.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    programmes = dict.fromkeys(event.programme for event in events)
    write_text(path, "\n".join(programme.to_toml() for programme in programmes))


def programme_of(table: Mapping[str, Any]) -> Programme:
    """Return what a table of a file means.

    Raises
    ------
    UsageError
        If a key is missing, unknown or out of range.
    """
    if "operation" not in table:
        msg = 'operation is missing; give for example operation = "open-centre"'
        raise UsageError(msg)
    when = {key: value for key, value in table.items() if key in Timing.model_fields}
    what = {key: value for key, value in table.items() if key not in when and key != "operation"}
    name = str(table["operation"])
    if name in OPERATIONS:
        known = (*Timing.model_fields, *OPERATIONS[name].model_fields)
        for key in (key for key in what if key not in known):
            msg = f"{name}: unknown key {key}{meant(key, known)} known: {', '.join(known)}"
            raise UsageError(msg)
    return Programme(_timing(when), operation_of(name, what))


def _timing(values: Mapping[str, Any]) -> Timing:
    try:
        timing = Timing.model_validate(dict(values))
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        key = str(first["loc"][0])
        if first["type"] == "missing":
            msg = "year is missing; give the year after whose growth it is done, 0 for before the first"
        else:
            msg = f"{key} = {first['input']!r} is not possible; give a whole number from 0 to {MOST_YEARS}"
        raise UsageError(msg) from None
    if timing.until is not None and timing.until < timing.year:
        msg = f"until, {timing.until}, is before year, {timing.year}; give a later one"
        raise UsageError(msg)
    return timing


def _tables(path: Path) -> Iterator[Mapping[str, Any]]:
    try:
        held = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except FileNotFoundError as error:
        msg = f"{path}: there is no such file; check the name"
        raise InputMissingError(msg) from error
    except (OSError, ValueError) as error:  # TOMLDecodeError and UnicodeDecodeError are ValueErrors
        msg = f"{path}: is not a file of events in TOML ({error}); write tables [[event]]"
        raise InputFormatError(msg) from error
    tables = held.pop("event", [])
    if held or not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        unknown = f"{next(iter(held))} is not known here; " if held else ""
        msg = f"{path}: {unknown}a file of events has tables [[event]] and nothing else"
        raise UsageError(msg)
    yield from tables


def _literal(value: Any) -> str:
    """Write a value as TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, tuple):
        return f"[{', '.join(_literal(part) for part in value)}]"
    return repr(value)
