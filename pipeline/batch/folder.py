"""The folder of a run: which run it belongs to, what is done in it, and who works in it now."""

from __future__ import annotations

import fcntl
import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from pipeline.airborne.grid import Cell, Window
from pipeline.batch import quarantine
from pipeline.batch.explode import TEMPORARY
from pipeline.batch.plan import Plan
from pipeline.errors import InputMissingError, OutputError, UsageError
from pipeline.output import write_text

PLAN = "plan.json"


@contextmanager
def locked(out: Path) -> Iterator[None]:
    """Keep the folder for one run; the lock goes with the process, however it ends.

    Raises
    ------
    OutputError
        If the folder cannot be written, or another run works in it.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        stream = (out / ".lock").open("w")
    except OSError as error:
        why = error.strerror
        msg = f"{out}: cannot be written ({why}); make it writable, or choose another folder with --out"
        raise OutputError(msg) from error
    with stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            msg = f"{out}: another run works in this folder; wait for it or choose another one with --out"
            raise OutputError(msg) from error
        yield


def claim(out: Path, plan: Plan) -> None:
    """Make the folder that of a plan, or make sure that it is.

    Raises
    ------
    UsageError
        If it holds results of other settings or other tiles.
    """
    if not require_same(out, plan):
        write_text(out / PLAN, json.dumps(_described(plan), indent=2, ensure_ascii=False) + "\n")


def require_same(out: Path, plan: Plan) -> bool:
    """Return whether a plan has begun in the folder; False where nothing has.

    Raises
    ------
    UsageError
        If it holds results of other settings or other tiles.
    """
    told = read_plan(out)
    if told is None:
        if (out / "cells").is_dir() and any((out / "cells").iterdir()):
            msg = (
                f"{out}: holds cells, but no {PLAN} that tells of which run; choose another folder with --out"
            )
            raise UsageError(msg)
        return False
    for key, meaning in (("config_hash", "settings"), ("input_hash", "tiles or areas")):
        now = getattr(plan, key)
        if told.get(key) != now:
            msg = (
                f"{out}: holds results of other {meaning} ({key} {told.get(key)} there, {now} now); "
                f"run it with the same {meaning}, or choose another folder with --out"
            )
            raise UsageError(msg)
    return True


def _described(plan: Plan) -> dict[str, Any]:
    return {
        "config_hash": plan.config_hash,
        "input_hash": plan.input_hash,
        "crs": plan.reference.crs,
        "crs_assumed": plan.reference.assumed,
        "core_m": plan.grid.core_m,
        "buffer_m": plan.grid.buffer_m,
        "tiles": [
            {
                "path": str(tile.path.resolve()),
                "points": tile.points,
                "extent": tile.extent,
                "fingerprint": tile.fingerprint,
            }
            for tile in plan.tiles
        ],
        "failed": dict(plan.failures),
        "cells": [cell.name for cell in plan.cells],
    }


def read_plan(out: Path) -> dict[str, Any] | None:
    """Return what is written of the plan of a folder; None where there is nothing.

    Raises
    ------
    OutputError
        If it cannot be read.
    """
    path = out / PLAN
    if not path.exists():
        return None
    try:
        told: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        msg = f"{path}: cannot be read ({error}); choose another folder with --out"
        raise OutputError(msg) from error
    return told


def known_plan(out: Path) -> dict[str, Any]:
    """Return what is written of the plan of a folder of results.

    Raises
    ------
    InputMissingError
        If it is no folder of results.
    """
    told = read_plan(out)
    if told is None:
        msg = f"{out}: is no folder of a batch (no {PLAN} is in it); give the folder named with --out"
        raise InputMissingError(msg)
    return told


def tile_extents(out: Path) -> list[Window]:
    """Return west, south, east and north of the tiles of a folder's plan, as far as it tells them."""
    tiles = (read_plan(out) or {}).get("tiles", [])
    return [tuple(tile["extent"]) for tile in tiles if "extent" in tile]


def planned(out: Path, told: dict[str, Any]) -> list[Cell]:
    """Return the cells of a folder's plan, those that were split replaced by their quarters."""
    cells = (Cell.named(name) for name in told["cells"])
    return [leaf for cell in cells for leaf in quarantine.leaves(out, cell)]


def sweep(out: Path) -> None:
    """Remove what a process that was killed has left half written."""
    for place in ("", "cells/*/", "work/*/", "quarantine/", "splits/"):
        for path in out.glob(f"{place}{TEMPORARY}*"):
            path.unlink(missing_ok=True)
    shutil.rmtree(out / "work" / "claims", ignore_errors=True)


def drop_points(out: Path, root: Cell) -> None:
    """Remove the points of a cell that is done with all its quarters."""
    shutil.rmtree(out / "work" / root.name, ignore_errors=True)


def drop_slices(out: Path) -> None:
    """Remove what says of slices that they are exploded, unless points of a cell of theirs still wait."""
    work = out / "work"
    for path in (work / "slices").glob("*.json"):
        try:
            cells = json.loads(path.read_text(encoding="utf-8"))["cells"]
        except (OSError, ValueError, LookupError):  # it says nothing to a run that goes on either
            cells = ()
        if not any((work / name).is_dir() for name in cells):
            path.unlink(missing_ok=True)
    for emptied in (work / "slices", work):
        with suppress(OSError):  # something is still in it, or it is gone
            emptied.rmdir()
