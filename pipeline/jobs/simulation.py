"""A tree through the years: models, pictures, a film and a log of every year."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.config import Config
from pipeline.errors import OutputExistsError
from pipeline.exchange import FORMATS
from pipeline.growth import Event, GrowthOptions, Shade, YearReport
from pipeline.growth.carrying import Carrying, through
from pipeline.growth.outlook import events_of, name_of
from pipeline.model import ALLOMETRIC, Skeleton, TreeModel
from pipeline.output import write_text
from pipeline.report import report
from pipeline.version import __version__
from pipeline.view.graphics import NoGraphicsError
from pipeline.view.years import box_of, draw_year, film

LOG, FILM = "years.json", "growth.gif"
FIGURES = (
    "height_m",
    "crown_diameter_m",
    "dbh_cm",
    "dbh_lo_cm",
    "dbh_hi_cm",
    "volume_l",
    "length_m",
    "branches",
)


@dataclass(frozen=True)
class Simulation:
    """How a tree is carried through the years, and what is written of it.

    Parameters
    ----------
    out : Path
        Made if need be.
    options : GrowthOptions
    years : int
    seed : int
    every : int
        Years from one model to the next; the last year always has one.
    formats : tuple of str
        Names of `pipeline.exchange.FORMATS`.
    species : str, optional
        Noted in the models.
    events : tuple of Event
    shade : Shade, optional
        Relative to the tree's origin.
    picture : bool
        Draw every model, and a film of them.
    """

    out: Path
    options: GrowthOptions
    years: int
    seed: int = 0
    every: int = 5
    formats: tuple[str, ...] = ("lsjson",)
    species: str | None = None
    events: tuple[Event, ...] = ()
    shade: Shade | None = None
    picture: bool = True

    def check_free(self) -> None:
        """Make sure that nothing would be written over unasked.

        Raises
        ------
        OutputExistsError
            If the folder holds years already.
        """
        here = sorted(self.out.glob("year_*")) if self.out.is_dir() else []
        for path in (self.out / LOG, *here):
            if path.exists():
                msg = f"{path}: exists already; add --overwrite or choose another folder with -o"
                raise OutputExistsError(msg)

    def path(self, year: int, suffix: str) -> Path:
        """Return the file of a year with this suffix."""
        return self.out / f"year_{year:03d}{suffix}"


@dataclass
class _Record:
    """What is kept of the years for the log and the film."""

    models: list[dict[str, Any]] = field(default_factory=list)
    trees: list[tuple[int, TreeModel]] = field(default_factory=list)
    heights: list[float] = field(default_factory=list)


def simulate(start: TreeModel, plan: Simulation, *, warn: Callable[[str], None]) -> dict[str, Any]:
    """Carry a tree through the years and write what the plan asks for.

    Parameters
    ----------
    start : TreeModel
        A reconstructed tree, or `bud`.
    plan : Simulation
    warn : callable
        Told what is missing though the models are there: pictures on a machine that cannot draw.

    Returns
    -------
    dict
        As written to years.json.

    Raises
    ------
    UsageError
        If the years are out of range or the tree would have too many metamers.
    OutputError
        If a file cannot be written.
    """
    growth = Carrying(start, plan.options, seed=plan.seed, shade=plan.shade)
    record = _Record()
    try:
        for year in through(growth, plan.years, plan.events):
            held = growth.metamers.held()
            record.heights.append(float(held["end"][:, 2].max() - held["end"][0, 2]))
            if year % plan.every == 0 or year == plan.years:
                _write(growth, plan, record)
    finally:
        log = _log(growth, plan, record)
        if record.models:  # else what stopped the growth leaves nothing behind
            write_text(plan.out / LOG, json.dumps(log, indent=1, allow_nan=False) + "\n")
    if plan.picture and record.trees:
        try:
            _draw(plan, record)
        except NoGraphicsError as error:
            warn(f"no pictures: {error}")
    return log


def bud() -> TreeModel:
    """Return the tree before its first year: a bud at the zero of coordinates."""
    one = np.zeros(1)
    source = np.full(1, ALLOMETRIC, dtype=np.uint8)
    return TreeModel(
        Skeleton(np.zeros((1, 3)), np.array([-1], dtype=np.int32)), one + 1e-4, source, one + np.nan
    )


def _write(growth: Carrying, plan: Simulation, record: _Record) -> None:
    """Write the models of a year; a bud has none."""
    tree = growth.to_model(known={} if plan.species is None else {"species": plan.species})
    if len(tree) < 2:
        return
    for name in plan.formats:
        chosen = FORMATS[name]
        chosen.write(tree, plan.path(growth.year, chosen.suffix), Config())
    known = report(tree).to_dict()
    files = [plan.path(growth.year, FORMATS[name].suffix).name for name in plan.formats]
    record.models.append({"year": growth.year, "files": files, **{key: known[key] for key in FIGURES}})
    record.trees.append((growth.year, tree))


def _draw(plan: Simulation, record: _Record) -> None:
    """Draw the years at one scale; what has come since the year drawn before is green."""
    box = box_of([tree for _, tree in record.trees])
    before = None
    frames = []
    for (year, tree), known in zip(record.trees, record.models, strict=True):
        dbh = "" if known["dbh_cm"] is None else f",  DBH {known['dbh_cm']:.1f} cm"
        frames.append(plan.path(year, ".png"))
        title = f"year {year}:  {record.heights[year]:.1f} m{dbh}"
        draw_year(tree, frames[-1], before=before, box=box, title=title)
        before = tree
    film(frames, plan.out / FILM)


def _log(growth: Carrying, plan: Simulation, record: _Record) -> dict[str, Any]:
    years = [entry for entry in growth.log if isinstance(entry, YearReport)]
    defaults = GrowthOptions().model_dump()
    options = {key: value for key, value in plan.options.model_dump().items() if value != defaults[key]}
    return {
        "years": plan.years,
        "done": growth.year,
        "seed": plan.seed,
        "species": plan.species,
        "options": options,
        "start": {"metamers": growth.scanned_metamers, "height_m": _figure(record.heights[:1])},
        "log": [
            {**asdict(entry), "height_m": _figure(record.heights[entry.year : entry.year + 1])}
            for entry in years
        ],
        "events": list(_events(growth)),
        "models": record.models,
        "version": __version__,
    }


def _events(growth: Carrying) -> Iterator[dict[str, Any]]:
    """Yield what was done to the tree, without the arrays."""
    for entry in events_of(growth.log):
        told = {key: value for key, value in vars(entry).items() if _is_plain(value)}
        yield {"what": name_of(entry), **told}


def _is_plain(value: Any) -> bool:
    if isinstance(value, tuple):
        return all(_is_plain(part) for part in value)
    return value is None or isinstance(value, str | int | float)


def _figure(values: Sequence[float]) -> float | None:
    return round(values[0], 6) if values else None
