"""The minimal-length method as `extract` calls it: on known points, in any order."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.cloud import clean
from pipeline.model import PointCloud
from pipeline.skeleton import SkeletonOptions, extract
from pipeline.synthetic import SampleOptions, TubeTreeOptions, grow_tubes, sample

OPTIONS = SkeletonOptions(method="minimal-length")


@pytest.fixture(scope="module")
def points():
    """(P, 3) sparse points on a sapling, as from the air."""
    tree = grow_tubes(TubeTreeOptions(height_m=4, trunk_radius_m=0.08, max_order=1, branch_spacing_m=0.4))
    cloud = sample(tree, options=SampleOptions(density_per_m2=150))
    return np.round(cloud.world, 4)


@pytest.fixture(scope="module")
def skeleton(points):
    return extract(clean(PointCloud(points)), options=OPTIONS)


def test_it_is_one_tree_near_the_points(points, skeleton):
    assert skeleton.metadata["method"] == "minimal-length"
    assert np.count_nonzero(skeleton.parent < 0) == 1
    assert np.ptp(skeleton.xyz[:, 2]) == pytest.approx(np.ptp(points[:, 2]), rel=0.1)
    away = np.linalg.norm(skeleton.world[skeleton.tips][:, None] - points[None], axis=2).min(axis=1)
    assert np.quantile(away, 0.9) < 0.15


def test_the_order_of_the_points_makes_no_difference(points, skeleton):
    shuffled = np.random.default_rng(3).permutation(points)
    other = extract(clean(PointCloud(shuffled)), options=OPTIONS)
    np.testing.assert_array_equal(other.xyz, skeleton.xyz)
    np.testing.assert_array_equal(other.parent, skeleton.parent)
