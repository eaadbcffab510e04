"""A small tree that every test here may draw."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.model import Skeleton, TreeModel, Trunk


@pytest.fixture
def tree() -> TreeModel:
    """A stem of 2 m from the ground at 1.5 m, a limb and a twig, at national coordinates."""
    xyz = [[0, 0, 0], [0, 0, 1], [0.1, 0, 2], [0.5, 0, 1.2], [1, 0.0004, 1.3], [0.5, 0.3, 1.2]]
    skeleton = Skeleton(
        np.array(xyz), np.array([-1, 0, 1, 1, 3, 3]), np.array([85123.456, 446789.123, 1.5]), "EPSG:7415"
    )
    trunk = Trunk(0.18, 0.17, 0.19, 250.0, "measured", 0.0)
    known = {"species": "Quercus robur", "ground_z": 0.0, "top_z": 2.1, "crown_area_m2": np.pi}
    radius = np.array([0.1, 0.09, 0.06, 0.03, 0.00202, 0.005])
    return TreeModel(skeleton, radius, np.array([0, 0, 0, 1, 2, 2]), np.full(6, np.nan), trunk, known)
