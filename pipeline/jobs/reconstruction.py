"""All that is done for one tree in a run, with whatever goes wrong as a value."""

from __future__ import annotations

import traceback
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

from pyproj import CRS
from pyproj.exceptions import CRSError

from pipeline.cloud import CLOUD_SUFFIXES, read_cloud
from pipeline.cloud.units import other_unit
from pipeline.config import Config
from pipeline.errors import InputMissingError, OutputError, PipelineError, UsageError
from pipeline.jobs.inputs import Input
from pipeline.jobs.naming import named
from pipeline.jobs.summary import Outcome
from pipeline.model import PointCloud
from pipeline.run import Outputs, reconstruct, write_outputs
from pipeline.store import Store

CLOUDS = " ".join(CLOUD_SUFFIXES)
REPORT_IT = "run it with -v and report what it shows"


@dataclass(frozen=True)
class Reconstruction:
    """Makes the files of one tree; called with an `Input`, it returns an `Outcome` and never raises.

    Parameters
    ----------
    out : Path
        Each tree gets a folder of its name in it.
    config : Config
    formats : tuple of str
    crs : str, optional
        Reference system of clouds that name none.
    ground : Path, optional
        Points of the ground, where they are apart.
    species : str, optional
    picture : bool
    """

    out: Path
    config: Config
    formats: tuple[str, ...]
    crs: str | None = None
    ground: Path | None = None
    species: str | None = None
    picture: bool = True

    def prepare(self) -> None:
        """Make sure, before any work, that results can be written and the ground is there.

        Raises
        ------
        OutputError
            If the folder cannot be made or written to.
        InputMissingError
            If there is no ground file.
        """
        if self.ground is not None and not self.ground.is_file():
            msg = f"{self.ground}: there is no such file; check the name given to --ground"
            raise InputMissingError(msg)
        try:
            self.out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            msg = f"{self.out}: no folder can be made there ({error.strerror}); choose another one with --out"
            raise OutputError(msg) from error

    def __call__(self, tree: Input) -> Outcome:
        """Reconstruct one tree and write its files."""
        start, warnings = perf_counter(), list[str]()
        error = trace = None
        figures: dict[str, Any] = {}
        try:
            with named(tree.path):
                figures = self._make(tree, warnings.append)
        except PipelineError as expected:
            error = str(expected)
        except Exception as unexpected:  # it shall not cost the other trees
            error = f"{tree.path}: unexpected {type(unexpected).__name__} ({unexpected}); {REPORT_IT}"
            trace = traceback.format_exc()
        return Outcome(
            tree.name,
            str(tree.path),
            perf_counter() - start,
            error=None if error is None else " ".join(error.split()),
            trace=trace,
            warnings=tuple(f"{tree.path}: {warning}" for warning in warnings),
            figures=figures,
        )

    def _make(self, tree: Input, warn: Callable[[str], None]) -> dict[str, Any]:
        """Make the files of one tree and return its report."""
        if tree.path.is_dir():
            msg = f"{tree.path}: no point clouds are in this folder; give one that holds {CLOUDS}"
            raise InputMissingError(msg)
        store = Store()
        cloud = self._known(store.clock("read", read_cloud, tree.path))
        ground = store.clock("read", read_cloud, self.ground) if self.ground is not None else None
        model = reconstruct(cloud, self.config, store, ground)
        outputs = Outputs(self.out / tree.name, tree.name, self.formats, self.picture)
        if "several_stems" in model.metadata.get("flags", ()):
            warn("holds several stems, modelled as one tree; `treepipe batch` is for many trees")
        return write_outputs(model, cloud, outputs, config=self.config, store=store, warn=warn).to_dict()

    def _known(self, cloud: PointCloud) -> PointCloud:
        """Add to a cloud what the command knows of it."""
        added: dict[str, Any] = {} if self.species is None else {"species": self.species}
        if self.crs is None or cloud.crs is not None:
            return replace(cloud, metadata={**cloud.metadata, **added})
        return replace(cloud, crs=self.crs, metadata={**cloud.metadata, **added, "crs_assumed": True})

    def sweep(self, tree: Input) -> None:
        """Remove what a process that was killed has half written."""
        for remnant in (self.out / tree.name).glob(".tmp-*"):
            remnant.unlink(missing_ok=True)

    def lost(self, tree: Input, code: int | None) -> Outcome:
        """Return the outcome of a tree whose process died."""
        self.sweep(tree)
        msg = (
            f"{tree.path}: its worker process was ended from outside (exit code {code}), most often for "
            "want of memory; use fewer --workers or thin the points with --set clean.voxel_m=0.02"
        )
        return Outcome(tree.name, str(tree.path), 0.0, msg)


def parse_crs(text: str) -> str:
    """Return a reference system as ``EPSG:N``.

    Raises
    ------
    UsageError
        If the text is not of that form, there is no such system, or it does not count in metres.
    """
    authority, _, number = text.partition(":")
    try:
        if authority.upper() == "EPSG" and number.isdecimal():
            CRS.from_epsg(int(number))
            crs = f"EPSG:{int(number)}"
            unit = other_unit(crs)
            if unit is None:
                return crs
            reason = f"counts in the unit {unit}, and a tree is measured in metres"
        else:
            reason = "is not of the form EPSG:N"
    except CRSError:
        reason = "is not known"
    msg = f"--crs {text}: {reason}; give for example EPSG:28992"
    raise UsageError(msg)
