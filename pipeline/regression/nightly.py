"""All references of a folder against today: reconstructed anew, or as today's run has written them."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pipeline.cloud import CLOUD_SUFFIXES, read_cloud
from pipeline.config import Config
from pipeline.errors import InputMissingError, PipelineError
from pipeline.lsystem import decode, read_lsjson
from pipeline.model import Skeleton, TreeModel
from pipeline.regression.check import Check, check_tree
from pipeline.regression.reference import (
    MODEL,
    Reference,
    config_of,
    model_of,
    read_references,
    read_report,
    sha256_of,
    trees_of,
)
from pipeline.regression.tolerance import Tolerances
from pipeline.run import Outputs, reconstruct, write_outputs
from pipeline.store import Store

Status = Literal["ok", "drift", "missing", "failed", "new"]


@dataclass(frozen=True)
class TreeNight:
    """What came of one tree.

    Parameters
    ----------
    name : str
    status : str
        ok, drift, missing (today's run has it not), failed (it could not be checked) or new (without a
        reference).
    message : str
        What to know of it; empty where all is well.
    checks : tuple of Check
    skeletons : (Skeleton, Skeleton) or None
        Then and now, to be drawn.
    """

    name: str
    status: Status
    message: str = ""
    checks: tuple[Check, ...] = ()
    skeletons: tuple[Skeleton, Skeleton] | None = None

    @property
    def worst(self) -> Check | None:
        """The check that is off by most tolerances."""
        return max(self.checks, key=lambda check: check.severity, default=None)

    @property
    def severity(self) -> float:
        """The worst check's."""
        return self.worst.severity if self.worst else 0.0


@dataclass(frozen=True)
class Night:
    """What came of all trees."""

    trees: tuple[TreeNight, ...]

    def of(self, *statuses: Status) -> list[TreeNight]:
        """Return the trees with one of these outcomes."""
        return [tree for tree in self.trees if tree.status in statuses]

    @property
    def exit_code(self) -> int:
        """1 on drift, 3 where something could not be checked, else 0."""
        return 1 if self.of("drift", "missing") else 3 if self.of("failed") else 0

    @property
    def worst(self) -> TreeNight | None:
        """The tree that has drifted most."""
        return max(self.of("drift"), key=lambda tree: tree.severity, default=None)


def guard(
    references: Path,
    out: Path,
    *,
    clouds: Path | None = None,
    models: Path | None = None,
    config: Callable[[Config], Config] | None = None,
) -> Night:
    """Check all references of a folder.

    Parameters
    ----------
    references : Path
    out : Path
        Today's models go to its folder ``models`` where they are reconstructed.
    clouds : Path, optional
        Where to find the clouds by name; else where they were.
    models : Path, optional
        What today's run has written; then nothing is reconstructed.
    config : callable, optional
        Changes the settings of the references, which otherwise are used as they were.

    Raises
    ------
    InputMissingError, InputFormatError
        If the references or their tolerances cannot be read.
    """
    known, tolerances = read_references(references), Tolerances.read(references)
    today = dict(trees_of(models)) if models is not None else {}

    def night(reference: Reference) -> TreeNight:
        if models is not None:
            if reference.name not in today:
                return TreeNight(reference.name, "missing", f"{models}: has no {reference.name}")
            found = _written(reference.name, today[reference.name])
        else:
            settings = config_of(reference, references)
            found = _anew(reference, config(settings) if config else settings, clouds, out / "models")
        return _against(reference, references, found, tolerances)

    trees = [_safely(reference, night) for reference in known.values()]
    new = [TreeNight(name, "new", "has no reference yet") for name in today if name not in known]
    return Night(tuple(trees + new))


Found = tuple[dict[str, Any], TreeModel, str]


def _against(reference: Reference, folder: Path, found: Found, tolerances: Tolerances) -> TreeNight:
    figures, now, message = found
    then = decode(read_lsjson(folder / reference.name / f"{reference.name}{MODEL}"))
    checks = check_tree((reference.figures, figures), (then, now), tolerances.of(reference.name))
    status: Status = "ok" if all(check.ok for check in checks) else "drift"
    return TreeNight(reference.name, status, message, tuple(checks), (then.skeleton, now.skeleton))


def _safely(reference: Reference, night: Callable[[Reference], TreeNight]) -> TreeNight:
    try:
        return night(reference)
    except PipelineError as error:
        return TreeNight(reference.name, "failed", str(error))


def _written(name: str, folder: Path) -> Found:
    return read_report(folder), model_of(name, folder), ""


def _anew(reference: Reference, config: Config, clouds: Path | None, out: Path) -> Found:
    """Reconstruct a reference's cloud as `treepipe run` does."""
    path = _cloud(reference, clouds)
    changed = reference.cloud_sha256 not in (None, sha256_of(path))
    store = Store()
    cloud = store.clock("read", read_cloud, path)
    tree = reconstruct(cloud, config, store)
    outputs = Outputs(out / reference.name, reference.name, ("lsjson",), picture=False)
    figures = write_outputs(tree, cloud, outputs, config=config, store=store).to_dict()
    again = model_of(reference.name, outputs.folder)  # as its file has it: writing is checked too
    return figures, again, f"{path}: is not the cloud of the reference" if changed else ""


def _cloud(reference: Reference, clouds: Path | None) -> Path:
    """Find the cloud of a reference.

    Raises
    ------
    InputMissingError
        If it is gone.
    """
    named: Iterable[Path] = [Path(reference.cloud)] if reference.cloud else []
    if clouds is not None:
        named = [clouds / Path(path).name for path in named]
        named += [clouds / f"{reference.name}{suffix}" for suffix in CLOUD_SUFFIXES]
    for path in named:
        if path.is_file():
            return path
    where = clouds or reference.cloud or "its cloud"
    msg = f"{where}: the cloud of {reference.name} is gone; name its folder with --clouds"
    raise InputMissingError(msg)
