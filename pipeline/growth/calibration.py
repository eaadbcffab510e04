"""Growth parameters that make an earlier tree grow as large as a later acquisition shows it."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from pydantic import Field
from scipy.stats.qmc import Halton

from pipeline.errors import ModelError, UsageError
from pipeline.growth.carrying import Carrying, through
from pipeline.growth.options import GrowthOptions
from pipeline.growth.outlook import crown_area
from pipeline.growth.simulation import BarePoleWarning, Event
from pipeline.model import Floats, TreeModel
from pipeline.options import Options

MEASURES = ("height_m", "dbh_m", "crown_m")
FITTED = ("alpha", "dominance", "metamer_m", "shed_threshold")
"""The parameters that are fitted."""
LOW, HIGH = np.array([0.8, 0.42, 0.02, 0.0]), np.array([5.0, 0.60, 1.5, 0.40])
"""Between what is sought: alpha, dominance, pace and shed_threshold.

The pace, alpha times metamer_m, is about what a leader grows in a year, metres: at one
pace the height stays, and alpha decides how much branches.
"""
ALPHA, PACE = 0, 2
IS_LOG = np.array([True, False, True, False])
"""Which of them are searched by ratio."""
SHORTEST_M, LONGEST_M = 0.03, 0.50
"""Metamers are not sought beyond."""
LEAST_GROWTH = 0.02
"""Growth by less than this share of the size is scored as if it were this."""
FIRST_STEP, LAST_STEP = 0.30, 0.02
"""Standard deviation of the search's steps, as a share of the range, at first and in the end."""
TRACKS, SHARED = 3, 0.6
"""How many of the best places are followed up in turns, for which share of the steps; then the best alone."""
DRIFT = 1e-3
"""Price of leaving the start, so that what does not matter stays as it was."""
MOST_METAMERS = 200_000


class SearchOptions(Options):
    """How long is searched, and with which chances."""

    trials: int = Field(100, ge=1, le=10_000, description="growths that are tried")
    seed: int = Field(0, ge=0, description="of search and growth; the same seed finds the same")
    scattered: float = Field(
        0.3, ge=0, le=1, description="share of them anywhere in the ranges, before the search closes in"
    )


class Size(NamedTuple):
    """How large a tree is: height above ground, diameter at breast height (NaN: unknown), crown diameter."""

    height_m: float
    dbh_m: float
    crown_m: float


class Calibration(NamedTuple):
    """What came of a fit.

    Attributes
    ----------
    options : GrowthOptions
        The best found.
    earlier, later, reached : Size
        The two acquisitions, and the earlier tree grown with `options`.
    trials : int
        Growths that were tried.
    """

    options: GrowthOptions
    earlier: Size
    later: Size
    reached: Size
    trials: int

    def errors(self) -> dict[str, float]:
        """Return what remains of each measure, as a share of its growth between the acquisitions."""
        left = np.abs(np.subtract(self.reached, self.later)) / scales(self.earlier, self.later)
        return dict(zip(MEASURES, left.tolist(), strict=True))


def size_of(tree: TreeModel) -> Size:
    """Return how large a tree is: by its points where metadata tell, else by its nodes."""
    known, xyz = tree.metadata, tree.skeleton.xyz
    ground = known.get("ground_z", tree.trunk.ground_z if tree.trunk else xyz[0, 2])
    area = known.get("crown_area_m2")
    area = crown_area(xyz) if area is None else area
    dbh = tree.trunk.dbh_m if tree.trunk and tree.trunk.dbh_m is not None else np.nan
    top = known.get("top_z", xyz[:, 2].max())
    return Size(float(top - ground), float(dbh), float(2.0 * np.sqrt(area / np.pi)))


def scales(earlier: Size, later: Size) -> Floats:
    """(3,) growth of each measure, or a small share of its size where that is more."""
    grown = np.abs(np.subtract(later, earlier))
    return np.asarray(np.maximum(grown, LEAST_GROWTH * np.array(later)))


def calibrate(
    tree: TreeModel,
    later: Size,
    years: int,
    *,
    start: GrowthOptions | None = None,
    events: Iterable[Event] = (),
    search: SearchOptions | None = None,
) -> Calibration:
    """Fit alpha, dominance, metamer length and shedding to what a tree has become.

    Parameters
    ----------
    tree : TreeModel
        The earlier acquisition.
    later : Size
        Of the later one.
    years : int
        Between the two, at least 1.
    start : GrowthOptions, optional
        Where the search begins, and all that is not fitted. Voxels keep their ratio to the metamers.
    events : iterable of Event
        What is done to the tree meanwhile.
    search : SearchOptions, optional

    Raises
    ------
    ModelError
        If the tree has no radii.
    UsageError
        If years are below 1, or nothing could be grown.

    Notes
    -----
    Without derivatives, as the number of metamers of a shoot is whole: trials all over the ranges, then steps
    that become shorter about the best three of them, and in the end about the best. What counts is the
    squared error of the growth in height, diameter and crown, each as a share of the growth; a measure that
    one of the acquisitions lacks does not count.
    """
    if years < 1:
        msg = f"{years} years lie between the acquisitions; growth needs one at least"
        raise UsageError(msg)
    start, search, due = start or GrowthOptions(), search or SearchOptions(), tuple(events)
    earlier = size_of(tree)
    wanted, scale = np.array(later), scales(earlier, later)
    counts = np.isfinite(wanted) & np.isfinite(scale)
    if not counts.any():
        msg = "neither height nor crown nor diameter of the two acquisitions is known; give better ones"
        raise ModelError(msg)

    def cost(at: Floats) -> tuple[float, Size | None]:
        reached = _grown(tree, options_at(at, start), years, due, search.seed)
        if reached is None:
            return np.inf, None
        off = (np.array(reached) - wanted)[counts] / scale[counts]
        return float(off @ off) + DRIFT * float(((at - origin) ** 2).sum()), reached

    origin = place_of(start)
    grown = max((later.height_m - earlier.height_m) / years, 0.0)
    likely = origin.copy()
    if grown > 0.0:
        likely[PACE] = np.clip(_scaled(grown, PACE), 0.0, 1.0)
    best, reached = searched(cost, (origin, likely), search)
    if reached is None:
        msg = f"no parameters within the ranges let the tree grow for {years} years; check the earlier model"
        raise UsageError(msg)
    return Calibration(options_at(best, start), earlier, later, reached, search.trials)


def searched(
    cost: Callable[[Floats], tuple[float, Size | None]],
    starts: Sequence[Floats],
    search: SearchOptions,
) -> tuple[Floats, Size | None]:
    """Return the place in the unit cube with the least cost that was found, and what it reached."""
    chance = np.random.default_rng(search.seed)
    count = len(starts[0])
    scattered = round(search.scattered * search.trials)
    anywhere = [*starts, *Halton(count, rng=chance).random(scattered)][: search.trials]
    found = [(*cost(at), at) for at in anywhere]
    tracks = sorted(found, key=lambda one: one[0])[:TRACKS]
    left = search.trials - len(found)
    for trial in range(left):
        part = trial / left
        track = trial % len(tracks) if part < SHARED else 0
        step = FIRST_STEP * (LAST_STEP / FIRST_STEP) ** part
        which = chance.random(count) < 0.5
        off = step * chance.standard_normal(count)
        at = np.clip(tracks[track][2] + np.where(which | ~which.any(), off, 0.0), 0.0, 1.0)
        value, size = cost(at)
        if value < tracks[track][0]:
            tracks[track] = value, size, at
        if part >= SHARED - 1.0 / left:
            tracks.sort(key=lambda one: one[0])
    _, reached, best = min(tracks, key=lambda one: one[0])
    return best, reached


def place_of(options: GrowthOptions) -> Floats:
    """(4,) place of options in the unit cube of what is sought."""
    value = (options.alpha, options.dominance, options.alpha * options.metamer_m, options.shed_threshold)
    return np.clip([_scaled(v, i) for i, v in enumerate(value)], 0.0, 1.0)


def options_at(at: Floats, start: GrowthOptions) -> GrowthOptions:
    """Return the options at a place in the unit cube; else those of the start."""
    value = np.where(IS_LOG, LOW ** (1.0 - at) * HIGH**at, LOW + at * (HIGH - LOW)).tolist()
    value[PACE] = min(max(value[PACE] / value[ALPHA], SHORTEST_M), LONGEST_M)
    fitted = {name: round(v, 5) for name, v in zip(FITTED, value, strict=True)}
    voxel = float(np.clip(start.voxel_m * fitted["metamer_m"] / start.metamer_m, 0.01, 2.0))
    return GrowthOptions.model_validate({**start.model_dump(), **fitted, "voxel_m": round(voxel, 5)})


def _scaled(value: float, which: int) -> float:
    """Return where between its ends a value is, by ratio where that is how it is sought."""
    low, high = LOW[which], HIGH[which]
    if IS_LOG[which]:
        value, low, high = np.log(value), np.log(low), np.log(high)
    return float((value - low) / (high - low))


def _grown(
    tree: TreeModel, options: GrowthOptions, years: int, events: Iterable[Event], seed: int
) -> Size | None:
    """Return the size of a tree after some years; None where it became too many metamers."""
    least = min(options.most_metamers, MOST_METAMERS)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", BarePoleWarning)
            growth = Carrying(tree, options.model_copy(update={"most_metamers": least}), seed=seed)
            for _ in through(growth, years, events):
                pass
        return size_of(growth.to_model())
    except UsageError:
        return None
