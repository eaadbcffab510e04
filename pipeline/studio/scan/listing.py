"""What the allowed folders hold that can be opened: clouds, models, and folders of runs."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Literal, NamedTuple

from pipeline.cloud import CLOUD_SUFFIXES
from pipeline.errors import PipelineError
from pipeline.exchange import FORMATS
from pipeline.formats.ply import open_ply
from pipeline.studio.folders import Folders

Kind = Literal["cloud", "model", "run"]

REPORT = "report.json"
"""A folder that holds it is that of a run."""

OTHER_MODELS = (".treeqsm.mat",)
SURFACES_ALONE = tuple(known.suffix for known in FORMATS.values() if known.read is None)
MODELS = (*(known.suffix for known in FORMATS.values() if known.read is not None), *OTHER_MODELS)
NEITHER = (".inventory.csv", ".truth.gpkg")

DEEPEST = 4
MOST_FOLDERS = 2_000
MOST_FILES = 1_000
"""More are not listed; the others are opened from the command line."""


class Entry(NamedTuple):
    """A file or folder that can be opened.

    Attributes
    ----------
    path : Path
    kind : {"cloud", "model", "run"}
    label : str
        Its way from the folder that was given, with the name of that one where there are several.
    """

    path: Path
    kind: Kind
    label: str


def entries(folders: Folders) -> list[Entry]:
    """List what can be opened: runs, then clouds, then models, each by name; links lead nowhere else."""
    found: dict[Path, Entry] = {}
    for folder in folders.all:
        front = f"{folder.name}/" if len(folders.all) > 1 else ""
        for path in _below(folder):
            kind = kind_of(path)
            if kind is None or len(found) >= MOST_FILES or not _is_inside(path, folders):
                continue
            away = path.relative_to(folder)
            found.setdefault(path, Entry(path, kind, front + (str(away) if path != folder else ".")))
    ranks = {"run": 0, "cloud": 1, "model": 2}
    return sorted(found.values(), key=lambda entry: (ranks[entry.kind], entry.label))


def kind_of(path: Path) -> Kind | None:
    """Tell what a file or folder is, by its name, and a .ply by what it holds; None of anything else."""
    if path.is_dir():
        return "run" if (path / REPORT).is_file() else None
    name = path.name.lower()
    if not path.is_file() or name.endswith((*SURFACES_ALONE, *NEITHER)):
        return None
    if name.endswith(MODELS):
        return "model"
    if not name.endswith(CLOUD_SUFFIXES):
        return None
    return _kind_of_ply(path) if name.endswith(".ply") else "cloud"


def _kind_of_ply(path: Path) -> Kind | None:
    try:
        held = {element.name for element in open_ply(path).elements if element.count}
    except PipelineError:
        return "cloud"  # a broken one: opening it says why
    return "model" if "edge" in held else None if "face" in held else "cloud"


def _below(folder: Path) -> Iterator[Path]:
    """Yield a folder, and what lies in it and in those below, not too deep; hidden ones stay hidden."""
    base = len(folder.parts)
    for count, (name, below, files) in enumerate(os.walk(folder)):
        here = Path(name)
        below[:] = sorted(each for each in below if not each.startswith("."))
        if count >= MOST_FOLDERS or len(here.parts) - base >= DEEPEST:
            below.clear()
        yield here
        yield from (here / file for file in sorted(files) if not file.startswith("."))


def _is_inside(path: Path, folders: Folders) -> bool:
    try:
        folders.inside(path)
    except PipelineError:
        return False
    return True
