"""Both graphs give the same minimum spanning tree."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree

from pipeline.errors import NotATreeError
from pipeline.skeleton.graph import by_delaunay, by_neighbours


def edges_of_minimum_tree(graph):
    tree = minimum_spanning_tree(graph).tocoo()
    return {tuple(sorted(pair)) for pair in zip(tree.row.tolist(), tree.col.tolist(), strict=True)}


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.integers(10, 400), st.integers(2, 8))
def test_neighbours_and_delaunay_have_the_same_minimum_spanning_tree(seed, count, neighbours):
    rng = np.random.default_rng(seed)
    # two clumps of very different density, which k nearest neighbours alone leave apart
    xyz = np.vstack([rng.normal(size=(count, 3)), 0.01 * rng.normal(size=(count, 3)) + 30.0])
    knn, delaunay = by_neighbours(xyz, neighbours), by_delaunay(xyz)
    assert connected_components(knn, directed=False)[0] == 1
    assert edges_of_minimum_tree(knn) == edges_of_minimum_tree(delaunay)


def test_on_a_real_tree_too(shared_data):
    xyz = np.loadtxt(shared_data / "trees" / "tree7.xyz")[:6000, :3]
    xyz = np.unique(xyz, axis=0)
    knn, delaunay = by_neighbours(xyz, 6), by_delaunay(xyz)
    # millimetre coordinates make ties; their lengths must still add up to the same tree
    assert minimum_spanning_tree(knn).sum() == pytest.approx(minimum_spanning_tree(delaunay).sum(), rel=1e-9)


def test_points_in_a_plane_have_no_delaunay_graph_and_the_text_says_what_to_do():
    flat = np.random.default_rng(0).normal(size=(50, 3)) * [1, 1, 0]
    with pytest.raises(NotATreeError, match="knn"):
        by_delaunay(flat)
    assert by_neighbours(flat, 4).shape == (50, 50)
