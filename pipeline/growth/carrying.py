"""A reconstructed tree that grows on: what stands lives, and thickens with what it comes to bear."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from pipeline.errors import UsageError
from pipeline.geometry.compiled import compiled
from pipeline.growth.allocation import gather
from pipeline.growth.carried import carried
from pipeline.growth.conversion import converted
from pipeline.growth.log import YearReport
from pipeline.growth.options import GrowthOptions
from pipeline.growth.shade import Shade
from pipeline.growth.simulation import Event, Growth
from pipeline.growth.state import Mask
from pipeline.model import Floats, Ints, TreeModel

FADED = 0.5
"""A scanned branch lives; it dies when it has little light, and less than this share of what it had."""
SPARED = np.iinfo(np.int32).max
"""Birth year of what the shedding of young wood shall pass over."""
MOST_YEARS = 1000
ROUNDING = 1e-9


class Carrying(Growth):
    """The growth of a reconstructed tree.

    Two things differ from a tree that grows from a bud. A scan shows less young wood than there is, so wood
    thickens by what is added to what it bears, not once this alone explains its width; and branches that bear
    few buds for their length are alive all the same, so they die only when they lose the light that they had.

    Parameters
    ----------
    tree : TreeModel
        A tree of one node is a bud.
    options : GrowthOptions
    seed : int
        The same seed gives the same tree.
    shade : Shade, optional
        Neighbours and buildings, relative to the origin of `tree`.

    Attributes
    ----------
    tree : TreeModel
        As it was before.

    Raises
    ------
    ModelError
        If the tree has no radii.
    UsageError
        If it has more metamers than `most_metamers`.
    """

    def __init__(
        self, tree: TreeModel, options: GrowthOptions, *, seed: int, shade: Shade | None = None
    ) -> None:
        self.tree = tree
        self._origin = converted(tree, options, seed=seed)
        metamers = copy.deepcopy(self._origin.metamers)
        super().__init__(metamers, options, seed=seed, shade=shade)
        held = metamers.held()
        self._scanned = len(metamers)
        self._key = np.sort(held["key"])
        self._row = np.argsort(held["key"]).astype(np.int32)
        self._area = held["width"] ** options.pipe_exponent
        tip = (2.0 * options.tip_radius_m) ** options.pipe_exponent
        self._unseen = self._area - borne(held["parent"], self._area, tip)
        self._light: Floats | None = None

    def grow_year(self) -> YearReport:
        """Grow for a year; else as `Growth.grow_year`."""
        faded = self._shed_faded()
        old = self.scanned()
        spared = np.flatnonzero((old >= 0) & self.metamers.held()["is_lateral"])
        born = self.metamers.birth_year[spared].copy()
        self.metamers.birth_year[spared] = SPARED
        try:
            report = super().grow_year()
        finally:
            self.metamers.birth_year[spared] = born
        self._thicken()
        report = replace(report, shed=report.shed + faded)
        self.log[-1] = report
        return report

    def scanned(self) -> Ints:
        """(M,) number that each metamer had at first, -1 for what has grown since."""
        key = self.metamers.held()["key"]
        at = np.minimum(np.searchsorted(self._key, key), self._scanned - 1)
        return np.where(self._key[at] == key, self._row[at], -1).astype(np.int32)

    def to_model(self, known: Mapping[str, Any] | None = None) -> TreeModel:
        """Return the tree as it is now, with more for metadata's ``growth``: see `carried`."""
        return carried(self.tree, self, known=known, origin=self._origin)

    @property
    def scanned_metamers(self) -> int:
        """Number of metamers of the tree as it was before, the foot not counted."""
        return self._scanned - 1

    def _shed_faded(self) -> int:
        """Drop scanned branches that have lost their light; the number of metamers that are gone."""
        tree, old = self.metamers.held(), self.scanned()
        light = gather(self.metamers, self.light.at_buds(self.metamers))
        mean = (light.terminal + light.lateral) / light.internodes
        if self._light is None:
            self._light = np.zeros(self._scanned)
            self._light[old[old >= 0]] = mean[old >= 0]
        faded = tree["is_lateral"] & (old >= 0) & (mean < self.options.shed_threshold)
        faded &= mean < FADED * self._light[old]
        return int((self._drop(np.flatnonzero(faded).astype(np.int32)) < 0).sum())

    def _thicken(self) -> None:
        """Give scanned wood its width, and what it has come to bear on top."""
        tree, old, power = self.metamers.held(), self.scanned(), self.options.pipe_exponent
        young = old < 0
        area = np.where(young, tree["width"] ** power, self._area[old])
        add_borne(tree["parent"], young, self._unseen[old], area)
        stays = young | (area <= (1.0 + ROUNDING) * self._area[old])
        before = np.where(young, area, self._area[old])
        area = np.where(stays, before, area)
        self._area[old[~young]] = area[~young]
        tree["width"][~young] = area[~young] ** (1.0 / power)


def through(growth: Growth, years: int, events: Iterable[Event] = ()) -> Iterator[int]:
    """Let a tree grow; after every year and its events, and before the first, tell the year.

    Parameters
    ----------
    growth : Growth
    years : int
        0 to `MOST_YEARS`.
    events : iterable of Event
        Each is done after the growth of its year; those of a year in the order given.

    Raises
    ------
    UsageError
        If years are out of range, an event lies beyond them, or there would be too many metamers.
    """
    due = list(events)
    if not 0 <= years <= MOST_YEARS:
        msg = f"a tree cannot grow for {years} years; give 0 to {MOST_YEARS}"
        raise UsageError(msg)
    late = [event.year for event in due if not 0 <= event.year <= years]
    if late:
        msg = f"an event is of year {late[0]}, but growth is from year 0 to {years}; move it or add years"
        raise UsageError(msg)
    for year in range(years + 1):
        if year:
            growth.grow_year()
        for event in due:
            if event.year == year:
                event.apply(growth)
        yield year


@compiled
def borne(parent: Ints, area: Floats, tip: float) -> Floats:
    """(M,) area of all children of each metamer; at ends that of a tip, at most the end's own."""
    total = np.zeros(len(parent))
    ends = np.ones(len(parent), dtype=np.bool_)
    for i in range(1, len(parent)):
        total[parent[i]] += area[i]
        ends[parent[i]] = False
    for i in range(len(parent)):
        if ends[i]:
            total[i] = min(tip, area[i])
    return total


@compiled
def add_borne(parent: Ints, young: Mask, unseen: Floats, area: Floats) -> None:
    """Raise the area of scanned wood to what it bears, seen and unseen, from the tips down."""
    total = np.zeros(len(parent))
    for i in range(len(parent) - 1, -1, -1):
        if not young[i]:
            area[i] = max(area[i], total[i] + unseen[i])
        if i > 0:
            total[parent[i]] += area[i]
