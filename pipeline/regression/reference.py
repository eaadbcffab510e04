"""A reference: the model and figures of one tree that somebody has looked at and accepted."""

from __future__ import annotations

import getpass
import hashlib
import json
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from pipeline.config import Config, read_config
from pipeline.errors import InputFormatError, InputMissingError
from pipeline.exchange import FORMATS, read_model
from pipeline.lsystem import encode, write_lsjson
from pipeline.model import TreeModel
from pipeline.output import write_text
from pipeline.version import __version__

VERSION = 1
FILE = "reference.json"
MODEL = ".ls.json"
CONFIG = "config.toml"


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True)


class Format(_Part):
    """What the file is, and its version."""

    name: Literal["treepipe-reference"] = "treepipe-reference"
    version: Annotated[int, Field(ge=1, le=VERSION)] = VERSION


class Accepted(_Part):
    """Who took it for good, when and why."""

    when: str
    who: str | None
    note: str


class Reference(_Part):
    """What is kept beside the model of an accepted tree.

    Parameters
    ----------
    name : str
    figures : mapping
        The tree's report.json.
    model_sha256 : str
        Of the .ls.json beside it.
    has_config : bool
        Whether the settings that made it are kept too; else they were the defaults.
    """

    format: Format = Format()
    name: str
    accepted: Accepted
    version: str
    model_sha256: str
    has_config: bool
    figures: dict[str, Any]

    @property
    def cloud(self) -> str | None:
        """The cloud that it was made of, as it was named then."""
        return (self.figures.get("source") or {}).get("path")

    @property
    def cloud_sha256(self) -> str | None:
        """Of the cloud's bytes."""
        return (self.figures.get("source") or {}).get("sha256")


def accept(
    models: Path, references: Path, *, only: str | None = None, note: str = "", who: str | None = None
) -> list[str]:
    """Keep the trees of a run as references; those that were kept before are replaced.

    Parameters
    ----------
    models : Path
        The folder of a run, or of one of its trees.
    references : Path
        Made if need be.
    only : str, optional
        The tree to keep; else all.
    note : str
        Why they are good.
    who : str, optional
        Who says so; else the user's name.

    Returns
    -------
    list of str
        Names of the trees that were kept.

    Raises
    ------
    InputMissingError
        If there is no tree in the folder, or none of this name.
    InputFormatError
        If a report or a model cannot be read.
    OutputError
        If a reference cannot be written.
    """
    found = dict(trees_of(models))
    wanted = [name for name in found if only in (None, name)]
    if not wanted:
        lack = f"{models}: has no tree{f' {only!r}' if only else ''} to accept"
        there = f"there is {', '.join(sorted(found))}; give one of these with --only"
        none = "no folder in it has a report.json; give the --out of a `treepipe run`"
        msg = f"{lack}: {there if found else none}"
        raise InputMissingError(msg)
    for name in wanted:
        _keep(
            name, found[name], models, references / name, Accepted(when=_now(), who=who or _user(), note=note)
        )
    return wanted


def trees_of(folder: Path) -> Iterator[tuple[str, Path]]:
    """Go through the trees that a run has written: name and folder."""
    if not folder.is_dir():
        msg = f"{folder}: there is no such folder; give the --out of a `treepipe run`"
        raise InputMissingError(msg)
    own = [folder] if (folder / "report.json").is_file() else []
    for each in own or sorted(path.parent for path in folder.glob("*/report.json")):
        yield each.resolve().name, each


def read_report(folder: Path) -> dict[str, Any]:
    """Read the report.json of a tree.

    Raises
    ------
    InputFormatError
        If it cannot be read.
    """
    path = folder / "report.json"
    try:
        figures: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        msg = f"{path}: cannot be read as a report ({error}); run treepipe again"
        raise InputFormatError(msg) from error
    return figures


def model_of(name: str, folder: Path) -> TreeModel:
    """Read the model of a tree, in whatever format there is one.

    Raises
    ------
    InputMissingError
        If there is none.
    InputFormatError
        If it is damaged.
    """
    for known in FORMATS.values():
        path = folder / f"{name}{known.suffix}"
        if known.read is not None and path.is_file():
            model = read_model(path)
            if isinstance(model, TreeModel):
                return model
    msg = f"{folder}: holds no model of {name}; run treepipe with the format lsjson"
    raise InputMissingError(msg)


def read_references(folder: Path) -> dict[str, Reference]:
    """Read all references of a folder, by name.

    Raises
    ------
    InputMissingError
        If there is no such folder, or no reference in it.
    InputFormatError
        If one cannot be read, or a newer treepipe has written it.
    """
    if not folder.is_dir():
        msg = f"{folder}: there is no such folder of references; make one with `treepipe regress accept`"
        raise InputMissingError(msg)
    found = {path.parent.name: _read(path) for path in sorted(folder.glob(f"*/{FILE}"))}
    if not found:
        msg = f"{folder}: holds no reference; make some with `treepipe regress accept`"
        raise InputMissingError(msg)
    return found


def config_of(reference: Reference, folder: Path) -> Config:
    """Read the settings that a reference was made with."""
    return read_config(folder / reference.name / CONFIG) if reference.has_config else Config()


def sha256_of(path: Path) -> str:
    """Return the hash of a file's bytes."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _keep(name: str, folder: Path, models: Path, target: Path, accepted: Accepted) -> None:
    """Write one reference: the model, the settings, and what says what they are."""
    figures, tree = read_report(folder), model_of(name, folder)
    config = _config_text(figures, models)
    model = target / f"{name}{MODEL}"
    write_lsjson(encode(tree), model)
    if config is not None:
        write_text(target / CONFIG, config)
    kept = Reference(
        name=name,
        accepted=accepted,
        version=str(figures.get("version") or __version__),
        model_sha256=sha256_of(model),
        has_config=config is not None,
        figures=figures,
    )
    write_text(target / FILE, kept.model_dump_json(indent=2) + "\n")


def _config_text(figures: Mapping[str, Any], models: Path) -> str | None:
    """Return the settings of a run that were not the defaults.

    Raises
    ------
    InputMissingError
        If they are not there any more.
    """
    wanted = figures.get("config_hash")
    if wanted in (None, Config().config_hash):
        return None
    for path in (models / CONFIG, models.parent / CONFIG):
        if path.is_file() and read_config(path).config_hash == wanted:
            return path.read_text(encoding="utf-8")
    msg = (
        f"{models / CONFIG}: is not what this run was made with, and that was not the defaults; run it again"
    )
    raise InputMissingError(msg)


def _read(path: Path) -> Reference:
    try:
        reference = Reference.model_validate_json(path.read_text(encoding="utf-8"))
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        key = ".".join(map(str, first["loc"]))
        newer = key == "format.version"
        remedy = "a newer treepipe has written it; update this one" if newer else "accept the tree again"
        msg = f"{path}: is no reference ({key}: {first['msg']}); {remedy}"
        raise InputFormatError(msg) from None
    except (OSError, ValueError) as error:
        msg = f"{path}: cannot be read ({error}); accept the tree again"
        raise InputFormatError(msg) from error
    model = path.parent / f"{reference.name}{MODEL}"
    if not model.is_file() or sha256_of(model) != reference.model_sha256:
        msg = f"{model}: is not the model that was accepted; accept the tree again"
        raise InputFormatError(msg)
    return reference


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


def _user() -> str | None:
    try:
        return getpass.getuser()
    except (OSError, KeyError):
        return None
