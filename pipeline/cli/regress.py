"""`treepipe regress`: references kept, and today's output checked against them."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pipeline.cli import options
from pipeline.errors import PipelineError, UsageError

if TYPE_CHECKING:
    from pipeline.config import Config

COULD_NOT_RUN = 3

refs = click.option(
    "--refs", "references", type=options.FILE, required=True, metavar="REFDIR", help="The references."
)


@click.group("regress")
def command() -> None:
    """Keep references of trees, and check today's output against them."""


@command.command("accept", short_help="Keep the trees of a run as references.")
@click.argument("models", type=options.FILE, metavar="MODELDIR")
@refs
@click.option("--only", metavar="NAME", help="Accept this tree alone.")
@click.option("--note", default="", metavar="TEXT", help="Why they are good.")
@options.messages
def accept(models: Path, references: Path, only: str | None, note: str) -> None:
    """Keep the trees of MODELDIR, the --out of a `treepipe run`, as references."""
    from pipeline.regression import accept as keep

    for name in keep(models, references, only=only, note=note):
        click.echo(references / name)


@command.command("run", short_help="Check today's output against the references.")
@refs
@click.option("--out", type=options.FILE, required=True, metavar="DIR", help="Where the reports go.")
@click.option("--clouds", type=options.FILE, metavar="DIR", help="Where the clouds are, by name.")
@click.option("--models", type=options.FILE, metavar="DIR", help="What today's run has written already.")
@click.option("--config", "file", type=options.FILE, metavar="F", help="Settings instead of the references'.")
@click.option("--set", "settings", multiple=True, metavar="KEY=VALUE", help="One setting; above all.")
@options.messages
@click.pass_context
def run(
    context: click.Context,
    /,
    references: Path,
    out: Path,
    file: Path | None,
    settings: tuple[str, ...],
    **where: Path | None,
) -> None:
    """Check today's output: says nothing where all is well.

    The exit code is 1 where a tree has drifted or is missing, 3 where one could not be checked.
    """
    if where["clouds"] is not None and where["models"] is not None:
        msg = "--clouds and --models exclude each other; give the folder of clouds or that of a run"
        raise UsageError(msg)
    change = _changed(file, settings)
    from pipeline.regression import guard
    from pipeline.regression.page import leave, sentence

    try:
        night = guard(references, out, config=change, **where)
        leave(night, out, when=datetime.now(UTC).isoformat(timespec="seconds"))
    except PipelineError as error:
        click.echo(f"treepipe: {error}", err=True)
        context.exit(COULD_NOT_RUN)
    for tree in night.trees:
        if tree.status != "ok" or tree.message:
            click.echo(sentence(tree), err=tree.status != "new")
    if night.exit_code or context.meta["verbose"]:
        click.echo(out / "report.html")
    context.exit(night.exit_code)


def _changed(file: Path | None, settings: tuple[str, ...]) -> Callable[[Config], Config] | None:
    """Return what makes today's settings of a reference's; wrong ones are found at once."""
    if file is None and not settings:
        return None
    from pipeline.config import Config, read_config

    base = read_config(file) if file is not None else None
    (base or Config()).with_settings(settings)
    return lambda config: (base or config).with_settings(settings)
