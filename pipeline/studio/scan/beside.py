"""What is known of a tree beside its points: where its ground is, its reference system, its species."""

from __future__ import annotations

import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from pipeline.errors import UsageError
from pipeline.jobs.reconstruction import parse_crs
from pipeline.model import PointCloud

MOST_LETTERS = 100


class Beside(NamedTuple):
    """What `treepipe run` takes as ``--ground``, ``--crs`` and ``--species``.

    Attributes
    ----------
    ground : Path or None
        A cloud of the ground, where it is apart.
    crs : str or None
        Reference system, if the cloud names none.
    species : str or None
    """

    ground: Path | None = None
    crs: str | None = None
    species: str | None = None

    def known(self, cloud: PointCloud) -> PointCloud:
        """Return a cloud with what is known of it, as `treepipe run` does."""
        if self.species is not None:
            cloud = replace(cloud, metadata={**cloud.metadata, "species": self.species})
        if self.crs is not None and cloud.crs is None:
            return replace(cloud, crs=self.crs, metadata={**cloud.metadata, "crs_assumed": True})
        return cloud

    def arguments(self) -> list[str]:
        """Return the options of the command line that say the same."""
        given: dict[str, Any] = {"--ground": self.ground, "--crs": self.crs, "--species": self.species}
        return [word for name, value in given.items() if value is not None for word in (name, str(value))]


NOTHING_BESIDE = Beside()


def system(text: str) -> str | None:
    """Return a reference system as it was typed; nothing is None.

    Raises
    ------
    UsageError
        If there is no such system.

    Examples
    --------
    >>> system(" epsg:28992 ")
    'EPSG:28992'
    """
    try:
        return parse_crs(text.strip()) if text.strip() else None
    except UsageError as error:
        msg = str(error).removeprefix("--crs ")
        raise UsageError(msg) from error


def species(text: str) -> str | None:
    """Return a species as it was typed; nothing is None.

    Raises
    ------
    UsageError
        If it is too long for a name.
    """
    if len(text) > MOST_LETTERS:
        msg = f"a species of {len(text):,} letters is no name; give at most {MOST_LETTERS}"
        raise UsageError(msg)
    return text.strip() or None


def command_of(cloud: Path, stem: str, beside: Beside) -> str:
    """Return the command that makes the same model from the options that are saved.

    Examples
    --------
    >>> command_of(Path("oak.laz"), "oak", Beside(species="Quercus robur"))
    "treepipe run oak.laz --config oak.toml --species 'Quercus robur' --out out"
    """
    words = ["treepipe", "run", str(cloud), "--config", f"{stem}.toml", *beside.arguments()]
    return shlex.join([*words, "--out", "out"])
