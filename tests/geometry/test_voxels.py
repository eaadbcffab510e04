"""Sums over balls equal those of a plain search."""

import numpy as np
from scipy.spatial import cKDTree

from pipeline.geometry.voxels import ball_moments, first_in_cell


def test_ball_moments_equal_a_plain_search():
    xyz = np.random.default_rng(0).normal(size=(400, 3))
    count, mean, cov = ball_moments(xyz, 0.7)
    for i, near in enumerate(cKDTree(xyz).query_ball_point(xyz, 0.7)):
        assert count[i] == len(near)
        np.testing.assert_allclose(mean[i], xyz[near].mean(axis=0), atol=1e-12)
        np.testing.assert_allclose(cov[i], np.cov(xyz[near].T, bias=True) if len(near) > 1 else 0, atol=1e-12)


def test_first_in_cell_keeps_one_point_a_cell_in_order():
    xyz = np.array([[0.0, 0, 0], [0.05, 0, 0], [0.95, 0, 0], [1.0, 0, 0], [-0.01, 0, 0]])
    assert first_in_cell(xyz, 1.0).tolist() == [0, 3, 4]
