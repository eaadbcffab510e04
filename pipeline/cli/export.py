"""`treepipe export`: a model in other formats."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from pipeline.cli import options
from pipeline.errors import InputFormatError, OutputError, OutputExistsError

if TYPE_CHECKING:
    from pipeline.config import Config


@click.command("export")
@click.argument("model", type=options.FILE)
@click.option(
    "-o", "--out", "folder", type=options.FILE, required=True, metavar="DIR", help="Where to write."
)
@options.formats()
@options.settings
@options.overwrite
@options.messages
def command(model: Path, folder: Path, formats: str | None, config: Config, overwrite: bool) -> None:
    """Write MODEL, any tree that treepipe reads, in other formats into a folder."""
    from pipeline.exchange import DEFAULT_FORMATS, FORMATS, parse_formats, read_model, stem_of
    from pipeline.model import TreeModel

    names = parse_formats(formats) if formats is not None else DEFAULT_FORMATS
    targets = {name: folder / f"{stem_of(model)}{FORMATS[name].suffix}" for name in names}
    if folder.is_file():
        msg = f"{folder}: is a file, and no folder can be made there; choose another one with -o"
        raise OutputError(msg)
    for target in targets.values():
        if target.exists() and not overwrite:
            msg = f"{target}: exists already; add --overwrite or choose another folder with -o"
            raise OutputExistsError(msg)
    tree = read_model(model)
    options.warn_if_flat(model, tree)
    options.tell_cylinders(model, tree)
    if not isinstance(tree, TreeModel):
        msg = f"{model}: is a skeleton without radii; measure them first with `treepipe fit`"
        raise InputFormatError(msg)
    for name, target in targets.items():
        FORMATS[name].write(tree, target, config)
        click.echo(target)
