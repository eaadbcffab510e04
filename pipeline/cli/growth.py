"""Options that commands share which let trees grow: the parameters, each source above the one before."""

from __future__ import annotations

import functools
import tempfile
import tomllib
import warnings
from collections.abc import Callable, Sequence
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click

from pipeline.choosing import chosen
from pipeline.cli import options
from pipeline.cli.logs import LOGGER
from pipeline.errors import InputFormatError, InputMissingError, OutputError, UsageError

if TYPE_CHECKING:
    from pipeline.growth import Event, GrowthOptions

Command = TypeVar("Command", bound=Callable[..., Any])

seed = click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    metavar="N",
    help="Another one, another tree.",
)
events = click.option(
    "--events", type=options.FILE, metavar="EVENTS.toml", help="What is done to the tree in which year."
)

species = click.option("--species", metavar="NAME", help="A set of parameters that comes with treepipe.")


def parameters(function: Command) -> Command:
    """Add --species, --params and --set; the function gets GrowthOptions as `how`, and the `species`."""

    @functools.wraps(function)
    def with_parameters(*args: Any, params: Path | None, setting: Sequence[str], **rest: Any) -> Any:
        return function(*args, how=growth_options(rest["species"], params, setting), **rest)

    for option in (
        click.option(
            "--set", "setting", multiple=True, metavar="KEY=VALUE", help="One parameter; above all."
        ),
        click.option(
            "--params", type=options.FILE, metavar="F", help="TOML file of parameters, as of `calibrate`."
        ),
        species,
    ):
        with_parameters = option(with_parameters)
    return cast("Command", with_parameters)


def growth_options(
    species: str | None, params: Path | None, settings: Sequence[str], **more: str | None
) -> GrowthOptions:
    """Gather parameters: the defaults, a species, a file, named options, single settings.

    Raises
    ------
    UsageError
        If a species or key is unknown or a value out of range.
    InputMissingError, InputFormatError
        If the file cannot be read.
    """
    from pipeline.growth import GrowthOptions
    from pipeline.growth.species import species_named

    values: dict[str, Any] = dict(species_named(species)) if species is not None else {}
    values |= read_parameters(params) if params is not None else {}
    values |= {key: value for key, value in more.items() if value is not None}
    return chosen(GrowthOptions, values, settings)


def read_events(path: Path | None, years: int) -> tuple[Event, ...]:
    """Return the events of a file; none without one.

    Raises
    ------
    InputMissingError, InputFormatError
        If the file cannot be read.
    UsageError
        If a key or value in it is wrong, or an event is of a later year than growth has.
    """
    if path is None:
        return ()
    if path.is_dir():
        msg = f"{path}: is a directory; give --events the TOML file in it"
        raise InputFormatError(msg)
    if not path.is_file():
        msg = f"{path}: there is no such file; check the name given to --events"
        raise InputMissingError(msg)
    reader = import_module("pipeline.growth.events")  # late: not needed by most commands
    events = tuple(reader.read_events(path))
    late = [event.year for event in events if event.year > years]
    if late:
        msg = (
            f"{path}: an event is of year {late[0]}, but growth is from year 0 to {years}; move it or add "
            "years"
        )
        raise UsageError(msg)
    if not events:
        LOGGER.warning("%s: has no events, so none is done; write tables [[event]], or leave it out", path)
    return events


def check_model(*paths: Path) -> None:
    """Make sure that no directory is given as a model.

    Raises
    ------
    InputFormatError
    """
    for path in paths:
        if path.is_dir():
            msg = f"{path}: is a directory, and no model that can be read; give one of the files in it"
            raise InputFormatError(msg)


def check_writable(folder: Path) -> None:
    """Make a folder, and make sure that files can be written into it: growth takes long.

    Raises
    ------
    OutputError
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        reason = error.strerror or str(error)
        msg = f"{folder}: cannot be written to ({reason}); free space or choose another folder with -o"
        raise OutputError(msg) from error


def tell_of_poles(function: Command) -> Command:
    """Say on stderr where parameters may grow a pole, as a warning of a command."""

    @functools.wraps(function)
    def with_warnings(*args: Any, **given: Any) -> Any:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            result = function(*args, **given)
        for text in dict.fromkeys(str(warning.message) for warning in caught):
            LOGGER.warning("%s", text)
        return result

    return cast("Command", with_warnings)


def read_parameters(path: Path) -> dict[str, Any]:
    """Return the values of a TOML file of parameters.

    Raises
    ------
    InputMissingError, InputFormatError
        If it cannot be read.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        msg = f"{path}: there is no such file; check the name given to --params"
        raise InputMissingError(msg) from error
    except IsADirectoryError as error:
        msg = f"{path}: is a directory; give --params the TOML file in it"
        raise InputFormatError(msg) from error
    except (OSError, ValueError) as error:  # TOMLDecodeError and UnicodeDecodeError are ValueErrors
        msg = f"{path}: is not TOML ({error}); write KEY = VALUE on each line"
        raise InputFormatError(msg) from error
