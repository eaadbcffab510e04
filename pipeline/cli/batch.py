"""`treepipe batch`: whole tiles to the models and the inventory of all their trees."""

from __future__ import annotations

import json
import os
import re
import sys
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

import click

from pipeline.cli import options
from pipeline.cli.logs import LOGGER
from pipeline.errors import PipelineError, UsageError
from pipeline.jobs.crew import one_thread

if TYPE_CHECKING:
    from pipeline.batch.plan import Plan
    from pipeline.batch.progress import Progress
    from pipeline.config import Config

LINE_EVERY_S = {True: 0.2, False: 10.0}
"""How often a line tells of the progress, on a terminal and elsewhere."""

_ADDRESS = re.compile(r"(tcp|tls)://[^/]+:\d+")

COUNTS = ("cells", "done", "quarantined", "missing", "trees")


class BatchGroup(click.Group):
    """A group whose first word may be a tile: then `run` is meant."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put `run` in front, unless a command or nothing but help is asked for."""
        if args and args[0] not in self.commands and not set(args) & set(ctx.help_option_names):
            args = ["run", *args]
        return super().parse_args(ctx, args)

    def format_help(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Show the help of `run`, and the other commands below it."""
        run = self.commands["run"]
        formatter.write_usage(ctx.command_path, "TILE... --out DIR [OPTIONS]")
        run.format_help_text(ctx, formatter)
        run.format_options(click.Context(run), formatter)
        with formatter.section("Commands"):
            others = [(name, one.get_short_help_str(90)) for name, one in self.commands.items()]
            formatter.write_dl([(name, text) for name, text in others if name != "run"])


@click.group("batch", cls=BatchGroup, context_settings={"help_option_names": ["-h", "--help"]})
def command() -> None:
    """Model every tree of airborne tiles."""


@command.command("run", hidden=True)
@click.argument("tiles", nargs=-1, required=True, type=options.FILE, metavar="TILE...")
@click.option("--out", type=options.FILE, required=True, metavar="DIR", help="Where to write, and to go on.")
@click.option("--core-m", type=float, metavar="M", help="Side of a cell, the setting batch.core_m.")
@click.option("--buffer-m", type=float, metavar="M", help="Points around it, batch.buffer_m.")
@click.option("--workers", type=click.IntRange(1), metavar="N", help="Processes.  [default: all cores]")
@click.option("--scheduler", metavar="tcp://HOST:PORT", help="A Dask cluster that is there already.")
@click.option("--memory-gb", type=click.FloatRange(0.5), metavar="GB", help="What each worker may use.")
@partial(options.settings, preset="airborne")
@click.option("--crs", metavar="EPSG:N", help="Reference system of tiles that name none.")
@click.option("--edition", default="als", show_default=True, metavar="NAME", help="Begins every tree_id.")
@click.option("--bbox", metavar="X0,Y0,X1,Y1", help="Only the cells that meet this box.")
@click.option("--aoi", type=options.FILE, metavar="F", help="Only the cells that meet these polygons.")
@click.option("--stems", type=options.FILE, metavar="F", help="Field list that is joined to the trees.")
@click.option("--only", metavar="CELL", help="Only this cell.")
@click.option("--dry-run", is_flag=True, help="Say what there is to do, and do nothing.")
@click.option("--merge/--no-merge", default=True, help="Make one table of all cells.  [default: merge]")
@options.messages
@click.pass_context
def run_command(context: click.Context, /, tiles: tuple[Path, ...], out: Path, **given: Any) -> None:
    """Model every tree of each TILE: airborne LAS or LAZ, or a folder of them.

    The same command again goes on where it was.
    """
    one_thread()  # before anything loads a linear algebra library
    from pipeline.batch.extra import check_installed

    check_installed()
    from pipeline.batch.merging.fieldlist import read_stems

    if given["scheduler"] and given["workers"]:
        msg = "--workers and --scheduler exclude each other; the cluster brings its own workers"
        raise UsageError(msg)
    if given["scheduler"] and not _ADDRESS.fullmatch(given["scheduler"]):
        address = given["scheduler"]
        msg = f"--scheduler {address}: is no address; give tcp://HOST:PORT, as `dask scheduler` prints it"
        raise UsageError(msg)
    if given["stems"]:
        read_stems(given["stems"])  # a list that cannot be read is told before any work
    config = _with_grid(given.pop("config"), given.pop("core_m"), given.pop("buffer_m"))
    given["workers"] = given["workers"] or len(os.sched_getaffinity(0))
    plan = _plan(tiles, out, config, **{key: given[key] for key in ("crs", "edition", "bbox", "aoi", "only")})
    if plan is None:
        context.exit(1)
    if given["dry_run"]:
        _print_forecast(plan, out, given["workers"], verbose=context.meta["verbose"])
        context.exit(1 if plan.failures else 0)
    summary = _run(plan, out, config, **given)
    good = not summary["failed"] and summary["done"] == summary["planned"]
    if summary["done"] + summary["quarantined"] != summary["planned"]:
        LOGGER.error("%s: not every cell is done or quarantined; run the same command again", out)
    if given["merge"] and summary["done"] and given["only"] is None:
        good = _merged(out, given["stems"], given["aoi"]) and good
    _tell(
        {each["path"]: each["error"] for each in summary["failed"] if each["path"] not in plan.failures}, ()
    )
    if not context.meta["quiet"]:
        click.echo(_closing(summary, out))
    context.exit(0 if good else 1)


@command.command("status")
@click.argument("folder", type=options.FILE, metavar="DIR")
@options.as_json
def status_command(folder: Path, as_json: bool) -> None:
    """Tell which cells are done, quarantined or missing."""
    from pipeline.batch.status import status

    found = status(folder)
    if as_json:
        click.echo(json.dumps(found.to_dict(), indent=2, ensure_ascii=False))
        return
    for cell in found.cells:
        facts = f"{cell.trees} trees" if cell.state == "done" else cell.error or ""
        click.echo(f"{cell.cell:<28} {cell.state:<12} {facts}".rstrip())
    told = found.to_dict()
    figures = (len(found.cells), *(told[name] for name in COUNTS[1:]))
    click.echo(", ".join(f"{figure} {name}" for figure, name in zip(figures, COUNTS, strict=True)))


@command.command("retry")
@click.argument("folder", type=options.FILE, metavar="DIR")
def retry_command(folder: Path) -> None:
    """Lift the quarantine; the next run does those cells again."""
    from pipeline.batch.folder import known_plan, locked
    from pipeline.batch.quarantine import release

    known_plan(folder)
    with locked(folder):
        names = release(folder)
    for name in names:
        click.echo(name)
    click.echo(f"{len(names)} cells are free; run the same `treepipe batch` command again to do them")


@command.command("merge")
@click.argument("folder", type=options.FILE, metavar="DIR")
@click.option("--gpkg", type=options.FILE, metavar="F", help="Another place for the GeoPackage.")
@click.option("--postgis", metavar="URL", help="Database that the trees are put into.")
@click.option("--stems", type=options.FILE, metavar="F", help="Field list that is joined to the trees.")
@click.option("--areas", type=options.FILE, metavar="F", help="Polygons that statistics are told of.")
@options.as_json
@options.messages
def merge_command(folder: Path, *, as_json: bool, **given: Any) -> None:
    """Make one table, GeoPackage and map of all cells that are done."""
    from pipeline.batch.extra import check_installed
    from pipeline.batch.folder import known_plan

    check_installed()
    known_plan(folder)
    from pipeline.batch.merge import merge

    summary = merge(folder, **given)
    if as_json:
        click.echo(json.dumps(summary, indent=2, ensure_ascii=False))
        return
    click.echo(f"{summary['trees']} trees of {summary['cells']} cells, {summary['crs']}")
    for line in (*summary["notes"], *summary["files"]):
        click.echo(line)


def _with_grid(config: Config, core_m: float | None, buffer_m: float | None) -> Config:
    """Return the config with the sizes of cells that are given."""
    sizes = {"core_m": core_m, "buffer_m": buffer_m}
    return config.with_settings([f"batch.{key}={size}" for key, size in sizes.items() if size is not None])


def _plan(
    tiles: Sequence[Path], out: Path, config: Config, *, edition: str, only: str | None, **where: Any
) -> Plan | None:
    """Lay the cells and tell what is wrong with tiles; None where none of them can be read."""
    from pipeline.batch.area import box_area, parse_bbox, read_area
    from pipeline.batch.engine import write_nothing
    from pipeline.batch.plan import NoTileError, make_plan

    bbox, aoi = where["bbox"], where["aoi"]
    if bbox and aoi:
        msg = "--bbox and --aoi exclude each other; give one of them"
        raise UsageError(msg)
    area = None
    if bbox:
        box = parse_bbox(bbox)
        area = lambda _: box_area(box)  # noqa: E731 (the two kinds of area stand side by side)
    elif aoi:
        area = lambda crs: read_area(aoi, crs)  # noqa: E731
    try:
        plan = make_plan(
            tiles,
            config.batch,
            config_hash=config.config_hash,
            crs=where["crs"],
            area=area,
            extra={"edition": edition},
        )
    except NoTileError as error:
        _tell(error.failures, ())
        write_nothing(out, error.failures)
        return None
    _tell(plan.failures, plan.warnings)
    return plan.restricted(only) if only is not None else plan


def _tell(failures: Mapping[str, str], warnings: Sequence[str]) -> None:
    for warning in warnings:
        LOGGER.warning("%s", warning)
    for failure in failures.values():
        LOGGER.error("%s", failure)


def _run(plan: Plan, out: Path, config: Config, **given: Any) -> dict[str, Any]:
    """Do the cells."""
    from pipeline.batch.cell import work
    from pipeline.batch.engine import run_batch
    from pipeline.batch.job import Job

    job = Job(
        work,
        out.resolve(),
        plan.grid,
        plan.config_hash,
        plan.input_hash,
        config_json=config.model_dump_json(),
        crs=plan.reference.crs,
        crs_assumed=plan.reference.assumed,
        extra={"edition": given["edition"]},
    )
    watcher = _Watcher(quiet=click.get_current_context().meta["quiet"])
    try:
        return run_batch(
            plan,
            job,
            workers=given["workers"],
            scheduler=given["scheduler"],
            memory_gb=given["memory_gb"],
            watch=watcher,
        )
    finally:
        watcher.end()


class _Watcher:
    """Shows the progress: a line that is drawn anew on a terminal, else lines for -v."""

    def __init__(self, *, quiet: bool) -> None:
        self.drawn = sys.stderr.isatty() and not quiet
        self.quiet, self.last, self.greeted, self.text = quiet, 0.0, False, ""

    def __call__(self, progress: Progress) -> None:
        """Show the progress, if it is time."""
        if progress.dashboard and not self.greeted and not self.quiet:
            click.echo(f"dashboard of the workers: {progress.dashboard}", err=True)
        self.greeted = True
        if monotonic() - self.last < LINE_EVERY_S[self.drawn] or progress.line() == self.text:
            return
        self.last, self.text = monotonic(), progress.line()
        if self.drawn:
            click.echo(f"\r\x1b[K{self.text}", err=True, nl=False)
        else:
            LOGGER.info("%s", self.text)

    def end(self) -> None:
        """Leave the line."""
        if self.drawn and self.text:
            click.echo(err=True)


def _merged(out: Path, stems: Path | None, areas: Path | None) -> bool:
    """Make one table of all cells; an error there costs no cell."""
    from pipeline.batch.merge import merge

    try:
        notes = merge(out, stems=stems, areas=areas)["notes"]
    except PipelineError as error:
        LOGGER.error("%s; the cells are done, run `treepipe batch merge %s` again", error, out)
        return False
    for note in notes:
        LOGGER.warning("%s", note)
    return True


def _closing(summary: Mapping[str, Any], out: Path) -> str:
    text = f"{summary['done']} of {summary['planned']} cells done, {summary['quarantined']} quarantined, "
    return f"{text}{summary['trees']} trees ({summary['fallback_trees']} fallbacks); the files are in {out}/"


def _print_forecast(plan: Plan, out: Path, workers: int, *, verbose: bool) -> None:
    from pipeline.batch.folder import require_same
    from pipeline.batch.forecast import lines
    from pipeline.batch.status import status

    there = status(out) if require_same(out, plan) else None
    for line in (*lines(plan, workers, there), *(cell.name for cell in plan.cells if verbose)):
        click.echo(line)
