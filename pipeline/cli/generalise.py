"""`treepipe generalise`: a shorter L-system that draws nearly the same tree."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from pipeline.cli import options
from pipeline.errors import UsageError


@click.command("generalise")
@click.argument("file", type=options.FILE)
@options.lsystem_output
@click.option("--steps", type=click.IntRange(1, 10), help="Steps before every tip that become one symbol.")
@click.option(
    "--rules", type=click.IntRange(1, 512), default=1, show_default=True, help="Averages of each length."
)
@click.option(
    "--repeats",
    "tolerance_m",
    type=click.FloatRange(0, 1),
    metavar="M",
    help="Make rules of parts that repeat within M metres, too; the tree stays within M.",
)
@options.overwrite
@options.messages
def command(
    file: Path, target: Path, steps: int | None, rules: int, tolerance_m: float | None, overwrite: bool
) -> None:
    """Shorten FILE, an LsJSON: tips become the average of their like, or repeats become rules.

    A branch that is shorter than the steps is averaged over its own length only, so that no limb turns.
    """
    if steps is None and tolerance_m is None:
        msg = "nothing to do; give --steps N (1 is a good start) or --repeats M"
        raise UsageError(msg)
    options.check_target(target, options.LSYSTEM_SUFFIXES, overwrite=overwrite)
    from pipeline.jobs.documents import read_document
    from pipeline.jobs.naming import named
    from pipeline.lsystem import (
        GeneraliseOptions,
        RepeatsOptions,
        deviation,
        generalise,
        repeats,
        write_lsjson,
    )

    before = after = read_document(file)
    with named(file):
        if steps is not None:
            after = generalise(after, options=GeneraliseOptions(steps=steps, rules=rules))
        if tolerance_m is not None:
            after = repeats(after, options=RepeatsOptions(tolerance_m=tolerance_m))
        off = deviation(before, after)["deviation_m"]
    write_lsjson(after, target)
    count = len(after["rules"])
    click.echo(f"{target}: {_shorter(before, after)}, {count} rule{'s' if count != 1 else ''}")
    click.echo(f"nodes move by {1000 * off['median']:.1f} mm (median), {1000 * off['max']:.1f} mm at most")


def _shorter(before: Mapping[str, Any], after: Mapping[str, Any]) -> str:
    """Say how long both strings are, the rules with the axiom."""
    was, now = (
        len(document["axiom"]) + sum(map(len, document.get("rules", {}).values()))
        for document in (before, after)
    )
    return f"{was:,} -> {now:,} characters ({100 * now / max(was, 1):.0f} %)"
