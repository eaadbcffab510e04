"""Douglas-Peucker never leaves its tolerance."""

from itertools import pairwise

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from pipeline.geometry.polyline import douglas_peucker


def distance_to_chain(x, chain):
    best = np.inf
    for a, b in pairwise(chain):
        along = b - a
        t = np.clip((x - a) @ along / max(along @ along, 1e-300), 0, 1)
        best = min(best, np.linalg.norm(x - a - t * along))
    return best


@given(st.integers(0, 10_000), st.integers(2, 60), st.floats(0.01, 2.0))
def test_every_node_stays_within_its_tolerance(seed, count, tolerance):
    xyz = np.cumsum(np.random.default_rng(seed).normal(size=(count, 3)), axis=0)
    keep = douglas_peucker(xyz, np.full(count, tolerance))
    assert keep[0]
    assert keep[-1]
    for x in xyz:
        assert distance_to_chain(x, xyz[keep]) <= tolerance * (1 + 1e-9)


def test_a_straight_chain_keeps_its_ends_alone():
    xyz = np.linspace([0, 0, 0], [1, 2, 3], 20)
    assert np.flatnonzero(douglas_peucker(xyz, np.full(20, 1e-6))).tolist() == [0, 19]


def test_a_tighter_node_is_kept_where_a_looser_one_is_dropped():
    xyz = np.array([[0, 0, 0], [1, 0.1, 0], [2, 0, 0], [3, 0.1, 0], [4, 0.0, 0]])
    keep = douglas_peucker(xyz, np.array([1, 0.05, 1, 1, 1]))
    assert np.flatnonzero(keep).tolist() == [0, 1, 4]


def test_a_further_column_splits_a_straight_chain():
    xyz = np.column_stack([np.arange(5.0), np.zeros(5), np.zeros(5), [0, 0, 3, 0, 0]])
    assert douglas_peucker(xyz, np.ones(5))[2]
