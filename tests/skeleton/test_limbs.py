"""Which limbs the coarse pass believes: none that is stouter than the wood that bears it."""

import numpy as np
import pytest

from pipeline.skeleton.limbs import find_limbs

NOISE_M = 0.010


def tube(start, end, radius, density, rng):
    """Points on a straight branch, in any direction."""
    start, end = np.array(start, dtype=float), np.array(end, dtype=float)
    way = end - start
    length = np.linalg.norm(way)
    way /= length
    across = np.cross(way, [0.3, 1.0, 0.2])
    across /= np.linalg.norm(across)
    other = np.cross(way, across)
    count = int(2 * np.pi * radius * length * density)
    angle, along = rng.uniform(0, 2 * np.pi, (count, 1)), rng.uniform(0, length, (count, 1))
    return start + along * way + radius * (np.cos(angle) * across + np.sin(angle) * other)


def limbs_of(*branches, density=2000.0):
    """Limbs of a stem of 12 cm radius and what stands on it, under 10 mm of noise."""
    rng = np.random.default_rng(3)
    parts = [tube((0, 0, 0), (0, 0, 6), 0.12, density, rng)]
    parts += [tube(*branch, density, rng) for branch in branches]
    xyz = np.vstack(parts)
    xyz += rng.normal(0, NOISE_M, xyz.shape)
    return find_limbs(xyz[np.lexsort(xyz.T)], neighbours=6, window_m=0.2).axes


def test_a_stout_limb_is_found():
    axes = limbs_of(((0, 0, 3.0), (1.5, 0, 4.0), 0.09))
    limb = axes.radius[axes.xyz[:, 0] > 0.3]
    assert len(limb) >= 8
    assert np.median(limb) == pytest.approx(0.09, abs=0.01)


def test_a_shell_stouter_than_the_wood_that_bears_it_is_no_limb():
    """Two limbs side by side, or a clump of twigs, may look like one to the coarse pass."""
    axes = limbs_of(((0, 0, 3.0), (1.5, 0, 4.0), 0.17))
    assert (axes.xyz[:, 0] < 0.3).sum() > 40
    assert axes.radius[axes.xyz[:, 0] > 0.3].max(initial=0.0) < 0.13


def test_a_limb_as_stout_as_the_stem_above_it_is_one():
    """Leaders of a fork share what is below."""
    axes = limbs_of(((0, 0, 3.0), (1.5, 0, 5.0), 0.118))
    assert (axes.xyz[:, 0] > 0.3).sum() >= 8
