"""Lists of cylinders: where branches start between the ends, gaps, and radii that meet."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.formats.cylinders import Cylinders, equal_volume, foot_radius, segments, tree_of
from pipeline.model import TreeModel

START = [[0, 0, 0], [0, 0, 1.01], [0.2, 0, 0.25], [0, 0.2, 0.25], [0.3, 0, 2]]
END = [[0, 0, 1], [0, 0, 2], [1.2, 0, 0.25], [0, 2, 0.25], [0.3, 0, 3]]


def cylinders(parent: list[int], goes_on: list[bool]) -> Cylinders:
    count = len(parent)
    radius = np.array([0.2, 0.1, 0.03, 0.02, 0.01])[:count]
    ends = (np.array(part[:count], dtype=float) for part in (START, END))
    return Cylinders(*ends, radius, np.array(parent), np.array(goes_on))


def test_a_branch_starts_on_its_parents_axis_and_leaves_the_bark_where_it_did() -> None:
    tree = tree_of(cylinders([-1, 0, 0], [False, True, False]))
    world = tree.skeleton.world.tolist()
    assert world == [[0, 0, 0], [0, 0, 0.25], [0, 0, 1], [0, 0, 2], [0.2, 0, 0.25], [1.2, 0, 0.25]]
    assert tree.skeleton.parent.tolist() == [-1, 0, 1, 2, 1, 4]
    assert tree.skeleton.branch.tolist() == [0, 0, 0, 0, 1, 1]
    assert tree.radius.tolist() == pytest.approx([0.2, 0.1875, 0.15, 0.1, 0.03, 0.03])


def test_two_branches_at_one_height_share_their_foot() -> None:
    tree = tree_of(cylinders([-1, 0, 0, 0], [False, True, False, False]))
    assert tree.skeleton.parent.tolist() == [-1, 0, 1, 2, 1, 4, 1, 6]
    assert len(tree.skeleton.paths) == 3


def test_a_branch_beyond_the_end_starts_at_the_end() -> None:
    tree = tree_of(cylinders([-1, 0, 0, 2, 1], [False, True, False, True, False]))
    world = tree.skeleton.world.tolist()
    assert world[tree.skeleton.parent[world.index([0.3, 0, 2])]] == [0, 0, 2]


def test_children_may_stand_before_their_parents() -> None:
    one = tree_of(cylinders([-1, 0, 0], [False, True, False]))
    held = cylinders([-1, 0, 0], [False, True, False])
    turned = Cylinders(
        held.start[::-1], held.end[::-1], held.radius[::-1], np.array([2, 2, -1]), held.goes_on[::-1]
    )
    other = tree_of(turned)
    assert other.skeleton.world.tolist() == one.skeleton.world.tolist()
    assert other.radius.tolist() == one.radius.tolist()


def test_our_own_segments_come_back_without_a_new_node(tree: TreeModel) -> None:
    again = tree_of(segments(tree), "EPSG:28992")
    assert again.skeleton.parent.tolist() == tree.skeleton.parent.tolist()
    assert again.radius.tolist() == tree.radius.tolist()


@given(st.floats(0, 1), st.floats(0, 1))
def test_the_foot_of_a_frustum_is_found_again(a: float, b: float) -> None:
    radius = equal_volume(np.array([a]), np.array([b]))[0]
    assert foot_radius(radius, b) == pytest.approx(a, abs=1e-7)
