"""Distances to tapered tubes, by hand and against a search over all segments."""

import numpy as np

from pipeline.geometry.surface import Tubes, nearest_tube


def test_hand_computed_distances():
    tubes = Tubes(
        np.array([[0.0, 0, 0], [5, 0, 0]]),
        np.array([[0.0, 0, 2], [5, 0, 2]]),
        np.array([0.2, 1.0]),
        np.array([0.1, 0.5]),
    )
    near = nearest_tube(np.array([[1.0, 0, 1], [5, 0.75, 1], [0, 0, 3]]), tubes)
    assert near.segment.tolist() == [0, 1, 0]
    np.testing.assert_allclose(near.surface, [0.85, 0.0, 0.9], atol=1e-12)
    np.testing.assert_allclose(near.share, [0.5, 0.5, 1.0], atol=1e-12)


def test_bark_of_a_thick_stem_is_not_given_to_the_twigs_inside_its_reach():
    rng = np.random.default_rng(0)
    twigs = np.column_stack([rng.uniform(0.34, 0.6, (60, 1)), rng.uniform(-0.2, 0.2, (60, 2))])
    start = np.vstack([[0.0, 0, -1], twigs])
    end = np.vstack([[0.0, 0, 1], twigs + [0.05, 0, 0]])
    radius = np.r_[0.3, np.full(60, 0.003)]
    bark = np.array([[0.3, 0.0, 0.0], [0.2995, 0.0175, 0.1]])
    near = nearest_tube(bark, Tubes(start, end, radius, radius))
    assert near.segment.tolist() == [0, 0]
    assert np.abs(near.surface).max() < 1e-3
