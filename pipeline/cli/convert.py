"""`treepipe convert`: one model, another format."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pipeline.cli import options
from pipeline.errors import InputFormatError, UsageError

if TYPE_CHECKING:
    from pipeline.config import Config

PROFILES = {".lstring": "lstring.profile", ".city.json": "cityjson.profile"}
"""The setting that --profile stands for, by the suffix of what is written."""

log = logging.getLogger("treepipe")


@click.command("convert")
@click.argument("source", metavar="IN", type=options.FILE)
@click.argument("target", metavar="OUT", type=options.FILE)
@click.option(
    "--profile",
    metavar="P",
    help="Convention of an .lstring: abop (the bare string), lpy (a .lpy file), groimp (an .rgg file, for "
    "small trees), houdini (a rule file).",
)
@options.settings
@options.overwrite
@options.messages
def command(source: Path, target: Path, profile: str | None, config: Config, overwrite: bool) -> None:
    """Turn IN, any model that treepipe reads, into OUT; the suffixes name the formats.

    A tree of an archive is named behind its file: park.lsjson.jsonl.zst#oak. What OUT cannot hold is
    said.
    """
    from pipeline.exchange import format_of, read_model
    from pipeline.model import TreeModel

    to = format_of(target)
    options.check_target(target, (to.suffix,), overwrite=overwrite)
    if profile is not None:
        config = _with_profile(config, to.suffix, profile)
    tree = read_model(source)
    options.warn_if_flat(source, tree)
    if not isinstance(tree, TreeModel):
        msg = f"{source}: is a skeleton without radii; measure them first with `treepipe fit`"
        raise InputFormatError(msg)
    to.write(tree, target, config)
    lost = [what for what in to.loses if what != "the CRS" or tree.skeleton.crs]
    if lost:
        log.warning("%s does not hold %s", target, ", ".join(lost))
    click.echo(target)


def _with_profile(config: Config, suffix: str, profile: str) -> Config:
    if suffix not in PROFILES:
        msg = f"--profile {profile}: files that end in {suffix} have none; leave it out"
        raise UsageError(msg)
    try:
        return config.with_settings([f"{PROFILES[suffix]}={profile}"])
    except UsageError as error:
        msg = f"--profile {profile}: {str(error).removeprefix('--set: ')}"
        raise UsageError(msg) from None
