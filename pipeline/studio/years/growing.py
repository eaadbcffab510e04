"""A plan becomes years; what is the same as in the plan before is not grown again."""

from __future__ import annotations

import copy
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from pipeline.errors import UsageError
from pipeline.growth import BarePoleWarning, Growth, YearReport
from pipeline.growth.carrying import Carrying
from pipeline.growth.conversion import Conversion
from pipeline.growth.events import PruningEvent
from pipeline.growth.pruning import Pruned
from pipeline.model import TreeModel
from pipeline.options import Options
from pipeline.studio.years.limbs import Limbs, limbs_of
from pipeline.studio.years.plan import Plan

Clock = Callable[[], float]

MOST_METAMERS = 300_000
"""Of one year: a browser does not turn more at ease."""
MOST_KEPT = 4_000_000
"""Metamers of all years together, some 600 MB."""
MOST_BYTES = 512 * 1024**2
"""Of the states from which later years are grown again; beyond it every second one is given up."""
SHARED = (TreeModel, Conversion, Options)
"""Parts of a growth that never change, so that its copies may share them."""


class Done(NamedTuple):
    """What came of an event.

    Attributes
    ----------
    entry : Pruned or None
        What it has done; None where it did not fit, now or in an earlier year.
    sentence : str
        Why it does not fit, and what helps; empty otherwise.
    """

    entry: Pruned | None = None
    sentence: str = ""


@dataclass(frozen=True, eq=False)
class Year:
    """A tree in one year, after all that is done to it then.

    Parameters
    ----------
    number : int
    tree : TreeModel
    limbs : Limbs
        Its wood, for picking.
    report : YearReport or None
        What the growth has brought; None in year 0.
    done : tuple of Done
        What came of the programmes that act in this year, in their order.
    milliseconds : float
        What it took.
    """

    number: int
    tree: TreeModel
    limbs: Limbs
    report: YearReport | None
    done: tuple[Done, ...]
    milliseconds: float


@dataclass(frozen=True, eq=False)
class Story:
    """The years of a plan.

    Parameters
    ----------
    plan : Plan
    years : tuple of Year
        From year 0 on; fewer than planned while it grows, and where growth has ended before.
    again : int
        The first year that was grown for this plan, and not for the one before.
    milliseconds : float
        What that took.
    ended : str
        Why there are fewer years than planned; empty otherwise.
    """

    plan: Plan
    years: tuple[Year, ...]
    again: int = 0
    milliseconds: float = 0.0
    ended: str = ""

    @property
    def whole(self) -> bool:
        """Whether nothing is left to grow."""
        return bool(self.ended) or len(self.years) == self.plan.years + 1

    def done(self) -> Iterator[tuple[int, int, Done]]:
        """Yield year, number of the programme, and what came of it."""
        for year in self.years:
            for number, done in zip(self.plan.due(year.number), year.done, strict=True):
                yield year.number, number, done

    def misfits(self) -> dict[int, tuple[int, str]]:
        """Return the programmes that did not fit, with the year in which they did not and the sentence."""
        return {number: (year, done.sentence) for year, number, done in self.done() if done.sentence}


Told = Callable[[Story], None]


class Grower:
    """Grows plans, and keeps the years of the last one, with states that they can be grown on from.

    Parameters
    ----------
    clock : callable
        Tells seconds.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._plan = Plan()
        self._years: list[Year] = []
        self._states: dict[int, Growth] = {}

    def grow(self, plan: Plan, told: Told) -> Story:
        """Grow the years of a plan.

        An event that does not fit leaves the tree as it was, and is not tried in later years.

        Parameters
        ----------
        plan : Plan
        told : callable
            Is told the story so far after every year; what it raises ends the growth, and what has been
            grown stays for the next plan.

        Raises
        ------
        PipelineError
            If the tree cannot grow at all.
        """
        begun = self._clock()
        first, ended = self._prepare(plan), ""
        growth = self._state_before(first) if first <= plan.years else None
        for number in range(first, plan.years + 1):
            if growth is None:
                break
            try:
                growth = self._grow_year(growth, number)
            except UsageError as error:
                ended = str(error)
                break
            told(Story(plan, tuple(self._years), first, 1000.0 * (self._clock() - begun)))
        took = 1000.0 * (self._clock() - begun)
        return Story(plan, tuple(self._years[: plan.years + 1]), first, took, ended)

    def _prepare(self, plan: Plan) -> int:
        """Forget what another plan makes untrue; the first year that has to be grown."""
        first = first_changed(self._plan, plan, len(self._years))
        del self._years[first:]
        self._states = {number: state for number, state in self._states.items() if number < first}
        self._plan = plan
        return first

    def _grow_year(self, growth: Growth, number: int) -> Growth:
        """Grow a year, do what is due, and keep it; the growth as it is then."""
        begun, plan = self._clock(), self._plan
        report = growth.grow_year() if number else None
        self._check_size(growth)
        misfits = Story(plan, tuple(self._years)).misfits()
        done: list[Done] = []
        for i in plan.due(number):
            if i in misfits:
                done.append(Done())
                continue
            growth, one = attempted(growth, PruningEvent(number, plan.programmes[i]))
            done.append(one)
        tree, limbs = tree_of(growth, plan), limbs_of(growth.metamers)
        took = 1000.0 * (self._clock() - begun)
        self._years.append(Year(number, tree, limbs, report, tuple(done), took))
        self._states[number] = copied(growth)
        self._thin()
        return growth

    def _state_before(self, year: int) -> Growth:
        """Return a growth that is about to grow a year."""
        latest = max(self._states, default=-1)
        growth = copied(self._states[latest]) if latest >= 0 else begun_by(self._plan)
        for number in range(latest + 1, year):  # whose states have been given up
            if number:
                growth.grow_year()
            for i, done in zip(self._plan.due(number), self._years[number].done, strict=True):
                if done.entry is not None:
                    self._plan.programmes[i].operation.apply(growth)
        return growth

    def _check_size(self, growth: Growth) -> None:
        count = len(growth.metamers)
        kept = count + sum(len(year.limbs.width) for year in self._years)
        if count > MOST_METAMERS or kept > MOST_KEPT:
            msg = (
                f"growth stops before year {len(self._years)}: {count:,} metamers, {kept:,} with "
                "those of the years before, are more than this page shows; grow fewer years, or use "
                "`treepipe simulate`"
            )
            raise UsageError(msg)

    def _thin(self) -> None:
        """Keep the states within their memory; the first and the latest stay."""
        while len(self._states) > 2 and sum(map(bytes_of, self._states.values())) > MOST_BYTES:
            for number in sorted(self._states)[1:-1:2]:
                del self._states[number]


def first_changed(before: Plan, after: Plan, years: int) -> int:
    """Return the first of so many years that another plan makes another; their number if all are the same."""
    same = before.start is after.start and before.options == after.options
    if not same or (before.seed, before.species) != (after.seed, after.species):
        return 0
    for year in range(years):
        was = [before.programmes[i] for i in before.due(year)]
        if was != [after.programmes[i] for i in after.due(year)]:
            return year
    return years


def begun_by(plan: Plan) -> Growth:
    """Return the growth of a plan before its first year."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", BarePoleWarning)  # the page says it by itself
        return Carrying(plan.start.tree, plan.options, seed=plan.seed)


def attempted(growth: Growth, event: PruningEvent) -> tuple[Growth, Done]:
    """Do something to a tree; where it does not fit, return the tree as it was."""
    before = copied(growth)
    try:
        return growth, Done(event.apply(growth))
    except UsageError as error:
        return before, Done(sentence=str(error))


def tree_of(growth: Growth, plan: Plan) -> TreeModel:
    """Return the tree of now, told of as `treepipe simulate` does."""
    if isinstance(growth, Carrying):
        return growth.to_model(known={} if plan.species is None else {"species": plan.species})
    return growth.to_model()


def copied(growth: Growth) -> Growth:
    """Return a growth that goes on by itself; what never changes is shared."""
    shared: list[Any] = [value for value in vars(growth).values() if isinstance(value, SHARED)]
    shared += [*growth.log, *growth.supports]
    return copy.deepcopy(growth, {id(value): value for value in shared})


def bytes_of(growth: Growth) -> int:
    """Return about how much memory a growth takes: its arrays, the grid of its light included."""
    found, waiting = 0, [vars(growth.metamers), vars(growth.light), vars(growth)]
    grid = getattr(growth.light, "grid", None)
    waiting += [vars(grid)] if grid is not None else []
    for held in waiting:
        found += sum(value.nbytes for value in held.values() if isinstance(value, np.ndarray))
    return found
