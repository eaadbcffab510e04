"""Growth fitted to two acquisitions of a tree: read, reconstructed, searched, and written as TOML."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pipeline.config import Config
from pipeline.growth import GrowthOptions
from pipeline.growth.calibration import FITTED, MEASURES, Calibration, SearchOptions, calibrate, size_of
from pipeline.growth.lost import Cut, lost_wood
from pipeline.jobs.naming import named
from pipeline.jobs.standing import read_either, with_radii, wood_points
from pipeline.model import Floats, PointCloud, TreeModel
from pipeline.output import write_text
from pipeline.run import reconstruct

APART_M = 1.0
"""Feet farther apart than this are not of one tree in one reference system."""
UNITS = {
    "height_m": ("height", "m", 1.0),
    "dbh_m": ("DBH", "cm", 100.0),
    "crown_m": ("crown width", "m", 1.0),
}


class Acquisition(NamedTuple):
    """A tree at a date: its model, and points of its wood in their reference system."""

    path: Path
    tree: TreeModel
    points: Floats


class Fit(NamedTuple):
    """What a calibration found, the cuts that it took for granted, and a note where none could be sought."""

    found: Calibration
    cuts: tuple[Cut, ...]
    note: str | None
    origin: Floats


def acquire(path: Path, config: Config) -> Acquisition:
    """Read a model, or reconstruct the tree of a cloud.

    Raises
    ------
    InputFormatError
        If the file holds a skeleton without radii.
    """
    with named(path):
        held = read_either(path)
        if isinstance(held, PointCloud):
            return Acquisition(path, reconstruct(held, config), wood_points(held))
        return Acquisition(path, with_radii(held, path), wood_points(held))


def fit_growth(
    earlier: Acquisition,
    later: Acquisition,
    years: int,
    *,
    start: GrowthOptions,
    search: SearchOptions,
) -> Fit:
    """Propose cuts where the later acquisition lacks wood; fit growth as if they were made at the start."""
    tree, origin = earlier.tree, earlier.tree.skeleton.origin
    apart = float(np.linalg.norm(tree.skeleton.world[0] - later.tree.skeleton.world[0]))
    note, cuts = None, tuple[Cut, ...]()
    if apart <= APART_M:
        cuts = lost_wood(tree, later.points - origin)
    else:
        note = f"the feet are {apart:.1f} m apart, so lost wood is not sought; bring both into one system"
    with named(earlier.path):
        found = calibrate(tree, size_of(later.tree), years, start=start, events=cuts, search=search)
    return Fit(found, cuts, note, origin)


def write_parameters(fit: Fit, path: Path, about: Sequence[str]) -> None:
    """Write parameters as TOML that `--params` reads: what was fitted, and all else that is no default.

    Parameters
    ----------
    fit : Fit
    path : Path
    about : sequence of str
        Lines of comment for the head of the file.
    """
    options, fields = fit.found.options, GrowthOptions.model_fields
    defaults = GrowthOptions().model_dump()
    lines = [f"# {line}" for line in (*about, *report_lines(fit))]
    for name, value in options.model_dump().items():
        if name in FITTED or value != defaults[name]:
            shown = f'"{value}"' if isinstance(value, str) else repr(value)
            fitted = "fitted: " if name in FITTED else ""
            lines.append(f"# {fitted}{fields[name].description}\n{name} = {shown}")
    write_text(path, "\n".join(lines) + "\n")


def events_path(path: Path) -> Path:
    """Return the file of proposed cuts beside one of parameters: ``oak.events.toml`` of ``oak.toml``."""
    return path.with_name(f"{path.stem}.events.toml")


def write_events(fit: Fit, path: Path) -> None:
    """Write the proposed cuts as events, positions in the reference system of the earlier acquisition."""
    head = "# Wood that the later acquisition lacks, proposed as cuts; the year is assumed to be the first.\n"
    write_text(path, head + "\n".join(event_table(cut, fit.origin) for cut in fit.cuts))


def event_table(cut: Cut, origin: Floats) -> str:
    """Return one proposed cut as a table of an event file."""
    position = ", ".join(f"{value:.4f}" for value in (cut.position + origin).tolist())
    return (
        f"# {cut.length_m:.1f} m of wood, {100.0 * cut.diameter_m:.1f} cm thick at the cut\n"
        f'[[event]]\nyear = {cut.year}\noperation = "cut-to-bud"\nposition = [{position}]\n'
    )


def report_lines(fit: Fit) -> Iterator[str]:
    """Yield what was fitted to what, and what remains, line by line."""
    found = fit.found
    errors = found.errors()
    yield f"{'':12} {'earlier':>9} {'later':>9} {'reached':>9} {'error':>9} {'of growth':>9}"
    for name in MEASURES:
        label, unit, factor = UNITS[name]
        sizes = [factor * getattr(size, name) for size in (found.earlier, found.later, found.reached)]
        if not np.isfinite(sizes).all():
            yield f"{label:12} not known in both acquisitions"
            continue
        shown = " ".join(f"{value:>9.2f}" for value in (*sizes, sizes[2] - sizes[1]))
        yield f"{label:12} {shown} {errors[name]:>9.0%} ({unit})"
    if fit.note:
        yield fit.note
