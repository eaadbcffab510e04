"""`treepipe synth`: trees whose truth is known, and scans of them."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click
from pydantic import ValidationError

from pipeline.cli import options
from pipeline.errors import InputFormatError, OutputExistsError, UsageError
from pipeline.options import Options

if TYPE_CHECKING:
    from pipeline.model import TreeModel

Chosen = TypeVar("Chosen", bound=Options)

NPZ = ".npz"

setting = click.option(
    "--set", "settings", multiple=True, metavar="KEY=VALUE", help="Any other option; above all."
)
seed = click.option("--seed", type=click.IntRange(0), metavar="N", help="Another seed, another result.")


@click.group("synth", context_settings={"help_option_names": ["-h", "--help"]})
def command() -> None:
    """Grow trees whose truth is known, and scan them."""


@command.command("tree")
@click.option("--kind", default="tubes", show_default=True, metavar="NAME", help="How it grows.")
@click.option("--preset", metavar="NAME", help="A habit that comes with the kind.")
@seed
@setting
@options.output("a model in any format; .npz is the truth")
@options.overwrite
@options.messages
def tree_command(
    kind: str, preset: str | None, settings: Sequence[str], target: Path, overwrite: bool, **given: int | None
) -> None:
    """Grow a tree from a seed.

    An unknown kind, preset or option is answered with those there are.
    """
    from pipeline.exchange import format_of, write
    from pipeline.synthetic import kind_named, truth_of, write_truth

    is_truth = target.name.lower().endswith(NPZ)
    options.check_target(target, ("",), overwrite=overwrite)
    if not is_truth:
        format_of(target)
    grower = kind_named(kind)
    start = grower.preset(preset) if preset is not None else {}
    tree = grower.grow(_chosen(grower.options, {**start, **_told(given)}, settings))
    if is_truth:
        write_truth(truth_of(tree), target)
    else:
        write(tree, target)
    height = tree.skeleton.xyz[:, 2].max() - tree.skeleton.xyz[0, 2]
    click.echo(
        f"{target}: {len(tree)} nodes, {len(tree.skeleton.paths)} branches, {height:.1f} m high, "
        f"{1000 * tree.volume.sum():.0f} l of wood"
    )
    if "stop_reason" in tree.metadata:
        click.echo(f"growth ended: {tree.metadata['stop_reason']}")


@command.command("scan")
@click.argument("model", type=options.FILE)
@click.option(
    "--kind",
    type=click.Choice(["tls", "als"]),
    default="tls",
    show_default=True,
    help="Terrestrial or airborne.",
)
@click.option(
    "--density",
    type=click.FloatRange(0, min_open=True),
    metavar="N",
    help="Points on a square metre: of bark that faces a station (tls), pulses on the ground (als).",
)
@click.option("--noise-mm", type=click.FloatRange(0), metavar="N", help="Standard deviation of a range.")
@click.option("--leaves", is_flag=True, help="Let the tree bear leaves.")
@seed
@setting
@options.output("a .laz or .las file")
@options.overwrite
@options.messages
def scan_command(
    model: Path,
    kind: str,
    leaves: bool,
    settings: Sequence[str],
    target: Path,
    overwrite: bool,
    **given: float | None,
) -> None:
    """Scan MODEL, any tree that treepipe reads or a truth, by following every beam.

    Beside the cloud NAME.laz stand NAME.truth.npz, the cylinders of the tree, and NAME.returns.npz, the
    truth of every point.
    """
    options.check_target(target, (".laz", ".las"), overwrite=overwrite)
    from pipeline.jobs.naming import named
    from pipeline.synthetic import SCANNERS, scan, scan_files, write_scan

    for beside in scan_files(target)[1:]:
        if beside.exists() and not overwrite:
            msg = f"{beside}: exists already; add --overwrite or give another name with -o"
            raise OutputExistsError(msg)
    how = _chosen(SCANNERS[kind], _scanner(kind, leaves, **given), settings)
    tree = _tree(model)
    with named(model):
        made = scan(tree, options=how)
    write_scan(made, target)
    surfaces = made.returns.surface
    click.echo(f"{target}: {len(surfaces)} points, {(surfaces <= 1).sum()} on the tree")


def _scanner(
    kind: str, leaves: bool, density: float | None, noise_mm: float | None, seed: float | None
) -> dict[str, Any]:
    """Return the scanner's options that were given by name."""
    from pipeline.synthetic import TlsOptions, step_for

    told: dict[str, Any] = {"leaves": True} if leaves else {}
    if density is not None and kind == "als":
        told["density_per_m2"] = density
    elif density is not None:
        told["step_deg"] = step_for(density, TlsOptions().distance_m)
    if noise_mm is not None:
        told["noise_m"] = noise_mm / 1000
    return told | _told({"seed": seed})


def _tree(path: Path) -> TreeModel:
    """Read the tree to be scanned."""
    from pipeline.exchange import read_model
    from pipeline.model import TreeModel

    tree = read_model(path)
    options.warn_if_flat(path, tree)
    if not isinstance(tree, TreeModel):
        msg = f"{path}: is a skeleton without radii; measure them first with `treepipe fit`"
        raise InputFormatError(msg)
    return tree


def _told(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return what is not None."""
    return {name: value for name, value in given.items() if value is not None}


def _chosen(kind: type[Chosen], values: dict[str, Any], settings: Sequence[str]) -> Chosen:
    """Make options of values and of KEY=VALUE texts.

    Raises
    ------
    UsageError
        If a key is unknown or a value out of range, with what would be right.
    """
    for text in settings:
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals or not key:
            msg = f"--set {text}: is not KEY=VALUE; write for example --set seed=3"
            raise UsageError(msg)
        values = {**values, key: _value(value)}
    try:
        return kind.model_validate(values)
    except ValidationError as error:
        raise UsageError(_explained(error, kind)) from None


def _value(text: str) -> Any:
    """Read a value as TOML does; what is no TOML value is a text."""
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def _explained(error: ValidationError, kind: type[Options]) -> str:
    """Say in one sentence what is wrong with the first key, and what would be right."""
    from pipeline.toml import allowed

    first = error.errors(include_url=False)[0]
    if not first["loc"]:
        return str(first["msg"]).removeprefix("Value error, ")
    key = str(first["loc"][0])
    if key in kind.model_fields:
        field = kind.model_fields[key]
        return f"{key} = {first['input']!r} is not allowed; give {allowed(field)}: {field.description}"
    near = difflib.get_close_matches(key, kind.model_fields, n=1)
    meant = f", do you mean {near[0]}?" if near else ";"
    return f"unknown key {key}{meant} known: {', '.join(kind.model_fields)}"


@command.command("suite")
@click.option(
    "-o", "--out", type=options.FILE, required=True, metavar="DIR", help="Where scans and results go."
)
@click.option("--small", is_flag=True, help="Two scans of one small tree.")
@click.option(
    "--workers", type=click.IntRange(1), default=1, show_default=True, metavar="N", help="Processes."
)
@options.messages
def suite_command(out: Path, small: bool, workers: int) -> None:
    """Grow, scan, reconstruct and score every kind of tree by every scanner.

    Called again it goes on where it was: what has a result in DIR/cases is not done again. DIR/suite.md is
    the table, DIR/suite.svg draws it.
    """
    from pipeline.jobs.suite import cases, table, work_suite

    results = work_suite(
        out, cases(small=small), workers=workers, tell=lambda text: click.echo(text, err=True)
    )
    click.echo(table(results), nl=False)
    failed = sum(result["error"] is not None for result in results)
    click.get_current_context().exit(1 if failed else 0)
