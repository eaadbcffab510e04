"""What is opened and downloaded: trees to begin with, a year's tree in any format, the files of a replay."""

from __future__ import annotations

import shlex
import tomllib
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from pipeline.choosing import chosen
from pipeline.errors import InputFormatError, InputMissingError, UsageError
from pipeline.exchange import FORMATS, stem_of, write
from pipeline.formats.ply import open_ply
from pipeline.growth import GrowthOptions
from pipeline.jobs.standing import read_tree
from pipeline.model import TreeModel
from pipeline.studio.downloads import packed_as
from pipeline.studio.folders import Folders
from pipeline.studio.years.listing import MOST_BYTES
from pipeline.studio.years.plan import Plan, Start

MODELS = tuple(known.suffix for known in FORMATS.values() if known.read and known.suffix != ".skeleton.ply")
"""Suffixes of files that hold a tree with radii."""
MOST_LISTED = 200
EVENTS, PARAMETERS = ".events.toml", ".growth.toml"


def is_model(path: Path) -> bool:
    """Tell whether a file holds a tree, by its name; of a .ply, by what is in it."""
    name = path.name.lower()
    if not path.is_file():
        return False
    if path.suffix.lower() == ".ply" and not name.endswith((".mesh.ply", ".skeleton.ply")):
        return any(element.name == "edge" and element.count for element in open_ply(path).elements)
    return name.endswith((*MODELS, ".treeqsm.mat"))


def holds_events(path: Path) -> bool:
    """Tell whether a file is one of events: a TOML file with a table of that name."""
    if path.suffix.lower() != ".toml" or not path.is_file() or path.stat().st_size > MOST_BYTES:
        return False
    try:
        return "event" in tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError):
        return False


def models_in(folders: Folders) -> list[str]:
    """Return the models in the folders, and one folder down; at most `MOST_LISTED`."""

    def found() -> Iterator[Path]:
        for folder in folders.all:
            for pattern in ("*", "*/*"):
                yield from (path for path in sorted(folder.glob(pattern)) if _is_listed(path, folders))

    return [str(path) for path in islice(found(), MOST_LISTED)]


def open_start(path: Path, folders: Folders) -> Start:
    """Read a tree to begin with.

    Raises
    ------
    UsageError
        If it lies outside the folders.
    InputMissingError, InputFormatError
        If there is no such file, or it holds no tree with radii.
    """
    real = folders.inside(path)
    if not real.is_file():
        msg = f"{path}: there is no such file; choose another"
        raise InputMissingError(msg)
    tree = read_tree(real)
    if len(tree) < 2:
        msg = f"{path}: holds a tree of one node; choose another, or begin with a bud"
        raise InputFormatError(msg)
    return Start(stem_of(real), tree, real)


def read_bounded(path: Path, folders: Folders) -> bytes:
    """Read a file of events in one of the folders, and no more of it than a little beyond what is allowed.

    Raises
    ------
    UsageError
        If it lies elsewhere.
    InputMissingError
        If it cannot be read.
    """
    return folders.read(path, MOST_BYTES + 1)


def read_growth(content: bytes, name: str) -> GrowthOptions:
    """Read parameters of growth, such as `treepipe calibrate` writes.

    Raises
    ------
    InputFormatError
        If it is no TOML, too large, or of another kind.
    """
    try:
        if len(content) > MOST_BYTES:
            msg = f"has {len(content):,} bytes, more than the {MOST_BYTES:,} of parameters; choose another"
            raise UsageError(msg)
        return chosen(GrowthOptions, tomllib.loads(content.decode("utf-8-sig")))
    except UsageError as error:
        msg = f"{name}: {error}"
        raise InputFormatError(msg) from error
    except ValueError as error:
        msg = f"{name}: is no TOML ({error}); write KEY = VALUE on each line"
        raise InputFormatError(msg) from error


def packed(tree: TreeModel, format_name: str, stem: str) -> tuple[str, bytes]:
    """Return name and content of a download: one file, or a .zip where several belong together.

    Raises
    ------
    UsageError
        If there is no such format, or the tree is still a bud.
    """
    check_is_tree(tree)
    return packed_as(format_name, stem, lambda target: write(tree, target))


def check_is_tree(tree: TreeModel) -> None:
    """Make sure that there is more than a bud.

    Raises
    ------
    UsageError
    """
    if len(tree) < 2:
        msg = "year 0 of a bud has no wood; choose a later year"
        raise UsageError(msg)


def command_of(plan: Plan, stem: str) -> str:
    """Return the command that grows the same years from the files that are saved here.

    Examples
    --------
    >>> command_of(Plan(years=5, seed=3), "bud-3")
    'treepipe simulate --years 5 --seed 3 --params bud-3.growth.toml --every 1 -o years'
    """
    start = [] if plan.start.is_bud else [str(plan.start.path or f"{stem}-start.npz")]
    words = ["treepipe", "simulate", *start, "--years", str(plan.years), "--seed", str(plan.seed)]
    words += ["--species", plan.species] if plan.species is not None else []
    words += ["--params", f"{stem}{PARAMETERS}"]
    words += ["--events", f"{stem}{EVENTS}"] if plan.programmes else []
    return shlex.join([*words, "--every", "1", "-o", "years"])


def _is_listed(path: Path, folders: Folders) -> bool:
    if not path.name.lower().endswith(MODELS) or not path.is_file():
        return False
    try:
        folders.inside(path)
    except UsageError:
        return False
    return True
