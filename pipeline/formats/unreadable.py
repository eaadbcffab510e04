"""Why a file holds no tree that can be read, and which file does."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pipeline.cloud import CLOUD_SUFFIXES

SURFACES = (".mesh.ply", ".obj", ".glb")
ARCHIVE = ".lsjson.jsonl.zst"
BESIDE = (".npz", ".ls.json", ".skeleton.ply", ".qsm.csv", ".city.json")
"""Models that may lie beside a drawn surface, those that keep most first."""


def why_unreadable(path: Path, readable: Sequence[str]) -> str:
    """Return what a file is instead of a model, and what to give, as one sentence.

    Parameters
    ----------
    path : Path
        Of a suffix that no reader has, or a folder.
    readable : sequence of str
        Suffixes that can be read.
    """
    name = path.name.lower()
    if path.is_dir():
        return f"{path}: is a directory, and no model that can be read; give one of the files in it"
    if name.endswith(SURFACES):
        return f"{path}: is a drawn surface, and no model that can be read; give {_beside(path)}"
    if name.endswith(ARCHIVE):
        return f"{path}: is an archive of trees, and no model that can be read; name a tree as in {path}#oak"
    if name.endswith(CLOUD_SUFFIXES):
        return f"{path}: is a point cloud, and no model that can be read; make one of it with `treepipe run`"
    return f"{path}: is no model that can be read; give one of {', '.join(readable)}"


def _beside(path: Path) -> str:
    """Name the file beside a surface that holds the tree, or those that would."""
    suffix = next(known for known in SURFACES if path.name.lower().endswith(known))
    stem = path.name[: -len(suffix)]
    known = [path.with_name(stem + model) for model in BESIDE]
    there = next((file for file in known if file.is_file()), None)
    return (
        f"{there}, which holds the tree" if there else f"the tree's {', '.join(BESIDE[:-1])} or {BESIDE[-1]}"
    )
