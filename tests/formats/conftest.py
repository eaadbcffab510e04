"""A tree with everything a file has to keep, and a random one."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.model import Skeleton, TreeModel, Trunk


@pytest.fixture
def tree() -> TreeModel:
    """A stem 0-1-2, a limb 3-4 from node 1 and a shoot 5 from the root, far from the coordinates' zero."""
    xyz = [[0.1, 0, 0], [0.1, 0, 1], [0.2, 0, 2], [0.7, 0, 1.3], [1 / 3, 0.4, 1.3], [0.3, 0, 0.2]]
    found = {"method": "mst", "flags": ("sparse",)}
    skeleton = Skeleton(
        np.array(xyz),
        np.array([-1, 0, 1, 1, 3, 0]),
        np.array([121913.4, 487434.9, -0.3]),
        "EPSG:28992",
        found,
    )
    known = {
        **found,
        "dropped": {"voxel": np.int64(7)},
        "source": {"path": "eik é\n.laz", "sha256": "00" * 32},
        "surface_mm": {"mean": np.float64(2.5), "p95": float("nan")},
        "long": "x" * 700,
    }
    return TreeModel(
        skeleton,
        np.array([0.1, 0.09, 0.01, 0.03, 1 / 300, 0.002]),
        np.array([0, 0, 0, 1, 2, 2]),
        np.array([0.001, 0.002, np.nan, 0.003, np.nan, np.nan]),
        Trunk(0.18, 0.17, None, 250.0, "measured", -0.05),
        known,
    )
