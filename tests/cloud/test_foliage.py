"""Foliage: points that no line explains, among others; not bare twigs, thinly or noisily scanned."""

import numpy as np
import pytest

from pipeline.cloud.foliage import bark_noise, stands_in_foliage


def stem(rng, noise=0.003):
    z, angle = rng.uniform(0, 4, 30000), rng.uniform(0, 2 * np.pi, 30000)
    return np.column_stack([0.1 * np.cos(angle), 0.1 * np.sin(angle), z]) + rng.normal(0, noise, (30000, 3))


def twigs(rng, count, per_metre):
    """Straight twigs of 1 m from the stem's upper half, points along them."""
    start = np.column_stack([np.zeros((count, 2)), rng.uniform(1.5, 4, count)])
    way = rng.normal(size=(count, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    along = rng.uniform(0.1, 1.0, (per_metre, count, 1))
    return (start + along * way).reshape(-1, 3)


def cloud(seed, *, sleeve=0.0, per_metre=150, noise=0.003):
    """A tree of twigs, with four leaf points each about `sleeve` off them where it is not 0."""
    rng = np.random.default_rng(seed)
    bare = twigs(rng, 120, per_metre)
    leaves = np.repeat(bare, 4, axis=0)
    xyz = np.vstack([bare, leaves + rng.normal(0, sleeve, leaves.shape)]) if sleeve else bare
    xyz = np.vstack([stem(rng, noise), xyz + rng.normal(0, noise, xyz.shape)])
    return xyz[np.lexsort((xyz[:, 0], xyz[:, 1], xyz[:, 2]))]


@pytest.mark.parametrize("seed", [1, 2])
def test_leaves_in_sleeves_along_twigs_are_foliage(seed):
    assert stands_in_foliage(cloud(seed, sleeve=0.06))


@pytest.mark.parametrize("per_metre", [150, 40])
def test_bare_twigs_are_not(per_metre):
    assert not stands_in_foliage(cloud(1, per_metre=per_metre))


def test_noise_as_wide_as_twigs_lie_apart_does_not_tell():
    assert not stands_in_foliage(cloud(1, noise=0.02))


def test_no_points_are_no_foliage():
    assert not stands_in_foliage(np.zeros((3, 3)))


def test_bark_shows_its_noise():
    few, much = (bark_noise(stem(np.random.default_rng(1), noise)) for noise in (0.001, 0.006))
    assert few < 0.002
    assert 0.003 < much < 0.008


def test_without_bark_no_noise_is_known():
    assert bark_noise(np.random.default_rng(1).uniform(0, 1, (100, 3))) == np.inf
