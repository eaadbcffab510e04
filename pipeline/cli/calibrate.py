"""`treepipe calibrate`: growth fitted to two acquisitions of a tree."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli import growth, options
from pipeline.cli.logs import LOGGER
from pipeline.errors import OutputExistsError

if TYPE_CHECKING:
    from pipeline.config import Config
    from pipeline.growth import GrowthOptions

ASSUMED = "the years between the acquisitions are as given to the command, not measured"


@click.command("calibrate")
@click.argument("earlier", type=options.FILE)
@click.argument("later", type=options.FILE)
@click.option(
    "--years", type=click.IntRange(1, 1000), required=True, metavar="N", help="Years between the two."
)
@options.output("a .toml file of parameters")
@click.option(
    "--trials", type=click.IntRange(1), default=100, show_default=True, metavar="N", help="Growths to try."
)
@growth.seed
@growth.species
@click.option("--config", type=options.FILE, metavar="F", help="Settings by which clouds are reconstructed.")
@options.overwrite
@options.messages
def command(
    earlier: Path, later: Path, target: Path, overwrite: bool, config: Path | None, **given: Any
) -> None:
    """Fit growth to what a tree was EARLIER and LATER: clouds, which are reconstructed, or models.

    alpha, dominance, metamer_m and shed_threshold are sought such that height, diameter and crown grow as
    they did. Wood that LATER lacks is proposed as cuts, in FILE.events.toml beside FILE.toml.
    """
    from pipeline.config import read_config
    from pipeline.jobs.calibration import events_path

    options.check_target(target, (".toml",), overwrite=overwrite)
    if events_path(target).exists() and not overwrite:
        msg = f"{events_path(target)}: exists already; add --overwrite or give another name with -o"
        raise OutputExistsError(msg)
    growth.check_model(earlier, later)
    _calibrate((earlier, later), target, read_config(config), **given)


@growth.tell_of_poles
def _calibrate(
    files: tuple[Path, Path],
    target: Path,
    config: Config,
    *,
    years: int,
    species: str | None,
    **search: int,
) -> None:
    from pipeline.growth.calibration import SearchOptions
    from pipeline.jobs.calibration import (
        acquire,
        events_path,
        fit_growth,
        report_lines,
        write_events,
        write_parameters,
    )

    start: GrowthOptions = growth.growth_options(species, None, ())
    how = SearchOptions(**search)
    for path in files:
        LOGGER.info("%s: is read", path)
    earlier, later = (acquire(path, config) for path in files)
    growth.check_writable(target.parent)
    fit = fit_growth(earlier, later, years, start=start, search=how)
    about = (
        f"Growth between {files[0].name} and {files[1].name}, {years} years ({ASSUMED}), "
        f"seed {how.seed}, {how.trials} trials.",
    )
    write_parameters(fit, target, about)
    for line in (*about, *report_lines(fit)):
        if line != fit.note:  # a warning
            click.echo(line)
    if fit.note:
        LOGGER.warning("%s", fit.note)
    if fit.cuts:
        write_events(fit, events_path(target))
        click.echo(f"{events_path(target)}: {len(fit.cuts)} cuts proposed, taken to be of the first year")
    click.echo(f"{target}: read it with `treepipe simulate --params {target}`")
