"""Small trees for the L-system tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from pipeline.model import Skeleton, TreeModel

Maker = Callable[..., TreeModel]


@pytest.fixture(scope="session")
def tree_of() -> Maker:
    """Make a tree of nodes and parents; radii default to 1 cm, all measured."""

    def make(
        xyz: Sequence[Sequence[float]],
        parent: Sequence[int],
        radius: Sequence[float] | float = 0.01,
        origin: Sequence[float] = (0, 0, 0),
        crs: str | None = None,
    ) -> TreeModel:
        count = len(parent)
        skeleton = Skeleton(np.array(xyz, dtype=float), np.array(parent), np.array(origin, dtype=float), crs)
        radii = np.broadcast_to(np.asarray(radius, dtype=float), (count,))
        return TreeModel(skeleton, radii, np.zeros(count, dtype=np.uint8), np.full(count, np.nan))

    return make


@pytest.fixture(scope="session")
def bush(tree_of: Maker) -> TreeModel:
    """A random walk of 20,000 nodes with forks, 8 m across, the size of a large reconstruction."""
    rng = np.random.default_rng(2021)
    count = 20_000
    parent = np.arange(-1, count - 1)
    forks = rng.random(count) < 0.15
    forks[:2] = False
    parent[forks] = (parent[forks] * rng.random(forks.sum())).astype(int)
    heading = rng.normal((0, 0, 0.5), 1, (count, 3))
    step = heading / np.linalg.norm(heading, axis=1)[:, None] * rng.uniform(0.02, 0.2, count)[:, None]
    xyz = np.zeros((count, 3))
    for i in range(1, count):
        xyz[i] = xyz[parent[i]] + step[i]
    return tree_of(xyz, parent, rng.uniform(0.003, 0.1, count))
