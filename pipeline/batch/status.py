"""What a folder of results holds: cells that are done, quarantined or missing, and their trees."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pipeline.batch import folder, manifests, quarantine


@dataclass(frozen=True)
class CellStatus:
    """How far a cell is: ``done``, ``quarantined`` or ``missing``."""

    cell: str
    state: str
    trees: int | None = None
    fallback_trees: int | None = None
    points: int | None = None
    seconds: float | None = None
    reason: str | None = None
    error: str | None = None


@dataclass(frozen=True)
class Status:
    """How far a run is."""

    cells: tuple[CellStatus, ...]
    crs: str
    crs_assumed: bool

    def count(self, state: str) -> int:
        """Return the number of cells in a state."""
        return sum(cell.state == state for cell in self.cells)

    @property
    def trees(self) -> int:
        """Trees of the cells that are done."""
        return sum(cell.trees or 0 for cell in self.cells)

    def to_dict(self) -> dict[str, Any]:
        """Return all of it, for JSON."""
        return {
            "planned": len(self.cells),
            "done": self.count("done"),
            "quarantined": self.count("quarantined"),
            "missing": self.count("missing"),
            "trees": self.trees,
            "fallback_trees": sum(cell.fallback_trees or 0 for cell in self.cells),
            "crs": self.crs,
            "crs_assumed": self.crs_assumed,
            "cells": [asdict(cell) for cell in self.cells],
        }


def status(out: Path) -> Status:
    """Look what is done in a folder of results.

    Raises
    ------
    InputMissingError
        If it is no folder of results.
    """
    told = folder.known_plan(out)
    held = quarantine.quarantined(out)
    hashes = told["config_hash"], told["input_hash"]
    found = []
    for cell in folder.planned(out, told):
        manifest = manifests.done(out, cell, *hashes)
        if manifest is not None:
            keys = ("trees", "fallback_trees", "points", "seconds")
            found.append(CellStatus(cell.name, "done", **{key: manifest.get(key) for key in keys}))
        elif cell.name in held:
            facts = held[cell.name]
            reason, error = facts.get("reason"), facts.get("error")
            found.append(CellStatus(cell.name, "quarantined", reason=reason, error=error))
        else:
            found.append(CellStatus(cell.name, "missing"))
    return Status(tuple(found), told["crs"], told["crs_assumed"])
