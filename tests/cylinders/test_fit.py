"""Fitting trees whose radii are known."""

import numpy as np
import pytest

from pipeline.cylinders import CylinderOptions, fit
from pipeline.model import ALLOMETRIC, MEASURED, PointCloud, Skeleton


def tube(start, end, r0, r1, density, noise, seed=0, arc=(-np.pi, np.pi)):
    rng = np.random.default_rng(seed)
    start, end = np.asarray(start, float), np.asarray(end, float)
    way = end - start
    length = np.linalg.norm(way)
    count = int(np.pi * (r0 + r1) * length * density * (arc[1] - arc[0]) / (2 * np.pi))
    t, angle = rng.random(count), rng.uniform(*arc, count)
    across = np.linalg.svd((way / length)[None])[2][1:]
    r = r0 + t * (r1 - r0)
    ring = r[:, None] * (np.cos(angle)[:, None] * across[0] + np.sin(angle)[:, None] * across[1])
    return start + t[:, None] * way + ring + rng.normal(0, noise, (count, 3))


def small_tree(noise=0.002, density=8000, arc=(-np.pi, np.pi)):
    """A tapering stem with one branch, and a skeleton that is a little off."""
    stem = tube([0, 0, 0], [0, 0, 6], 0.15, 0.05, density, noise, arc=arc)
    branch = tube([0, 0, 3], [1.5, 0, 4], 0.03, 0.01, density, noise, 1)
    outside = np.linalg.norm(branch[:, :2], axis=1) > 0.1
    cloud = PointCloud(np.vstack([stem, branch[outside]]))
    nodes = [[0.02, 0, 0], [0.02, 0.01, 3], [0, 0.02, 6], [0.2, 0.01, 3.1], [1.48, 0, 4]]
    return cloud, Skeleton(np.array(nodes), [-1, 0, 1, 1, 3])


def radius_at(tree, z):
    stem = tree.skeleton.paths[0]
    return np.interp(z, tree.skeleton.xyz[stem, 2], tree.radius[stem])


def test_a_known_tree():
    cloud, skeleton = small_tree()
    tree = fit(cloud, skeleton)
    assert len(tree.skeleton.paths) == 2
    for z in (0.5, 1.3, 3.0, 5.0):
        assert radius_at(tree, z) == pytest.approx(0.15 - 0.1 * z / 6, rel=0.02)
    assert tree.trunk.dbh_m == pytest.approx(2 * (0.15 - 0.1 * 1.3 / 6), rel=0.01)
    assert tree.trunk.lo_m < 2 * (0.15 - 0.1 * 1.3 / 6) < tree.trunk.hi_m
    assert tree.trunk.source == "measured"
    assert tree.trunk.arc_deg > 330
    assert tree.volume.sum() == pytest.approx(0.2042 + 0.0025, rel=0.03)
    assert (tree.radius_source == MEASURED).mean() > 0.7
    assert tree.metadata["noise_mm"] == pytest.approx(2.0, rel=0.3)
    assert tree.metadata["surface_mm"]["median"] < 2.5


def test_the_branch_starts_on_the_stems_axis_with_its_own_radius():
    cloud, skeleton = small_tree()
    tree = fit(cloud, skeleton)
    path = tree.skeleton.paths[1]
    foot = tree.skeleton.xyz[path[0]]
    assert np.linalg.norm(foot[:2]) < 0.01
    assert foot[2] == pytest.approx(3.0, abs=0.05)
    assert tree.start_radius[path[1]] == tree.radius[path[1]] < 0.04


@pytest.mark.parametrize("noise", [0.002, 0.02])
def test_noise_does_not_thicken_the_stem(noise):
    cloud, skeleton = small_tree(noise)
    assert fit(cloud, skeleton).trunk.dbh_m == pytest.approx(0.2567, rel=0.03)


def test_half_the_bark_is_enough():
    cloud, skeleton = small_tree(arc=(0.0, np.pi))
    tree = fit(cloud, skeleton)
    assert tree.trunk.dbh_m == pytest.approx(0.2567, rel=0.03)
    assert 150 < tree.trunk.arc_deg < 230


def test_radii_fall_along_every_branch():
    cloud, skeleton = small_tree(0.01)
    tree = fit(cloud, skeleton)
    for path in tree.skeleton.paths:
        body = path[1:] if path[0] else path
        assert (np.diff(tree.radius[body]) <= 1e-12).all()


def test_a_stem_that_was_hardly_seen_is_not_called_measured():
    rng = np.random.default_rng(0)
    crown = rng.normal([0, 0, 10], [1.5, 1.5, 1.5], (400, 3))
    skeleton = Skeleton(np.array([[0, 0, 0], [0, 0, 5], [0, 0, 12.0]]), [-1, 0, 1])
    tree = fit(PointCloud(crown), skeleton)
    assert tree.trunk.source == "allometric"
    assert tree.trunk.lo_m < tree.trunk.dbh_m < tree.trunk.hi_m
    assert (tree.radius_source == ALLOMETRIC).any()


def test_a_tree_below_breast_height_has_no_diameter_there():
    stem = tube([0, 0, 0], [0, 0, 1.0], 0.05, 0.02, 9000, 0.001)
    tree = fit(PointCloud(stem), Skeleton(np.array([[0.0, 0, 0], [0, 0, 1]]), [-1, 0]))
    assert tree.trunk.dbh_m is None


def test_options_are_checked():
    with pytest.raises(ValueError, match="step_m"):
        CylinderOptions(step_m=0)
    with pytest.raises(ValueError, match="steps"):
        CylinderOptions(steps=1)
