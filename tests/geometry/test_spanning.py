"""The exact spanning tree equals the one of the Delaunay graph, and of every complete graph."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse.csgraph import minimum_spanning_tree
from scipy.spatial.distance import pdist, squareform

from pipeline.geometry.spanning import euclidean_tree


def complete_tree_length(xyz):
    return minimum_spanning_tree(squareform(pdist(xyz))).sum()


@given(st.integers(0, 10_000), st.integers(2, 300))
def test_length_equals_that_of_the_complete_graph(seed, count):
    xyz = np.random.default_rng(seed).normal(size=(count, 3))
    edges, lengths = euclidean_tree(xyz)
    assert edges.shape == (count - 1, 2)
    assert lengths.sum() == pytest.approx(complete_tree_length(xyz), rel=1e-12)


def test_two_dense_clusters_far_apart_are_joined_by_their_shortest_bridge():
    rng = np.random.default_rng(1)
    left = rng.uniform(0, 1, (500, 3))
    right = rng.uniform(0, 1, (500, 3)) + [10, 0, 0]
    edges, lengths = euclidean_tree(np.vstack([left, right]))
    bridge = edges[np.argmax(lengths)]
    gap = np.linalg.norm(left[:, None] - right[None], axis=2)
    assert lengths.max() == pytest.approx(gap.min())
    assert tuple(bridge) == (np.argmin(gap.min(axis=1)), 500 + np.argmin(gap.min(axis=0)))


def test_equal_distances_make_one_tree_without_a_cycle():
    xyz = np.stack(np.meshgrid(*[np.arange(6.0)] * 3), -1).reshape(-1, 3)
    edges, lengths = euclidean_tree(xyz)
    assert len(edges) == len(xyz) - 1
    np.testing.assert_array_equal(lengths, 1.0)
    reached = {0}
    for _ in range(20):
        for a, b in edges.tolist():
            if a in reached or b in reached:
                reached |= {a, b}
    assert len(reached) == len(xyz)


@pytest.mark.parametrize("count", [0, 1])
def test_nothing_to_join(count):
    edges, lengths = euclidean_tree(np.zeros((count, 3)))
    assert len(edges) == len(lengths) == 0
