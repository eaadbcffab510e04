"""`treepipe synth`: trees whose truth is known, and scans of them."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pipeline.choosing import chosen
from pipeline.cli import options
from pipeline.cli.growth import read_parameters
from pipeline.cli.logs import LOGGER
from pipeline.errors import InputFormatError, OutputExistsError, UsageError
from pipeline.options import Options

if TYPE_CHECKING:
    from pipeline.mesh.look import Look
    from pipeline.model import TreeModel
    from pipeline.synthetic.kinds import Kind


NPZ = ".npz"
ENDED = {
    "max_iter": "all iterations are done",
    "exhausted": "the crown is full",
    "out_of_reach": "no twig sees free space any more",
    "stalled": "twigs would only grow where they have grown",
}
"""Why growth ends, in words."""

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
@click.option("--params", type=options.FILE, metavar="F", help="TOML file of options, as the studio saves.")
@click.option("--bark", type=options.FILE, metavar="FILE.png", help="Your picture of bark (.obj .glb).")
@click.option("--leaf", type=options.FILE, metavar="FILE.png", help="Your picture of a leaf (.obj .glb).")
@click.option("--no-leaves", is_flag=True, help="Leave the leaves out of .obj .glb .mesh.ply.")
@seed
@setting
@options.output("a model in any format; .npz is the truth")
@options.overwrite
@options.messages
def tree_command(
    kind: str,
    preset: str | None,
    settings: Sequence[str],
    target: Path,
    overwrite: bool,
    no_leaves: bool,
    **given: Any,
) -> None:
    """Grow a tree from a seed.

    An unknown kind, preset or option is answered with those there are.
    """
    from pipeline.exchange import SURFACES, format_of, write, write_surface
    from pipeline.synthetic import kind_named, truth_of, write_truth

    is_truth = target.name.lower().endswith(NPZ)
    options.check_target(target, ("",), overwrite=overwrite)
    if not is_truth:
        format_of(target)
    grower = kind_named(kind)
    start = dict(grower.preset(preset)) if preset is not None else {}
    if (params := given.pop("params")) is not None:
        start |= read_parameters(params)
    pictures = _pictures(grower, target, bark=given.pop("bark"), leaf=given.pop("leaf"))
    how = chosen(grower.options, {**start, **pictures, **_told(given)}, settings)
    drawn = grower.draw is not None and target.name.lower().endswith(tuple(SURFACES))
    look = grower.look(how) if drawn and grower.look else None
    _check_beside(target, look, overwrite=overwrite)
    tree = _grown(grower, how)
    if look is not None and grower.draw is not None:
        write_surface(grower.draw(tree, how, leaves=not no_leaves), target, look)
    elif is_truth:
        write_truth(truth_of(tree), target)
    else:
        write(tree, target)
    height = tree.skeleton.xyz[:, 2].max() - tree.skeleton.xyz[0, 2]
    click.echo(
        f"{target}: {len(tree)} nodes, {len(tree.skeleton.paths)} branches, {height:.1f} m high, "
        f"{1000 * tree.volume.sum():.0f} l of wood"
    )
    if "stop_reason" in tree.metadata:
        reason = str(tree.metadata["stop_reason"])
        click.echo(f"growth ended: {reason}, {ENDED.get(reason, 'see the documentation')}")
    if grower.draw is not None and look is None:
        LOGGER.info("%s does not hold the leaves; .obj, .glb and .mesh.ply do", target)


def _pictures(grower: Kind, target: Path, **pictures: Path | None) -> dict[str, str]:
    """Return the pictures that were given as options.

    Raises
    ------
    UsageError
        If the kind or the format bears none.
    """
    given = _told(pictures)
    for name in given:
        if grower.draw is None:
            msg = f"--{name}: trees of this kind bear no pictures; add --kind colonization"
            raise UsageError(msg)
        if not target.name.lower().endswith((".obj", ".glb")):
            msg = f"--{name}: {target.name} holds no pictures; end its name in .obj or .glb"
            raise UsageError(msg)
    return {f"{name}_picture": str(path) for name, path in given.items()}


def _check_beside(target: Path, look: Look | None, *, overwrite: bool) -> None:
    """Make sure that no picture beside an OBJ file is overwritten unasked."""
    from pipeline.formats.obj import pictures

    if look is not None and target.name.lower().endswith(".obj") and not overwrite:
        for beside in pictures(target, look):
            options.check_target(beside, ("",), overwrite=False)


def _grown(grower: Kind, chosen: Options) -> TreeModel:
    """Grow a tree, with a bar on stderr where that is a terminal and nobody asked for quiet."""
    if not grower.tells or not sys.stderr.isatty() or click.get_current_context().meta["quiet"]:
        return grower.grow(chosen)
    with click.progressbar(length=1000, label="growing", file=sys.stderr) as bar:
        return grower.grow(chosen, lambda step: bar.update(1000 * step.done // step.iterations - bar.pos))


@command.command("scan", short_help="Scan a tree by following every beam.")
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
    how = chosen(SCANNERS[kind], _scanner(kind, leaves, **given), settings)
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


@command.command("suite", short_help="Scan, reconstruct and score trees of every kind.")
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
