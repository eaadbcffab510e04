"""`treepipe run`: from clouds to tree models."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli import options
from pipeline.cli.logs import LOGGER
from pipeline.jobs.crew import one_thread, work_through

if TYPE_CHECKING:
    from pipeline.config import Config
    from pipeline.jobs.inputs import Input
    from pipeline.jobs.reconstruction import Reconstruction
    from pipeline.jobs.summary import Outcome


@click.command("run")
@click.argument("clouds", nargs=-1, required=True, type=options.FILE, metavar="CLOUD...")
@click.option("--out", type=options.FILE, required=True, metavar="DIR", help="Where to write.")
@options.settings
@options.formats()
@options.method
@click.option("--crs", metavar="EPSG:N", help="Reference system of clouds that name none.")
@options.ground
@click.option("--species", metavar="NAME", help="Noted in the models.")
@click.option(
    "--workers",
    type=click.IntRange(1),
    default=1,
    metavar="N",
    show_default=True,
    help="Trees worked on at the same time; the results are the same.",
)
@click.option("--picture/--no-picture", default=True, help="Draw cloud and model.  [default: picture]")
@options.overwrite
@options.messages
@click.pass_context
def command(
    context: click.Context, /, clouds: tuple[Path, ...], out: Path, workers: int, **given: Any
) -> None:
    """Make a tree model of every CLOUD: a file, or a folder that means the clouds in it."""
    started = perf_counter()
    one_thread()  # before anything loads a linear algebra library
    from pipeline.jobs.inputs import check_free, find_inputs
    from pipeline.jobs.summary import write_summary
    from pipeline.output import write_text

    overwrite = given.pop("overwrite")
    work = _reconstruction(out, **given)
    inputs, skipped = find_inputs(clouds)
    check_free(out, inputs, overwrite=overwrite)
    for path in skipped:
        LOGGER.warning("%s: is no cloud of a tree by its name; skipped", path)
    work.prepare()
    outcomes = _work(work, inputs, min(workers, len(inputs)), verbose=context.meta["verbose"])
    write_summary(outcomes, perf_counter() - started, out / "summary.json")
    write_text(out / "config.toml", work.config.to_toml())
    if not context.meta["quiet"]:
        _print_table(outcomes, out)
    context.exit(1 if any(outcome.error for outcome in outcomes) else 0)


def _reconstruction(
    out: Path,
    *,
    config: Config,
    formats: str | None,
    method: str | None,
    crs: str | None,
    **rest: Any,
) -> Reconstruction:
    """Gather what is done for each tree, and refuse what cannot be."""
    from pipeline.exchange import DEFAULT_FORMATS, parse_formats
    from pipeline.jobs.reconstruction import Reconstruction, parse_crs

    return Reconstruction(
        out,
        options.with_method(config, method),
        parse_formats(formats) if formats is not None else DEFAULT_FORMATS,
        crs=parse_crs(crs) if crs is not None else None,
        **rest,
    )


def _work(work: Reconstruction, inputs: Sequence[Input], workers: int, *, verbose: bool) -> list[Outcome]:
    """Work off all inputs, tell of each as it is done, and return the outcomes in input order."""
    outcomes: dict[int, Outcome] = {}
    jobs = work_through(work, inputs, workers=workers, lost=work.lost)
    try:
        with _progress(jobs, len(inputs)) as done:
            for number, outcome in done:
                outcomes[number] = outcome
                _tell(outcome, verbose=verbose)
    finally:
        jobs.close()
        for tree in inputs:
            work.sweep(tree)
    return [outcomes[number] for number in range(len(inputs))]


@contextmanager
def _progress(jobs: Iterable[Any], length: int) -> Iterator[Iterable[Any]]:
    """Show a bar on stderr where that is a terminal and nobody asked for quiet."""
    if not sys.stderr.isatty() or click.get_current_context().meta["quiet"]:
        yield jobs
        return
    click.echo("The first run after an installation compiles, which takes a minute or two.", err=True)
    with click.progressbar(jobs, length=length, label="trees", file=sys.stderr, show_pos=True) as bar:
        bar.render_progress()
        yield bar


def _tell(outcome: Outcome, *, verbose: bool) -> None:
    for warning in outcome.warnings:
        LOGGER.warning("%s", warning)
    if outcome.error is None:
        LOGGER.info("%s: done in %.1f s", outcome.path, outcome.seconds)
        return
    if verbose and outcome.trace:
        LOGGER.error("%s", outcome.trace)
    LOGGER.error("%s", outcome.error)


def _print_table(outcomes: Sequence[Outcome], out: Path) -> None:
    """Print the main figures of every model, and where the files are."""
    rows = [_row(outcome) for outcome in outcomes if outcome.error is None]
    if rows:
        rows.insert(0, ("name", "height m", "DBH cm (90 %)", "volume L", "branches", "seconds"))
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        for name, *figures in rows:
            cells = (figure.rjust(width) for figure, width in zip(figures, widths[1:], strict=True))
            click.echo("  ".join([name.ljust(widths[0]), *cells]))
    failed = sum(outcome.error is not None for outcome in outcomes)
    click.echo(f"{len(outcomes) - failed} of {len(outcomes)} done, {failed} failed; the files are in {out}/")


def _row(outcome: Outcome) -> tuple[str, ...]:
    known = outcome.figures
    dbh = _figure(known.get("dbh_cm"), 1)
    if known.get("dbh_lo_cm") is not None:
        dbh += f" ({_figure(known['dbh_lo_cm'], 1)} to {_figure(known['dbh_hi_cm'], 1)})"
    return (
        outcome.name,
        _figure(known.get("height_m"), 2),
        dbh,
        _figure(known.get("volume_l"), 1),
        _figure(known.get("branches"), 0),
        _figure(outcome.seconds, 1),
    )


def _figure(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"
