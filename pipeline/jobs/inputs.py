"""From the files and folders of a command to named trees, wrong usage found before any work."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pipeline.cloud import CLOUD_SUFFIXES
from pipeline.errors import OutputExistsError, UsageError
from pipeline.exchange import FORMATS

MODEL_SUFFIXES = (
    *(known.suffix for known in FORMATS.values()),
    *(".ground.laz", ".ground.las", ".treeqsm.txt", ".simpleforest.csv", ".treefile.txt", ".inventory.csv"),
)
"""What a folder may hold beside clouds: our own outputs, models of other programs, lists."""


@dataclass(frozen=True)
class Input:
    """One tree to be made: its name and the file of its points."""

    name: str
    path: Path


def find_inputs(paths: Iterable[Path]) -> tuple[list[Input], list[Path]]:
    """Find the clouds that are asked for.

    Parameters
    ----------
    paths : iterable of Path
        Files, and folders that mean the clouds in them.

    Returns
    -------
    inputs : list of Input
        In the order of `paths`, the clouds of a folder by name. A folder without clouds stands for
        itself, so that it fails like a missing file does.
    skipped : list of Path
        Files of models in the folders.

    Raises
    ------
    UsageError
        If the suffix of a file is of no cloud, or two inputs have the same name.
    """
    inputs: list[Input] = []
    skipped: list[Path] = []
    for path in paths:
        if path.is_dir():
            clouds, models = clouds_in(path)
            inputs += [Input(stem(cloud), cloud) for cloud in clouds] or [Input(path.resolve().name, path)]
            skipped += models
        else:
            _check_suffix(path)
            inputs.append(Input(stem(path), path))
    _check_names(inputs)
    return inputs, skipped


def clouds_in(folder: Path) -> tuple[list[Path], list[Path]]:
    """Return the clouds in a folder, and the models that could be taken for clouds, both by name."""
    files = sorted(
        path
        for path in folder.iterdir()
        if path.is_file() and not path.name.startswith(".") and path.suffix.lower() in CLOUD_SUFFIXES
    )
    models = [path for path in files if path.name.lower().endswith(MODEL_SUFFIXES)]
    return [path for path in files if path not in models], models


def stem(path: Path) -> str:
    """Return the name of a cloud without its suffix.

    Examples
    --------
    >>> stem(Path("plots/oak.copc.laz")), stem(Path("oak.2024.xyz"))
    ('oak', 'oak.2024')
    """
    name = path.stem
    return name[: -len(".copc")] if path.name.lower().endswith(".copc.laz") else name


def check_free(out: Path, inputs: Sequence[Input], *, overwrite: bool) -> None:
    """Make sure that nothing would be written over unasked.

    Raises
    ------
    OutputExistsError
        If there are results already and `overwrite` is False.
    """
    if overwrite:
        return
    for path in (*(out / each.name for each in inputs), out / "summary.json"):
        if path.is_file() or (path.is_dir() and any(path.iterdir())):
            msg = f"{path}: exists already; add --overwrite or choose another folder with --out"
            raise OutputExistsError(msg)


def _check_suffix(path: Path) -> None:
    if path.exists() and path.suffix.lower() not in CLOUD_SUFFIXES:
        known = " ".join(CLOUD_SUFFIXES)
        msg = f"{path}: the suffix {path.suffix!r} is not one of a point cloud; convert it to one of {known}"
        raise UsageError(msg)


def _check_names(inputs: Iterable[Input]) -> None:
    by_name: dict[str, list[Path]] = defaultdict(list)
    for each in inputs:
        by_name[each.name].append(each.path)
    for name, paths in by_name.items():
        if len(paths) > 1:
            msg = (
                f"{paths[1]}: has the same name as {paths[0]}, both would be written to {name}/; "
                "rename one or run them into different folders"
            )
            raise UsageError(msg)
