"""What the file of a model tells of itself, beside the tree that is read from it."""

from __future__ import annotations

import os

from pipeline.exchange import FORMATS
from pipeline.formats import simpleforest, treeqsm, treeqsm_mat
from pipeline.formats.cylinders import Cylinders
from pipeline.formats.ply import open_ply

_CYLINDERS = {
    ".treeqsm.txt": treeqsm.read_cylinders,
    ".simpleforest.csv": simpleforest.read_cylinders,
    ".mat": treeqsm_mat.read_cylinders,
}


def tells_sources(path: str | os.PathLike[str]) -> bool:
    """Whether a model's file says where its radii come from: measured, propagated or allometric."""
    name = os.fspath(path).lower()
    if name.endswith(".ply"):
        nodes = open_ply(path).element("vertex")
        return nodes is not None and "radius_source" in {column.name for column in nodes.properties}
    known = next((known for known in FORMATS.values() if name.endswith(known.suffix)), None)
    return not name.endswith(".mat") if known is None else "radius source" not in known.loses


def cylinders_of(path: str | os.PathLike[str]) -> Cylinders | None:
    """Return the cylinders of a file as they stand in it; None where it holds none."""
    name = os.fspath(path).lower()
    return next((read(path) for suffix, read in _CYLINDERS.items() if name.endswith(suffix)), None)
