"""Files of the modeller: parameters as TOML, models in every format."""

from __future__ import annotations

import re
import tomllib
from contextlib import suppress
from pathlib import Path

from pipeline.errors import InputFormatError, UsageError
from pipeline.exchange import SURFACES, write, write_surface
from pipeline.studio.downloads import packed_as
from pipeline.studio.folders import Folders
from pipeline.studio.modeller.modelling import Modelled
from pipeline.studio.modeller.parameters import options_of
from pipeline.synthetic.colonization import ColonizationOptions, look_of
from pipeline.toml import to_toml

TOML = ".toml"
MOST_BYTES = 100_000
"""Of a parameter file; a whole one has 6 000."""

EVENT = re.compile(rb"^\s*\[\[\s*event\s*\]\]", re.MULTILINE)

PICTURES = ("bark_picture", "leaf_picture")


def read_parameters(content: bytes, name: str, folders: Folders) -> ColonizationOptions:
    """Read parameters as `save_parameters` writes them; what is not named has its default.

    Parameters
    ----------
    content : bytes
        Of a TOML file, at most `MOST_BYTES`.
    name : str
        Stands before what is wrong.
    folders : Folders
        Where pictures that the parameters name may lie.

    Raises
    ------
    InputFormatError
        If it is too large, no TOML, or of another program.
    """
    try:
        if len(content) > MOST_BYTES:
            msg = f"has {len(content)} bytes, more than the {MOST_BYTES} of parameters; choose another"
            raise UsageError(msg)
        options = options_of(tomllib.loads(content.decode("utf-8-sig")))
        for key in PICTURES:
            if picture := getattr(options, key):
                folders.inside(Path(picture))
    except (UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        msg = f"{name}: is no TOML ({error}); give a file that the studio has saved"
        raise InputFormatError(msg) from error
    except UsageError as error:
        msg = f"{name}: {error}"
        raise InputFormatError(msg) from error
    return options


def open_parameters(path: Path, folders: Folders) -> ColonizationOptions:
    """Read a parameter file in one of the folders.

    Raises
    ------
    InputMissingError, InputFormatError, UsageError
        If it is not there, cannot be read, or lies elsewhere.
    """
    return read_parameters(folders.read(path, MOST_BYTES + 1), str(path), folders)


def holds_events(path: Path) -> bool:
    """Tell whether a TOML file lists the events of years rather than parameters."""
    with suppress(OSError):
        return EVENT.search(path.read_bytes()) is not None
    return False


def save_parameters(options: ColonizationOptions) -> bytes:
    """Write all parameters as TOML, every key explained."""
    return to_toml(options).encode()


def write_model(modelled: Modelled, target: Path) -> None:
    """Write a tree in the format of the suffix; surfaces with leaves and pictures.

    Raises
    ------
    UsageError, OutputError
        If the suffix names no format, or the file cannot be written.
    """
    if target.name.lower().endswith(tuple(SURFACES)):
        write_surface(modelled.mesh(), target, look_of(modelled.options))
    else:
        write(modelled.tree, target)


def packed(modelled: Modelled, format_name: str, stem: str) -> tuple[str, bytes]:
    """Return the name and content of a download: one file, or a .zip where several belong together.

    Raises
    ------
    UsageError
        If there is no such format.
    """
    return packed_as(format_name, stem, lambda target: write_model(modelled, target))
