"""The nearest bark is the nearest of all, whatever the tree of boxes passes over."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.accuracy.bark import nearest_bark
from pipeline.accuracy.surfaces import bark_distances, face_centroids, mean_by_segment
from pipeline.accuracy.wood import wood_of
from pipeline.geometry.surface import Tubes
from tests.accuracy.conftest import pole


def plainly(xyz, tubes):
    """Distance of every point from every bark, without any search."""
    along = tubes.end - tubes.start
    square = (along**2).sum(axis=1)
    dot = ((xyz[:, None] - tubes.start) * along).sum(axis=2)
    share = np.clip(np.divide(dot, square, out=np.zeros_like(dot), where=square > 0), 0, 1)
    away = np.linalg.norm(xyz[:, None] - tubes.start - share[..., None] * along, axis=2)
    return away - (tubes.start_radius + share * (tubes.end_radius - tubes.start_radius))


@given(st.integers(0, 10_000), st.integers(1, 60))
def test_it_is_the_nearest_of_all(seed, count):
    rng = np.random.default_rng(seed)
    start = rng.normal(0, 1, (count, 3))
    end = start + rng.normal(0, 0.5, (count, 3)) * rng.integers(0, 2, (count, 1))  # some have no length
    tubes = Tubes(start, end, rng.uniform(0, 0.4, count), rng.uniform(0, 0.4, count))
    xyz = rng.normal(0, 2, (40, 3))
    found, every = nearest_bark(xyz, tubes), plainly(xyz, tubes)
    assert np.abs(found.surface) == pytest.approx(np.abs(every).min(axis=1), abs=1e-12)
    assert found.surface == pytest.approx(every[np.arange(40), found.segment], abs=1e-12)


def test_twigs_in_one_place_go_to_the_smallest():
    tubes = wood_of(pole([0, 0, 0], [0, 0, 1], [0, 0, 2])).tubes()
    twice = Tubes(*(np.tile(v, (3, *[1] * (v.ndim - 1))) for v in vars(tubes).values()))
    assert nearest_bark(np.array([[0.2, 0, 0.5], [0.2, 0, 1.5]]), twice).segment.tolist() == [0, 1]


def test_a_tree_lies_on_itself(tree):
    tubes = wood_of(tree).tubes()
    distance, segment = bark_distances(tubes, tubes)
    assert distance.max() < 1e-12
    assert len(distance) == 12 * (len(tree) - 1)
    assert mean_by_segment(distance, segment, len(tree) - 1).max() < 1e-12


def test_centroids_lie_on_the_tapered_bark():
    points, segment = face_centroids(wood_of(pole([0, 0, 0], [0, 0, 3], radius=[0.3, 0.0])).tubes())
    assert set(segment) == {0}
    assert np.hypot(points[:, 0], points[:, 1]) == pytest.approx(0.3 - 0.1 * points[:, 2])
    assert np.unique(points[:, 2].round(9)).tolist() == [1.0, 2.0]


def test_a_thicker_trunk_is_as_far_off_as_it_is_thicker():
    thin, thick = (wood_of(pole([0, 0, 0], [0, 0, 3], radius=r)).tubes() for r in (0.10, 0.13))
    assert bark_distances(thick, thin)[0] == pytest.approx(0.03)
    assert bark_distances(None, thin)[0].tolist() == []
