"""Vegetation by its shape: cut into strips or not, alone or among other points, it is the same."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.airborne import vegetation as module
from pipeline.airborne.vegetation import VegetationOptions, vegetation

ORIGIN = np.zeros(3)


@pytest.fixture(scope="module")
def hedges() -> np.ndarray:
    """Bushes, walls and stray points along 60 m."""
    rng = np.random.default_rng(1)
    bushes = [rng.normal((rng.random() * 12, y, 5), 0.7, (120, 3)) for y in rng.random(40) * 60]
    walls = [np.column_stack([np.full(200, 3.0), y + rng.random(200) * 4, 3 + rng.random(200) * 4])
             for y in (5, 25, 45)]  # fmt: skip
    strays = rng.random((300, 3)) * [12, 60, 3] + [0, 0, 9]
    return np.rint(np.concatenate([*bushes, *walls, strays]) * 4096) / 4096


@pytest.mark.parametrize("points", [1, 200, 1500])
def test_strips_leave_no_trace(hedges, points, monkeypatch):
    whole = vegetation(hedges, ORIGIN, VegetationOptions())
    assert 0.2 < whole.mean() < 0.9
    monkeypatch.setattr(module, "STRIP_POINTS", points)
    monkeypatch.setattr(module, "STRIP_M", 1.0)
    assert len(module._strips(hedges[:, 1])) > 3
    assert (vegetation(hedges, ORIGIN, VegetationOptions()) == whole).all()


def test_points_that_are_not_asked_for_take_no_part(hedges):
    rng = np.random.default_rng(2)
    both = np.concatenate([hedges, np.rint(rng.random((3000, 3)) * [12, 60, 8] * 4096) / 4096])
    asked = np.flatnonzero(np.arange(len(both)) < len(hedges))
    assert (
        vegetation(both, ORIGIN, VegetationOptions(), asked)
        == vegetation(hedges, ORIGIN, VegetationOptions())
    ).all()


def test_strips_are_never_narrow():
    y = np.concatenate([np.full(10 * module.STRIP_POINTS // 4, 7.0), [0.0, 100.0]])
    edges = np.array(module._strips(y))
    assert (np.diff(edges[1:-1]) >= module.STRIP_M).all()
    assert (edges[0], edges[-1]) == (-np.inf, np.inf)
