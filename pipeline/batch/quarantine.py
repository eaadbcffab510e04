"""Cells that failed for good, with the reason; and cells that were split, with their quarters.

Each is a small file of its own, written whole, so that a run that is killed knows on its return what
was decided. A cell that was split is no cell of the plan any more: its quarters are.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pipeline.airborne.grid import Cell, split
from pipeline.output import write_text


def quarantine_path(out: Path, cell: Cell) -> Path:
    """Return the file that tells why a cell failed."""
    return out / "quarantine" / f"{cell.name}.json"


def split_path(out: Path, cell: Cell) -> Path:
    """Return the file that tells why a cell was split."""
    return out / "splits" / f"{cell.name}.json"


def put(out: Path, cell: Cell, reason: str, **facts: Any) -> None:
    """Quarantine a cell.

    Parameters
    ----------
    out : Path
    cell : Cell
    reason : str
        ``crashed``, ``memory``, ``failed`` or ``tile``.
    **facts
        What else is known: ``error``, a sentence; ``trace``; ``attempts``; the hashes of the run.
    """
    _write(quarantine_path(out, cell), {"cell": cell.name, "reason": reason, **facts})


def put_split(out: Path, cell: Cell, reason: str, **facts: Any) -> tuple[Cell, ...]:
    """Replace a cell by its quarters, because of its ``points``, its ``size`` or of ``memory``."""
    quarters = split(cell)
    told = {"cell": cell.name, "reason": reason, "quarters": [quarter.name for quarter in quarters]}
    _write(split_path(out, cell), told | facts)
    return quarters


def leaves(out: Path, cell: Cell) -> tuple[Cell, ...]:
    """Return the cells that stand for a cell of the plan: itself, or its quarters, and theirs."""
    if not split_path(out, cell).is_file():
        return (cell,)
    return tuple(leaf for quarter in split(cell) for leaf in leaves(out, quarter))


def quarantined(out: Path) -> dict[str, dict[str, Any]]:
    """Return what is known of all quarantined cells, by name."""
    return {path.stem: _read(path) for path in sorted((out / "quarantine").glob("*.json"))}


def release(out: Path) -> list[str]:
    """Remove all cells from quarantine, so that the next run does them again; return their names."""
    paths = sorted((out / "quarantine").glob("*.json"))
    for path in paths:
        path.unlink()
    return [path.stem for path in paths]


def _write(path: Path, facts: Mapping[str, Any]) -> None:
    write_text(path, json.dumps(facts, indent=2, ensure_ascii=False) + "\n")


def _read(path: Path) -> dict[str, Any]:
    """Read a file; one that a disk has damaged tells nothing, but the cell stays in quarantine."""
    try:
        facts = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return facts if isinstance(facts, dict) else {}
