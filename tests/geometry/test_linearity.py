"""Leaves that wrap limbs, leaves along twigs, noise that looks like neither."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.geometry.linearity import FILLED, LEAFY, is_leafy, neighbourhoods


def bare(noise_m: float) -> np.ndarray:
    """Return a stem and thirty twigs, scanned every centimetre."""
    rng = np.random.default_rng(4)
    lines = [(np.zeros(3), np.array([0.0, 0.0, 8.0]), 0.12)]
    for k in range(30):
        foot = np.array([0.0, 0.0, 3.5 + 0.14 * k])
        way = np.array([np.cos(2.4 * k), np.sin(2.4 * k), 0.5])
        lines.append((foot, foot + 2.0 * way, 0.008))
    points = []
    for start, end, radius in lines:
        count = int(600 * np.linalg.norm(end - start))
        t, turn = rng.random(count), 2 * np.pi * rng.random(count)
        way = (end - start) / np.linalg.norm(end - start)
        u = np.cross(way, [0.31, 0.95, 0.05])
        u /= np.linalg.norm(u)
        around = np.outer(np.cos(turn), u) + np.outer(np.sin(turn), np.cross(way, u))
        points.append(start + np.outer(t, end - start) + radius * around)
    xyz = np.vstack(points)
    return xyz + rng.normal(0.0, noise_m, xyz.shape)


def in_leaf(spread_m: float) -> np.ndarray:
    """Return the same tree with points within `spread_m` of its twigs."""
    rng = np.random.default_rng(5)
    wood = bare(0.002)
    crown = wood[wood[:, 2] > 3.4]
    leaves = np.repeat(crown, 3, axis=0) + rng.normal(0.0, spread_m, (3 * len(crown), 3))
    return np.vstack([wood, leaves])


@pytest.mark.parametrize("noise_m", [0.0, 0.005, 0.01, 0.02, 0.03])
def test_noise_is_not_foliage(noise_m):
    assert not is_leafy(bare(noise_m))


@pytest.mark.parametrize("spread_m", [0.06, 0.1, 0.3])
def test_foliage_is_found(spread_m):
    assert is_leafy(in_leaf(spread_m))


def test_leaves_along_twigs_are_lines_from_afar():
    near, wide = neighbourhoods(in_leaf(0.04))
    assert near is not None
    assert wide is not None
    assert wide.line > LEAFY
    assert near.filled > FILLED


def test_too_few_points_tell_nothing():
    assert neighbourhoods(bare(0.0)[::200]) == (None, None)
    assert not is_leafy(bare(0.0)[::200])
