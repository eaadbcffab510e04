"""Numbering by paths: hand-made trees with known answers, and any tree from its shuffled edges."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import ModelError
from pipeline.geometry.numbering import by_paths, from_edges, renumbered, rooted
from pipeline.model import Skeleton

# A stem 0-1-2-3 of three metres with a side branch of 0.5 m at node 1 and one of 2 m at node 2.
XYZ = np.array([[0, 0, 0], [0, 0, 1], [0, 0, 2], [0, 0, 3], [0.5, 0, 1], [1, 0, 2], [2, 0, 2]], dtype=float)
EDGES = np.array([[0, 1], [1, 2], [2, 3], [1, 4], [2, 5], [5, 6]])


def test_the_heavier_child_goes_on_and_side_branches_follow_from_the_base_up() -> None:
    node, parent = from_edges(XYZ, EDGES)
    assert node.tolist() == [0, 1, 2, 5, 6, 4, 3]  # at node 2 the two metres to the side outweigh one up
    assert parent.tolist() == [-1, 0, 1, 2, 3, 1, 2]
    assert Skeleton(XYZ[node], parent).branch.tolist() == [0, 0, 0, 0, 0, 1, 2]


def test_the_first_of_equals_goes_on() -> None:
    assert by_paths([-1, 0, 0], [0, 1, 1]).tolist() == [0, 1, 2]


def test_edges_may_point_anywhere_and_come_twice() -> None:
    node, _ = from_edges(XYZ, EDGES)
    mixed = np.concatenate([EDGES[::-1], EDGES[:3]])
    mixed[2] = mixed[2][::-1]
    mixed[7] = mixed[7][::-1]
    assert from_edges(XYZ, mixed)[0].tolist() == node.tolist()


def test_the_root_is_the_first_node_to_which_no_edge_leads() -> None:
    assert rooted(3, [[2, 1], [1, 0]]).tolist() == [1, 2, -1]
    assert rooted(2, [[0, 1], [1, 0]]).tolist() == [-1, 0]  # edges lead to both: node 0


@pytest.mark.parametrize(
    ("edges", "says"),
    [
        ([[0, 1], [1, 2], [2, 0], [3, 4], [4, 5], [5, 6]], "not connected"),
        ([[0, 1], [1, 2], [2, 3], [1, 4], [2, 5]], "node 6 is not connected to the root"),
        ([*EDGES.tolist(), [6, 3]], "cycle; remove"),
        ([*EDGES.tolist(), [3, 3]], "node 3 to itself"),
        ([*EDGES.tolist(), [3, 7]], "nodes run from 0 to 6"),
        ([*EDGES.tolist(), [3, -1]], "nodes run from 0 to 6"),
        ([*EDGES.tolist(), [3, np.nan]], "not a whole number"),
        (np.zeros((0, 2), dtype=int), "two nodes and an edge"),
    ],
)
def test_what_is_no_tree_is_named(edges: object, says: str) -> None:
    with pytest.raises(ModelError, match=says):
        from_edges(XYZ, edges)  # type: ignore[arg-type]


def test_a_coordinate_that_is_not_finite_is_named() -> None:
    xyz = XYZ.copy()
    xyz[4, 1] = np.nan
    with pytest.raises(ModelError, match=r"node 4 .* not finite"):
        from_edges(xyz, EDGES)


@pytest.mark.parametrize(
    ("parent", "says"),
    [([-1, -1], "2 nodes have no parent"), ([-1, 2, 1], "own ancestor"), ([-1, 5], "the parent 5")],
)
def test_what_is_no_rooted_tree_is_named(parent: list[int], says: str) -> None:
    with pytest.raises(ModelError, match=says):
        by_paths(parent, np.ones(len(parent)))


def test_a_very_long_path_needs_no_recursion() -> None:
    parent = np.arange(-1, 99_999)
    assert np.array_equal(by_paths(parent, np.ones(100_000)), np.arange(100_000))


@settings(max_examples=60, deadline=None)
@given(st.lists(st.integers(0, 10**6), min_size=1, max_size=40), st.randoms(use_true_random=False))
def test_any_tree_comes_back_from_shuffled_edges(draws: list[int], random: object) -> None:
    parent = np.array([-1] + [d % (i + 1) for i, d in enumerate(draws)])
    xyz = np.random.default_rng(len(draws)).normal(size=(len(parent), 3))
    names = list(range(len(parent)))
    random.shuffle(names)  # type: ignore[attr-defined]
    new = np.array(names)
    placed = np.empty_like(xyz)
    placed[new] = xyz
    edges = np.column_stack([new[parent[1:]], new[1:]])
    random.shuffle(rows := edges.tolist())  # type: ignore[attr-defined]
    node, above = from_edges(placed, rows)
    skeleton = Skeleton(placed[node], above)
    want = {(tuple(xyz[p]), tuple(xyz[i])) for i, p in enumerate(parent.tolist()) if i}
    have = {(tuple(skeleton.xyz[p]), tuple(skeleton.xyz[i])) for i, p in enumerate(above.tolist()) if i}
    assert have == want
    for path in skeleton.paths:  # the nodes of a branch follow each other
        assert (np.diff(path[1:]) == 1).all()
    again = by_paths(above, skeleton.length)
    assert np.array_equal(again, np.arange(len(above)))
    assert np.array_equal(renumbered(above, again), above)
