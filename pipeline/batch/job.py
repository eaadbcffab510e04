"""What workers are told to do, and what they answer."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from pipeline.airborne.grid import Cell, GridOptions

Status = Literal["done", "failed", "crashed", "memory", "split"]


@dataclass(frozen=True)
class Job:
    """What all cells of a run share, and the function that does one.

    Parameters
    ----------
    work : callable
        ``work(cell, points, folder, job) -> manifest``: makes the files of a cell in `folder`, the
        manifest last, from the file `points`.
    out : Path
    grid : GridOptions
    config_hash, input_hash : str
    config_json : str
    crs : str
    crs_assumed : bool
    attempts : int
        Processes that a task may cost.
    extra : dict
        What else `work` needs.
    """

    work: Callable[[Cell, Path, Path, Job], dict[str, Any]]
    out: Path
    grid: GridOptions
    config_hash: str
    input_hash: str
    config_json: str = "{}"
    crs: str = ""
    crs_assumed: bool = False
    attempts: int = 2
    extra: dict[str, Any] = field(default_factory=dict)

    @property
    def points(self) -> Path:
        """Where the points of cells are."""
        return self.out / "work"

    @property
    def run(self) -> str:
        """Name of the run: a scheduler that serves two of them tells their cells apart by it."""
        told = (str(self.out), self.config_hash, self.input_hash)
        return hashlib.sha256(json.dumps(told).encode()).hexdigest()[:12]


@dataclass(frozen=True)
class Outcome:
    """What became of a task.

    Parameters
    ----------
    status : str
    facts : dict
        Of a cell, its manifest; of a slice, what `explode` returns; of a split cell, its ``points`` or
        ``size_m``, which are too many or too large.
    error, trace : str, optional
    deaths : tuple of (str, int)
        Worker and process of the attempts that were lost.
    """

    status: Status
    facts: dict[str, Any] = field(default_factory=dict)
    error: str | None = None
    trace: str | None = None
    deaths: tuple[tuple[str, int], ...] = ()
