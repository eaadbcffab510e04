"""`treepipe expand`: the L-string that a document's rules make."""

from __future__ import annotations

from pathlib import Path

import click

from pipeline.cli import options


@click.command("expand")
@click.argument("file", type=options.FILE)
@click.option(
    "--recursions",
    type=click.IntRange(0),
    metavar="N",
    help="How often the rules apply, instead of what FILE says; 0 shows the axiom.",
)
@options.messages
def command(file: Path, recursions: int | None) -> None:
    """Print the L-string of FILE, an LsJSON."""
    from pipeline.jobs.documents import read_document
    from pipeline.jobs.naming import named
    from pipeline.lsystem import expand
    from pipeline.lsystem.document import checked

    sheet = checked(read_document(file))
    times = sheet.applications if recursions is None else recursions
    with named(file):
        click.echo(expand(sheet.axiom, sheet.rules, times))
