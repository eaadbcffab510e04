"""`treepipe simulate`: a tree through the years."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli import growth, options
from pipeline.cli.logs import LOGGER

if TYPE_CHECKING:
    from pipeline.growth import GrowthOptions
    from pipeline.model import TreeModel


@click.command("simulate")
@click.argument("model", type=options.FILE, required=False)
@click.option("--years", type=click.IntRange(0, 1000), required=True, metavar="N", help="How long.")
@growth.seed
@growth.parameters
@growth.events
@click.option(
    "--shade", type=options.FILE, metavar="FILE", help="A cloud or model of what stands around: static shade."
)
@click.option("--light", type=click.Choice(["shadow", "space"]), help="Model of light.")
@click.option("--allocation", type=click.Choice(["bh", "priority"]), help="How resource is shared.")
@click.option(
    "-o", "--out", type=options.FILE, required=True, metavar="DIR", help="Where the years are written."
)
@click.option(
    "--every", type=click.IntRange(1), default=5, show_default=True, metavar="K", help="Years between models."
)
@options.formats(usual="lsjson")
@click.option("--picture/--no-picture", default=True, help="Draw the years, and a film.  [default: picture]")
@options.overwrite
@options.messages
def command(model: Path | None, overwrite: bool, **given: Any) -> None:
    """Let a tree grow for some years: MODEL, a reconstructed tree, or without it a bud.

    DIR gets a model and a picture of every K-th year and of the last one, growth.gif, the film of them, and
    years.json, the log.
    """
    from pipeline.exchange import parse_formats
    from pipeline.jobs.simulation import Simulation, bud
    from pipeline.jobs.standing import read_shade, read_tree

    formats, shade = given.pop("formats"), given.pop("shade")
    how, events = given.pop("how"), growth.read_events(given.pop("events"), given["years"])
    plan = Simulation(
        options=_with(how, light=given.pop("light"), allocation=given.pop("allocation")),
        formats=parse_formats(formats) if formats is not None else ("lsjson",),
        events=events,
        **given,
    )
    if not overwrite:
        plan.check_free()
    if model is not None:
        growth.check_model(model)
    start = bud() if model is None else read_tree(model)
    if model is not None:
        options.warn_if_flat(model, start)
    if shade is not None:
        from dataclasses import replace

        plan = replace(plan, shade=read_shade(shade, start.skeleton.origin))
    growth.check_writable(plan.out)
    _simulate(model, start, plan)


@growth.tell_of_poles
def _simulate(model: Path | None, start: TreeModel, plan: Any) -> None:
    from pipeline.jobs.naming import named
    from pipeline.jobs.simulation import simulate

    with nullcontext() if model is None else named(model):
        log = simulate(start, plan, warn=lambda text: LOGGER.warning("%s", text))
    for year in log["models"]:
        dbh = "" if year["dbh_cm"] is None else f", DBH {year['dbh_cm']:.1f} cm"
        click.echo(
            f"year {year['year']}: {year['height_m']:.2f} m high{dbh}, {year['volume_l']:.1f} l, "
            f"{year['length_m']:.1f} m of wood, {year['branches']} branches"
        )
    click.echo(f"the files are in {plan.out}/")


def _with(how: GrowthOptions, **named: str | None) -> GrowthOptions:
    """Return options in which some have been named apart."""
    return how.model_copy(update={key: value for key, value in named.items() if value is not None})
