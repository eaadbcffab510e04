"""`treepipe grow`: a tree some years on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from pydantic import ValidationError

from pipeline.cli import growth, options
from pipeline.errors import UsageError

if TYPE_CHECKING:
    from pipeline.growth import Event, GrowthOptions

MODEST = {"sprout_position": 2, "speed": 0.1, "ratio": 1.5, "thickness": 0.1}
"""Growth where none is described."""
ORGANIC = ("species", "params", "setting", "seed", "events")
"""Parameters of the command that go with the organic method alone."""


@click.command("grow")
@click.argument("file", type=options.FILE)
@options.lsystem_output
@click.option(
    "--method",
    type=click.Choice(["scale", "organic"]),
    default="scale",
    show_default=True,
    help="How it grows: everything longer and thicker, or new shoots where there is light.",
)
@click.option("--years", type=click.IntRange(0, 1000), required=True, help="How long.")
@click.option(
    "--sprout-position", type=int, metavar="P", help="Nodes from a tip to where it sprouts, 1 to 5; 0: none."
)
@click.option(
    "--speed", type=float, metavar="S", help="Share that a segment gains a year, 0.1 to 1; 0: none."
)
@click.option(
    "--ratio", type=float, metavar="R", help="Factor instead of it near tips, 1.5 to 5; 0: as elsewhere."
)
@click.option(
    "--thickness", type=float, metavar="T", help="Share that a radius gains a year, 0.1 to 0.8; 0: none."
)
@growth.parameters
@growth.seed
@growth.events
@options.overwrite
@options.messages
@click.pass_context
def command(
    context: click.Context, /, file: Path, target: Path, method: str, years: int, **given: Any
) -> None:
    """Grow FILE, an LsJSON, for some years.

    --method scale is that of 2021: shoots, longer segments, thicker wood. What is not given is off. With none
    of the four it is --sprout-position 2 --speed 0.1 --ratio 1.5 --thickness 0.1.

    --method organic lets shoots grow where there is light, as `simulate` does; the wood that stands stays
    where it is. It goes with --species, --params, --set, --seed and --events.
    """
    scale = {name: given.pop(name) for name in MODEST}
    chosen = {name: value for name, value in scale.items() if value is not None}
    _check_usage(context, method, chosen)
    options.check_target(target, options.LSYSTEM_SUFFIXES, overwrite=given.pop("overwrite"))
    from pipeline.jobs.documents import read_document
    from pipeline.jobs.naming import named
    from pipeline.lsystem import decode, write_lsjson

    events = growth.read_events(given.pop("events"), years)
    before = read_document(file)
    with named(file):
        small = decode(before)
        after = (
            _scaled(before, years, chosen)
            if method == "scale"
            else _organic(before, years, events=events, **given)
        )
        large = decode(after)
    options.warn_if_flat(file, small)
    write_lsjson(after, target)
    was, now = (tree.skeleton.length.sum() for tree in (small, large))
    click.echo(f"{target}: {len(small)} -> {len(large)} nodes, {was:.1f} -> {now:.1f} m of wood")


def _check_usage(context: click.Context, method: str, scale: Mapping[str, float]) -> None:
    """Refuse options of the other method."""
    source = click.core.ParameterSource.DEFAULT
    organic = [name for name in ORGANIC if context.get_parameter_source(name) is not source]
    wrong = list(scale) if method == "organic" else organic
    if wrong:
        other = "scale" if method == "organic" else "organic"
        name = "set" if wrong[0] == "setting" else wrong[0].replace("_", "-")
        msg = f"--{name} goes with --method {other}, not with {method}; leave it out or change the method"
        raise UsageError(msg)
    if method == "scale" and context.params["years"] == 0:
        msg = "--years 0: growth by scale needs a year at least; give 1 to 1000"
        raise UsageError(msg)


def _scaled(document: Mapping[str, Any], years: int, chosen: Mapping[str, float]) -> dict[str, Any]:
    from pipeline.lsystem import ScaleOptions, grow

    try:
        how = ScaleOptions.model_validate(chosen or MODEST)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        name = str(first["loc"][0]).replace("_", "-")
        msg = f"--{name} {first['input']}: {first['msg'].removeprefix('Value error, ').lower()}"
        raise UsageError(msg) from None
    return grow(document, years=years, options=how)


@growth.tell_of_poles
def _organic(
    document: Mapping[str, Any],
    years: int,
    *,
    how: GrowthOptions,
    species: str | None,
    seed: int,
    events: Sequence[Event],
) -> dict[str, Any]:
    from pipeline.lsystem import decode, encode
    from pipeline.run import grow_on

    del species  # an LsJSON does not tell it
    tree = grow_on(decode(document), how, years, seed=seed, events=events)
    return encode(tree)
