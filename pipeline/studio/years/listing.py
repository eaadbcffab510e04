"""Lists of events as files: read, written, and what people read of each."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from pipeline.errors import InputFormatError, UsageError
from pipeline.growth.events import Programme, programme_of
from pipeline.growth.pruning import Pruned
from pipeline.studio.years.growing import Story

MOST_BYTES = 1_000_000
"""Of a file of events: some ten thousand."""
TIMES = ("year", "until", "every")


def read_programmes(content: bytes, name: str) -> tuple[Programme, ...]:
    """Read the events of a file, such as `treepipe simulate` takes and `treepipe calibrate` proposes.

    Parameters
    ----------
    content : bytes
    name : str
        Stands before what is wrong.

    Raises
    ------
    InputFormatError
        If it is too large, no TOML, or holds anything but events.
    UsageError
        If an event is not possible, with its number; an unknown word comes with the nearest known one.
    """
    if len(content) > MOST_BYTES:
        msg = f"{name}: has {len(content):,} bytes, more than the {MOST_BYTES:,} of events; choose another"
        raise InputFormatError(msg)
    try:
        held = tomllib.loads(content.decode("utf-8-sig"))
    except ValueError as error:  # TOMLDecodeError and UnicodeDecodeError are ValueErrors
        msg = f"{name}: is not a file of events in TOML ({error}); write tables [[event]]"
        raise InputFormatError(msg) from error
    tables = held.pop("event", [])
    if held or not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        unknown = f"{next(iter(held))} is not known here; " if held else ""
        msg = f"{name}: {unknown}a file of events has tables [[event]] and nothing else"
        raise InputFormatError(msg)
    return tuple(_read(table, f"{name}: event {number}") for number, table in enumerate(tables, 1))


def written(story: Story) -> bytes:
    """Write the events of a story such that `treepipe simulate --events` replays it.

    One that did not fit is done up to the year before; what is not done at all stands there as a comment.
    """
    misfits = story.misfits()
    held = enumerate(story.plan.programmes)
    return "\n".join(_table(one, misfits.get(i), story.plan.years) for i, one in held).encode()


def _table(programme: Programme, misfit: tuple[int, str] | None, years: int) -> str:
    """Write one event; `treepipe simulate` refuses those after the last year."""
    done = [year for year in programme.timing.years if year <= years and (not misfit or year < misfit[0])]
    why = misfit[1] if misfit else f"it is after the {years} years"
    if not done:
        lines = [f"left out: {why}", *programme.to_toml().splitlines()]
        return "".join(f"# {line}\n" for line in lines)
    if done == list(programme.timing.years):
        return programme.to_toml()
    timing = programme.timing.model_copy(update={"until": done[-1]})
    return f"# not after year {done[-1]}: {why}\n{replace(programme, timing=timing).to_toml()}"


def row(programme: Programme, number: int, story: Story | None) -> dict[str, Any]:
    """Return what the list shows of an event."""
    timing = programme.timing
    when = str(timing.year)
    if timing.until is not None and timing.until != timing.year:
        when += f" to {timing.until}" + (f", every {timing.every}" if timing.every > 1 else "")
    told = programme.operation.model_dump(exclude_defaults=True)
    shown = {
        "number": number,
        "year": timing.year,
        "when": when,
        "operation": programme.operation.name,
        "told": ", ".join(f"{key} {_shown(value)}" for key, value in told.items()),
        "came": "",
        "wrong": "",
    }
    if story is not None and number < len(story.plan.programmes):
        shown |= _outcome(story, number)
    return shown


def _outcome(story: Story, number: int) -> dict[str, str]:
    """Say what came of an event."""
    if number in (misfits := story.misfits()):
        return {"wrong": misfits[number][1]}
    entries = [done.entry for _, at, done in story.done() if at == number and done.entry is not None]
    if not entries:
        late = story.plan.programmes[number].timing.year > story.plan.years
        return {"wrong": f"is after the {story.plan.years} years; add years, or move it"} if late else {}
    return {"came": came_of(entries)}


def came_of(entries: Sequence[Pruned]) -> str:
    """Say what an operation has done, in all its years.

    Examples
    --------
    >>> came_of([Pruned(3, "thin", cuts=2, removed=31), Pruned(4, "thin")])
    '2 cuts, 31 metamers gone'
    >>> came_of([Pruned(3, "cut", cuts=1, bent=2)])
    '1 cut, 2 bent'
    """
    sums = {key: sum(getattr(entry, key) for entry in entries) for key in ("cuts", "removed", "tied", "bent")}
    words = {"cuts": ("cut", "cuts"), "removed": ("metamer gone", "metamers gone")}
    told = [f"{count} {words.get(key, (key, key))[count > 1]}" for key, count in sums.items() if count]
    return ", ".join(told) or "found nothing to do"


def _read(table: dict[str, Any], where: str) -> Programme:
    try:
        return programme_of(table)
    except UsageError as error:
        msg = f"{where}: {error}"
        raise UsageError(msg) from None


def _shown(value: Any) -> str:
    if isinstance(value, Iterable) and not isinstance(value, str):
        return f"({', '.join(map(_shown, value))})"
    return f"{value:g}" if isinstance(value, float) and abs(value) < 1000 else str(value)
