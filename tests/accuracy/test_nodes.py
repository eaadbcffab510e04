"""Nodes go with nodes of the same number, of the same shape, or the nearest."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.accuracy.nodes import pairs_of_nodes
from pipeline.geometry.numbering import from_edges
from pipeline.model import Skeleton
from tests.accuracy.conftest import changed, pole


def test_same_parents_go_by_number(tree):
    moved = changed(tree, xyz=tree.skeleton.xyz + [0.003, 0.0, 0.004])
    pairs = pairs_of_nodes(moved.skeleton, tree.skeleton)
    assert pairs.by == "order"
    assert pairs.distance == pytest.approx(0.005)


@pytest.mark.parametrize("seed", range(3))
def test_other_numbers_go_by_shape(tree, seed):
    graph, rng = tree.skeleton, np.random.default_rng(seed)
    mixed = np.concatenate([[0], 1 + rng.permutation(len(graph) - 1)])
    number = np.argsort(mixed)
    edges = np.column_stack([number[graph.parent[1:]], number[1:]])
    node, parent = from_edges(graph.xyz[mixed], edges)
    other = Skeleton(graph.xyz[mixed][node] + rng.normal(0, 1e-3, (len(graph), 3)), parent)
    pairs = pairs_of_nodes(other, graph)
    assert pairs.by == "structure" or np.array_equal(other.parent, graph.parent)
    assert np.array_equal(pairs.partner, mixed[node])
    assert pairs.distance.max() < 0.006


def test_a_mirrored_branch_is_still_its_own():
    """A limb that has swung round lies far off, and not at no distance from its neighbour."""
    fork = [[0, 0, 0], [0, 0, 1], [1, 0, 2], [2, 0, 2], [-1, 0, 2]]
    parent = [-1, 0, 1, 2, 1]
    swung = [[0, 0, 0], [0, 0, 1], [0, 1, 2], [0, 2, 2], [-1, 0, 2]]
    other = pole(*[swung[k] for k in (0, 1, 4, 2, 3)], parent=[-1, 0, 1, 1, 3]).skeleton
    pairs = pairs_of_nodes(other, pole(*fork, parent=parent).skeleton)
    assert pairs.by == "structure"
    assert pairs.distance.tolist() == pytest.approx([0, 0, 0, np.sqrt(2), np.sqrt(8)])


def test_other_shapes_go_to_the_nearest():
    a, b = pole([0, 0, 0], [0, 0, 1], [0, 0, 2]), pole([0, 0, 0], [0, 0, 1.9])
    pairs = pairs_of_nodes(a.skeleton, b.skeleton)
    assert pairs.by == "nearest"
    assert pairs.partner.tolist() == [0, 1, 1]
    assert pairs.distance.tolist() == pytest.approx([0, 0.9, 0.1])
