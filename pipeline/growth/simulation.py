"""A tree that grows year by year: light, resource, shoots, shedding, widths."""

from __future__ import annotations

import warnings
from collections.abc import Iterable
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from pipeline.errors import UsageError
from pipeline.growth.allocation import Resource, by_borchert_honda, by_priority, gather
from pipeline.growth.chance import sow
from pipeline.growth.light import Light, light_for
from pipeline.growth.log import Entry, Removal, YearReport
from pipeline.growth.options import GrowthOptions
from pipeline.growth.poles import bare_pole
from pipeline.growth.shade import Shade
from pipeline.growth.shedding import shaded_out
from pipeline.growth.shoots import buds_that_grow, grow_shoots
from pipeline.growth.state import Metamers
from pipeline.growth.widths import thicken
from pipeline.model import Floats, Ints, TreeModel


class BarePoleWarning(UserWarning):
    """The parameters may grow a pole without branches."""


class Support(NamedTuple):
    """What an axis is tied to.

    Attributes
    ----------
    direction : (3,) array
        Unit vector that new metamers of the axis are pulled along.
    weight : float
        How strongly, beside the weights of bud, light and vertical.
    last_year : int
        Year of growth after which the support is gone.
    """

    direction: Floats
    weight: float
    last_year: int


class Event(Protocol):
    """Something done to a tree after a year of growth; year 0 is before the first."""

    @property
    def year(self) -> int:
        """The year after whose growth it is done."""

    def apply(self, growth: Growth) -> object:
        """Do it."""


class Growth:
    """A tree, its light, and what has happened to it.

    Parameters
    ----------
    metamers : Metamers
        The tree to start from; it is changed in place.
    options : GrowthOptions
    seed : int
        The same seed gives the same tree.
    shade : Shade, optional
        Neighbours and buildings.

    Attributes
    ----------
    metamers : Metamers
        Do not change their number or positions but by `remove`, which keeps the light right.
    light : Light
    year : int
        Years grown so far; 0 before the first.
    log : list of Entry
        `YearReport`, `Removal` and what operations add of their own, in order.
    supports : list of Support
        Numbered as in `metamers.support`.
    resource : Resource or None
        What every bud got in the last year, in numbers of that year before its shoots were shed.

    Warns
    -----
    BarePoleWarning
        If the parameters let no lateral bud grow in good light.
    """

    def __init__(
        self, metamers: Metamers, options: GrowthOptions, *, seed: int, shade: Shade | None = None
    ) -> None:
        if (reason := bare_pole(options)) is not None:
            warnings.warn(reason, BarePoleWarning, stacklevel=2)
        self.metamers, self.options, self.seed = metamers, options, seed
        self.year = 0
        self.log: list[Entry] = []
        self.supports: list[Support] = []
        self.resource: Resource | None = None
        sow(metamers, seed)
        self.light: Light = light_for(options, seed, metamers.end[0].copy(), shade)
        self.light.add(metamers.end[: metamers.count])

    def grow_year(self) -> YearReport:
        """Grow for a year.

        Raises
        ------
        UsageError
            If there would be more metamers than `most_metamers`; the tree is as it was.
        """
        tree, options, year = self.metamers, self.options, self.year + 1
        lit = self.light.at_buds(tree)
        gathered = gather(tree, lit)
        share = by_priority if _is_by_priority(options, year) else by_borchert_honda
        resource = share(tree, gathered, options)
        buds = buds_that_grow(tree, resource, year, options)
        self._check_number(int(buds.metamers.sum()), year)
        towards = self.light.towards(tree, buds.metamer, buds.is_lateral)
        grown = grow_shoots(tree, buds, towards, self._pulls(year), year, options)
        self.light.add(tree.end[grown])
        self.year, self.resource = year, resource.for_more(len(tree))
        shed = self._drop(shaded_out(tree, gathered, year, options))
        thicken(tree, options)
        report = YearReport(
            year,
            gathered.total,
            resource.root,
            grown.stop - grown.start,
            int((shed < 0).sum()),
            len(tree) - 1,
        )
        self.log.append(report)
        return report

    def remove(self, metamer: int | ArrayLike) -> Removal:
        """Cut off a metamer, or several, with all that they bear.

        The light is what it would be had they never grown, to the bit. The buds that they grew from are
        damaged. The metamers that stay keep their order and close the gaps; the removal tells their new
        numbers.

        Parameters
        ----------
        metamer : int or (K,) array_like of int
            Where to cut; never the foot.

        Raises
        ------
        UsageError
            If a metamer is not there, or is the foot.
        """
        cut = np.unique(np.asarray(metamer, dtype=np.int32))
        wrong = cut[(cut < 1) | (cut >= len(self.metamers))]
        if len(wrong):
            msg = (
                f"metamer {wrong[0]} cannot be cut off: the tree has the metamers 1 to "
                f"{len(self.metamers) - 1} above its foot; choose one of them"
            )
            raise UsageError(msg)
        number = self._drop(cut)
        removal = Removal(self.year, tuple(cut.tolist()), int((number < 0).sum()), number)
        self.log.append(removal)
        return removal

    def tie(self, metamer: int, direction: ArrayLike, *, weight: float, years: int | None = None) -> Support:
        """Tie an axis, from one of its metamers on, to a support.

        Parameters
        ----------
        metamer : int
        direction : (3,) array_like
            Where new metamers of the axis are pulled to.
        weight : float
            How strongly, beside the weights of bud, light and vertical.
        years : int, optional
            How many years from now; without it for ever.
        """
        way = np.asarray(direction, dtype=np.float64)
        last = self.year + years if years is not None else np.iinfo(np.int32).max
        support = Support(way / np.linalg.norm(way), weight, int(last))
        self.metamers.support[self.metamers.axis(metamer)] = len(self.supports)
        self.supports.append(support)
        return support

    def to_model(self) -> TreeModel:
        """Return the tree as it is now."""
        known = {
            "method": "organic",
            "seed": self.seed,
            "years": self.year,
            "metamers": len(self.metamers) - 1,
        }
        return self.metamers.to_model(metadata=known)

    def _drop(self, cut: Ints) -> Ints:
        """Remove subtrees from light and tree; the new number of every metamer."""
        tree = self.metamers
        if not len(cut):
            return np.arange(len(tree), dtype=np.int32)
        gone = tree.subtree(cut)
        self.light.remove(tree.end[: len(tree)][gone])
        if self.resource is not None:
            self.resource = self.resource.of(~gone)
        return tree.keep(~gone)

    def _pulls(self, year: int) -> Floats:
        """(S + 1, 3) pull of every support this year; the last row answers for no support."""
        pulls = np.zeros((len(self.supports) + 1, 3))
        for pull, support in zip(pulls, self.supports, strict=False):
            if year <= support.last_year:
                pull[:] = support.weight * support.direction
        return pulls

    def _check_number(self, more: int, year: int) -> None:
        wanted, most = len(self.metamers) - 1 + more, self.options.most_metamers
        if wanted > most:
            msg = (
                f"growth stops before year {year}: the tree would have {wanted:,} metamers, more than "
                f"most_metamers, {most:,}; raise it, grow for fewer years or lower alpha"
            )
            raise UsageError(msg)


def grow(options: GrowthOptions, years: int, *, seed: int, events: Iterable[Event] = ()) -> Growth:
    """Grow a tree from a single bud.

    Parameters
    ----------
    options : GrowthOptions
    years : int
    seed : int
        The same seed gives the same tree.
    events : iterable of Event
        Each is done after the growth of its year; those of a year in the order given.

    Raises
    ------
    UsageError
        If years are negative, an event lies beyond them, or there would be too many metamers.

    References
    ----------
    Palubicki et al. (2009), "Self-organizing tree models for image synthesis". Changed, after a thesis on
    pruning built on it: lateral buds wait for the terminal one and need more, damaged buds hand down what
    they cannot use, the direction of growth points away from shade, and a cut opens the light again.
    """
    due = list(events)
    late = [event.year for event in due if not 0 <= event.year <= years]
    if years < 0 or late:
        what = f"an event of year {late[0]} in" if late else "growth for"
        msg = f"{what} {years} years is not possible; give years from 0 on that hold all events"
        raise UsageError(msg)
    growth = Growth(Metamers.one_bud(), options, seed=seed)
    for year in range(years + 1):
        if year:
            growth.grow_year()
        for event in due:
            if event.year == year:
                event.apply(growth)
    return growth


def _is_by_priority(options: GrowthOptions, year: int) -> bool:
    return options.allocation == "priority" and (not options.switch_year or year <= options.switch_year)
