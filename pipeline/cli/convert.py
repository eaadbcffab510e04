"""`treepipe convert`: one model, another format."""

from __future__ import annotations

import logging
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli import options
from pipeline.errors import InputFormatError, UsageError

if TYPE_CHECKING:
    from pipeline.config import Config

SURFACES = (".mesh.ply", ".obj", ".glb")
SETTINGS = {
    "profile": {".lstring": "lstring.profile", ".city.json": "cityjson.profile"},
    "union": dict.fromkeys(SURFACES, "mesh.union"),
    "leaves": dict.fromkeys(SURFACES, "mesh.leaves"),
    "skeleton_object": {".city.json": "cityjson.skeleton_object"},
}
"""The setting that an option stands for, by the suffix of what is written."""

SAID = {"crs": "the CRS", "trunk": "the diameter at breast height"}
"""What a format cannot hold, in words."""
log = logging.getLogger("treepipe")


@click.command("convert")
@click.argument("source", metavar="IN", type=options.FILE)
@click.argument("target", metavar="OUT", type=options.FILE)
@click.option(
    "--profile",
    metavar="P",
    help="Of an .lstring: abop (the bare string), lpy (a .lpy file), groimp (an .rgg file, for small trees), "
    "houdini (a rule file). Of a .city.json: default, extension or compact.",
)
@click.option("--union", is_flag=True, help="Join all branches of a surface (.mesh.ply .obj .glb) into one.")
@click.option(
    "--leaves", type=click.Choice(["quads", "crosses"]), help="Draw leaves at the tips of a surface."
)
@click.option("--skeleton-object", is_flag=True, help="A .city.json tells its skeleton as lines, too.")
@options.settings
@options.overwrite
@options.messages
def command(source: Path, target: Path, config: Config, overwrite: bool, **given: Any) -> None:
    """Turn IN, any model that treepipe reads, into OUT; the suffixes name the formats.

    One tree of many is named behind its file: park.lsjson.jsonl.zst#oak, park.city.jsonl#oak. What OUT
    cannot hold is said.
    """
    from pipeline.exchange import format_of, read_model
    from pipeline.model import TreeModel

    to = format_of(target)
    options.check_target(target, (to.suffix,), overwrite=overwrite)
    config = _with(config, to.suffix, **given)
    tree = read_model(source)
    options.warn_if_flat(source, tree)
    options.tell_cylinders(source, tree)
    if not isinstance(tree, TreeModel):
        msg = f"{source}: is a skeleton without radii; measure them first with `treepipe fit`"
        raise InputFormatError(msg)
    to.write(tree, target, config)
    lost = [SAID.get(what, what) for what in to.loses if what != "crs" or tree.skeleton.crs]
    if lost:
        log.warning("%s does not hold %s", target, ", ".join(lost))
    click.echo(target)


def _with(config: Config, suffix: str, **given: Any) -> Config:
    """Return the config with what the options say; each has its formats."""
    for name, value in given.items():
        if not value:
            continue
        option = f"--{name.replace('_', '-')}"
        setting = SETTINGS[name].get(suffix)
        if setting is None:
            msg = f"{option}: files that end in {suffix} have none; it is for {', '.join(SETTINGS[name])}"
            raise UsageError(msg)
        try:
            config = config.with_settings([f"{setting}={str(value).lower()}"])
        except UsageError as error:
            msg = f"{option} {value}: {str(error).removeprefix('--set: ')}"
            raise UsageError(msg) from None
    return config
