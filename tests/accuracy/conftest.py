"""Small trees to compare."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.model import Skeleton, TreeModel
from pipeline.synthetic import TubeTreeOptions, grow_tubes


def pole(*nodes, radius=0.05, parent=None, **known):
    """A tree through the nodes, one after the other unless `parent` says otherwise."""
    xyz = np.array(nodes, dtype=float)
    parents = np.arange(len(xyz)) - 1 if parent is None else np.array(parent)
    count = len(xyz)
    return TreeModel(
        Skeleton(xyz, parents, **known),
        np.broadcast_to(np.asarray(radius, dtype=float), count),
        np.zeros(count, dtype=np.uint8),
        np.full(count, np.nan),
    )


def changed(tree, *, xyz=None, radius=None, origin=None, crs=None):
    """The same tree with other places or radii."""
    graph = tree.skeleton
    skeleton = Skeleton(
        graph.xyz if xyz is None else xyz,
        graph.parent,
        graph.origin if origin is None else np.asarray(origin, dtype=float),
        graph.crs if crs is None else crs,
    )
    return replace(tree, skeleton=skeleton, radius=tree.radius if radius is None else radius)


@pytest.fixture(scope="session")
def tree():
    """A sapling of some twenty branches."""
    return grow_tubes(TubeTreeOptions(height_m=4, trunk_radius_m=0.06, max_order=2, branch_spacing_m=0.3))
