"""Options that several commands share, each written once."""

from __future__ import annotations

import functools
import logging
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click

from pipeline.cli.logs import LOGGER, start_logging
from pipeline.errors import OutputExistsError, UsageError

if TYPE_CHECKING:
    from pipeline.config import Config
    from pipeline.model import Skeleton, TreeModel

Command = TypeVar("Command", bound=Callable[..., Any])

FILE = click.Path(path_type=Path)

overwrite = click.option("--overwrite", is_flag=True, help="Write over results that are there.")
method = click.option(
    "--method",
    metavar="NAME",
    help="Skeleton method, the setting skeleton.method: auto (the usual one), geodesic, greedy, mst, "
    "space-colonization or minimal-length.",
)
ground = click.option(
    "--ground", type=FILE, metavar="FILE", help="Points of the ground, where they are apart."
)
as_json = click.option("--json", "as_json", is_flag=True, help="Print JSON.")


NOTEWORTHY = 1e-3
"""Share of a volume below which a difference is not worth a word."""

LSYSTEM_SUFFIXES = (".ls.json", ".ls.json.zst")


def output(example: str) -> Callable[[Command], Command]:
    """Add -o, the file to be written."""
    return click.option("-o", "--output", "target", type=FILE, required=True, help=f"Result, {example}.")


def formats(*, usual: str = "lsjson,cityjson,skeleton,mesh,qsm") -> Callable[[Command], Command]:
    """Add --formats, and tell all there are; `usual` is what is written where none is named."""
    told = (
        "Comma list of lsjson, cityjson, skeleton, mesh, qsm, obj, glb, swc, treefile, treeqsm, "
        f"simpleforest, mtg, lstring, gpkg, lsjson-zst, npz.  [default: {usual}]"
    )
    return click.option("--formats", metavar="LIST", help=told)


def lsystem_output(function: Command) -> Command:
    """Add -o, the L-system to be written."""
    return output("an .ls.json or .ls.json.zst file")(function)


def settings(function: Command, *, preset: str | None = None) -> Command:
    """Add --config, --preset and --set; the function gets a Config as `config`.

    Parameters
    ----------
    function : callable
    preset : str, optional
        The one that is taken where none is named.
    """
    usual = preset

    @functools.wraps(function)
    def with_config(
        *args: Any, config: Path | None, preset: str | None, setting: Sequence[str], **rest: Any
    ) -> Any:
        return function(*args, config=_config(config, preset or usual, setting), **rest)

    told = "Settings that ship with treepipe; below --config."
    options = (
        click.option("--config", type=FILE, metavar="F", help="TOML file of settings."),
        click.option("--preset", metavar="NAME", help=told + (f" Default: {usual}." if usual else "")),
        click.option("--set", "setting", multiple=True, metavar="KEY=VALUE", help="One setting; above all."),
    )
    return cast("Command", _all(options, with_config))


def messages(function: Command) -> Command:
    """Add -v, -q and --log; the function gets neither, its messages go where they should."""

    @functools.wraps(function)
    def with_messages(*args: Any, verbose: bool, quiet: bool, log: Path | None, **rest: Any) -> Any:
        if verbose and quiet:
            msg = "-v and -q exclude each other; give one of them"
            raise UsageError(msg)
        click.get_current_context().meta.update(verbose=verbose, quiet=quiet)
        start_logging(logging.INFO if verbose else logging.ERROR if quiet else logging.WARNING, log)
        return function(*args, **rest)

    options = (
        click.option(
            "-v", "--verbose", is_flag=True, help="Say more; show where unexpected errors come from."
        ),
        click.option("-q", "--quiet", is_flag=True, help="Say nothing but errors."),
        click.option("--log", type=FILE, metavar="FILE", help="Append messages to a file, too."),
    )
    return cast("Command", _all(options, with_messages))


def warn_if_flat(file: Path, model: TreeModel | Skeleton) -> None:
    """Say that the height of a tree's foot is not known, where its L-system gave none."""
    from pipeline.lsystem import FLAT
    from pipeline.model import TreeModel

    if isinstance(model, TreeModel) and FLAT in model.metadata.get("flags", ()):
        LOGGER.warning("%s: trunk.anchor has two coordinates; its height is taken as 0", file)


def tell_cylinders(file: Path, model: TreeModel | Skeleton) -> None:
    """Say what a file's cylinders hold by themselves, where the tree that joins them holds another amount."""
    from pipeline.jobs.told import cylinders_of
    from pipeline.model import TreeModel

    held = cylinders_of(file) if isinstance(model, TreeModel) else None
    if held is None or not isinstance(model, TreeModel):
        return
    joined = float(model.volume.sum())
    if abs(joined - held.volume) > NOTEWORTHY * held.volume:
        LOGGER.warning(
            "%s: its cylinders alone hold %.1f L in %.1f m; joined into one tree, where every branch begins "
            "on its parent's axis and radii taper, they are %.1f L in %.1f m",
            *(file, 1000 * held.volume, held.length.sum()),
            *(1000 * joined, model.skeleton.length.sum()),
        )


def with_method(config: Config, name: str | None) -> Config:
    """Return the config with another skeleton method, where one is named."""
    if name is None:
        return config
    try:
        return config.with_settings([f"skeleton.method={name}"])
    except UsageError as error:
        msg = str(error).replace("--set: skeleton.method =", "--method", 1)
        raise UsageError(msg) from error


def check_target(target: Path, suffixes: Sequence[str], *, overwrite: bool) -> None:
    """Make sure that a result has the right suffix and overwrites nothing unasked.

    Raises
    ------
    UsageError
        If the suffix is none of `suffixes`.
    OutputExistsError
        If the file exists and `overwrite` is False.
    """
    if not target.name.lower().endswith(tuple(suffixes)):
        msg = f"{target}: the suffix does not fit; end the name in {' or '.join(suffixes)}"
        raise UsageError(msg)
    if target.exists() and not overwrite:
        msg = f"{target}: exists already; add --overwrite or give another name with -o"
        raise OutputExistsError(msg)


def _config(file: Path | None, preset: str | None, setting: Sequence[str]) -> Config:
    from pipeline.config import read_config

    return read_config(file, preset=preset, settings=setting)


def _all(options: Sequence[Callable[[Any], Any]], function: Any) -> Any:
    for option in reversed(options):
        function = option(function)
    return function
