"""`treepipe grow`: a tree some years on."""

from __future__ import annotations

from pathlib import Path

import click
from pydantic import ValidationError

from pipeline.cli import options
from pipeline.errors import UsageError

MODEST = {"sprout_position": 2, "speed": 0.1, "ratio": 1.5, "thickness": 0.1}
"""Growth where none is described."""


@click.command("grow")
@click.argument("file", type=options.FILE)
@options.lsystem_output
@click.option(
    "--method", type=click.Choice(["scale"]), default="scale", show_default=True, help="How it grows."
)
@click.option("--years", type=click.IntRange(1, 1000), required=True, help="How long.")
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
@options.overwrite
@options.messages
def command(
    file: Path, target: Path, method: str, years: int, overwrite: bool, **given: float | None
) -> None:
    """Grow FILE, an LsJSON, by the method of 2021: shoots, longer segments, thicker wood.

    What is not given is off. With none of the four it is --sprout-position 2 --speed 0.1 --ratio 1.5
    --thickness 0.1.
    """
    del method  # there is one so far
    options.check_target(target, options.LSYSTEM_SUFFIXES, overwrite=overwrite)
    from pipeline.jobs.naming import named
    from pipeline.lsystem import ScaleOptions, decode, grow, read_lsjson, write_lsjson

    chosen = {name: value for name, value in given.items() if value is not None} or MODEST
    try:
        how = ScaleOptions.model_validate(chosen)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        name = str(first["loc"][0]).replace("_", "-")
        msg = f"--{name} {first['input']}: {first['msg'].removeprefix('Value error, ').lower()}"
        raise UsageError(msg) from None
    before = read_lsjson(file)
    with named(file):
        after = grow(before, years=years, options=how)
        small, large = decode(before), decode(after)
    options.warn_if_flat(file, small)
    write_lsjson(after, target)
    was, now = (tree.skeleton.length.sum() for tree in (small, large))
    click.echo(f"{target}: {len(small)} -> {len(large)} nodes, {was:.1f} -> {now:.1f} m of wood")
