"""What stands around a tree, or stood there earlier, as points: of a cloud, or along the axes of a model."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pipeline.cloud import CLOUD_SUFFIXES, read_cloud
from pipeline.cloud.local import usable
from pipeline.errors import InputFormatError
from pipeline.exchange import FORMATS, read_model
from pipeline.formats.ply import open_ply
from pipeline.growth import Shade
from pipeline.model import Floats, PointCloud, Skeleton, TreeModel

CLOSE_M = 0.05
"""Distance of the points that stand for wood."""


def read_tree(path: Path) -> TreeModel:
    """Read a tree with radii.

    Raises
    ------
    InputFormatError
        If the file holds a skeleton without radii.
    """
    return with_radii(read_model(path), path)


def with_radii(held: TreeModel | Skeleton, path: Path) -> TreeModel:
    """Return a tree; a skeleton is an error that names its file.

    Raises
    ------
    InputFormatError
    """
    if isinstance(held, Skeleton):
        msg = f"{path}: is a skeleton without radii; measure them first with `treepipe fit`"
        raise InputFormatError(msg)
    return held


def read_shade(path: Path, origin: Floats) -> Shade:
    """Read what stands around a tree.

    Parameters
    ----------
    path : Path
        A cloud, or a model.
    origin : (3,) array
        Of the tree that grows.
    """
    held = read_either(path)
    return Shade(wood_points(held) - origin)


def read_either(path: Path) -> PointCloud | TreeModel | Skeleton:
    """Read a cloud or a model, whichever the suffix, and for a .ply the content, says it is."""
    name, suffix = path.name.lower(), path.suffix.lower()
    if suffix == ".ply" and path.is_file():
        held = {element.name for element in open_ply(path).elements if element.count}
        return read_model(path) if "edge" in held else read_cloud(path)
    models = tuple(known.suffix for known in FORMATS.values())
    return read_cloud(path) if suffix in CLOUD_SUFFIXES and not name.endswith(models) else read_model(path)


def wood_points(held: PointCloud | TreeModel | Skeleton) -> Floats:
    """(P, 3) points of a cloud, or close ones along the segments of a model, in their reference system."""
    if isinstance(held, PointCloud):
        return held.world[usable(held.xyz)]
    graph = held.skeleton if isinstance(held, TreeModel) else held
    number = np.maximum(np.ceil(graph.length / CLOSE_M).astype(np.int64), 1)
    node = np.repeat(np.arange(len(graph)), number)
    share = (np.arange(len(node)) - np.repeat(np.cumsum(number) - number, number) + 1.0) / number[node]
    a, b = graph.world[np.maximum(graph.parent, 0)][node], graph.world[node]
    return np.asarray(a + share[:, None] * (b - a))
