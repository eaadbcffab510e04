"""Opening a cloud, a model, or the folder of a run with its cloud, its options and its figures."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipeline.cloud import read_cloud
from pipeline.config import Config, read_config
from pipeline.errors import InputFormatError, InputMissingError, PipelineError
from pipeline.exchange import FORMATS, read_model, stem_of
from pipeline.jobs.inputs import stem
from pipeline.model import PointCloud, Skeleton, TreeModel
from pipeline.studio.folders import Folders
from pipeline.studio.scan.listing import REPORT, Kind, kind_of

CONFIG = "config.toml"
"""What a run writes of its options, beside the folders of its trees."""

FULLEST = ("npz", "lsjson", "lsjson-zst", "gpkg", "cityjson", "qsm", "skeleton")
"""Formats from which a run's model is read, those that keep most of it first."""

MOST_BYTES = 1_000_000
"""Of a report; a whole one has 2 000."""

Read = Callable[[Callable[[Path], Any], Path], Any]
"""Calls a reader with a file; elsewhere, where it takes long."""


@dataclass(frozen=True, eq=False)
class Opened:
    """What was opened.

    Parameters
    ----------
    path : Path
    kind : {"cloud", "model", "run"}
    name : str
        Of the tree; files that are downloaded have it.
    cloud : PointCloud, optional
    model : TreeModel or Skeleton, optional
        As a file holds it.
    config : Config
        The options that it was made with; the defaults where nothing tells.
    written : mapping, optional
        The report of a run.
    notes : tuple of str
        Sentences on what is missing.
    """

    path: Path
    kind: Kind
    name: str
    cloud: PointCloud | None = None
    model: TreeModel | Skeleton | None = None
    config: Config = field(default_factory=Config)
    written: Mapping[str, Any] | None = None
    notes: tuple[str, ...] = ()


def here(reader: Callable[[Path], Any], path: Path) -> Any:
    """Call a reader with a file in this process."""
    return reader(path)


def open_scan(path: Path, folders: Folders, read: Read = here) -> Opened:
    """Open a file, or the folder of a run.

    Parameters
    ----------
    path : Path
    folders : Folders
        Nothing outside of them is read.
    read : callable, optional
        Calls a reader with a file.

    Raises
    ------
    UsageError
        If it lies elsewhere.
    InputMissingError
        If it is not there.
    InputFormatError
        If it is nothing of a scan, or damaged.
    """
    real = folders.inside(path)
    if not real.exists():
        msg = f"{path}: there is no such file or folder; check the name"
        raise InputMissingError(msg)
    kind = kind_of(real)
    if kind == "run":
        return _run(real, folders, read)
    if kind == "model":
        return Opened(real, kind, stem_of(real), model=read(read_model, real))
    if kind == "cloud":
        return Opened(real, kind, stem(real), cloud=read(read_cloud, real))
    msg = f"{path}: is no cloud, no model with an axis and no folder of a run; give one of these"
    raise InputFormatError(msg)


def _run(folder: Path, folders: Folders, read: Read) -> Opened:
    """Open the folder of a run: its model, its figures, its options, and the cloud that it was made from."""
    written = _report(folder / REPORT)
    name = str(written.get("name") or folder.name)
    model = read(read_model, _model_of(folder, name))
    notes: list[str] = []
    config = _config_of(folder, folders, notes)
    cloud = _cloud_of(written, folder, folders, read, notes)
    return Opened(folder, "run", name, cloud, model, config, written, tuple(notes))


def _report(path: Path) -> Mapping[str, Any]:
    try:
        with path.open("rb") as file:
            found = json.loads(file.read(MOST_BYTES))
    except OSError as error:
        msg = f"{path}: cannot be read ({error.strerror}); check who may read it"
        raise InputMissingError(msg) from error
    except ValueError as error:
        msg = f"{path}: is no report of a run ({error}); make it again with `treepipe run`"
        raise InputFormatError(msg) from error
    if not isinstance(found, dict) or "flags" not in found:
        msg = f"{path}: is no report of a run; give a folder that `treepipe run` has made for a tree"
        raise InputFormatError(msg)
    return found


def _model_of(folder: Path, name: str) -> Path:
    for format_name in FULLEST:
        path = folder / f"{name}{FORMATS[format_name].suffix}"
        if path.is_file():
            return path
    known = ", ".join(FORMATS[format_name].suffix for format_name in FULLEST)
    msg = f"{folder}: holds no model of {name} that can be read; run it again with one of {known}"
    raise InputMissingError(msg)


def _config_of(folder: Path, folders: Folders, notes: list[str]) -> Config:
    """Read the options of a run, where they may be read."""
    for path in (folder / CONFIG, folder.parent / CONFIG):
        with suppress(PipelineError):
            real = folders.inside(path)
            if real.is_file():
                return read_config(real)
    notes.append("The run's config.toml is not in the folders: the options are the defaults.")
    return Config()


def _cloud_of(
    written: Mapping[str, Any], folder: Path, folders: Folders, read: Read, notes: list[str]
) -> PointCloud | None:
    """Read the cloud of a run, where it lies in the folders and still is the same."""
    source = dict(written.get("source") or {})
    given = source.get("path")
    if not given:
        notes.append("The report names no cloud: the model is shown alone.")
        return None
    for path in _candidates(Path(str(given)), folder, folders):
        cloud: PointCloud = read(read_cloud, path)
        if dict(cloud.metadata["source"])["sha256"] == source.get("sha256"):
            return cloud
        notes.append(f"{path.name} is another cloud than the run's: the model is shown alone.")
        return None
    notes.append(f"The cloud {given} is not in the folders: start the studio with its folder to see it.")
    return None


def _candidates(given: Path, folder: Path, folders: Folders) -> Iterator[Path]:
    """Yield where the cloud of a run may lie: as the report says, beside the run, in a folder given."""
    for path in (
        given,
        folder / given.name,
        folder.parent / given.name,
        *(each / given.name for each in folders.all),
    ):
        with suppress(PipelineError):
            real = folders.inside(path)
            if real.is_file():
                yield real
