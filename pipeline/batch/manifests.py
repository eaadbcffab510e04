"""The file that, written last, says that a cell is done, under which settings and of which tiles."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pipeline.airborne.grid import Cell


def manifest_path(out: Path, cell: Cell) -> Path:
    """Return the file that, written last, says that a cell is done."""
    return out / "cells" / cell.name / "manifest.json"


def read_manifest(out: Path, cell: Cell) -> dict[str, Any] | None:
    """Return the manifest of a cell; None if there is none or it cannot be read."""
    try:
        manifest = json.loads(manifest_path(out, cell).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return manifest if isinstance(manifest, dict) else None


def done(out: Path, cell: Cell, config_hash: str, input_hash: str) -> dict[str, Any] | None:
    """Return the manifest of a cell that is done under these hashes and has all its files."""
    manifest = read_manifest(out, cell)
    if manifest is None:
        return None
    if (manifest.get("config_hash"), manifest.get("input_hash")) != (config_hash, input_hash):
        return None
    there = all((out / "cells" / cell.name / name).is_file() for name in manifest.get("files", ()))
    return manifest if there else None
