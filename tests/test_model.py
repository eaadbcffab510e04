"""The values that travel: frozen, checked, and with the branch structure in their numbers."""

import pickle

import numpy as np
import pytest

from pipeline.errors import ModelError
from pipeline.model import PointCloud, Skeleton, TreeModel


def small_tree():
    xyz = [[0, 0, 0], [0, 0, 1], [0, 0, 2], [1, 0, 1], [2, 0, 1], [0, 1, 0]]
    return Skeleton(np.array(xyz, dtype=float), [-1, 0, 1, 1, 3, 0])


def test_branches_by_hand():
    tree = small_tree()
    assert tree.branch.tolist() == [0, 0, 0, 1, 1, 2]
    assert tree.order.tolist() == [0, 0, 0, 1, 1, 1]
    assert [p.tolist() for p in tree.paths] == [[0, 1, 2], [1, 3, 4], [0, 5]]
    assert tree.branch_parent.tolist() == [-1, 0, 0]
    assert tree.tips.tolist() == [2, 4, 5]
    assert tree.forks.tolist() == [0, 1]
    assert tree.subtree_length.tolist() == [5, 3, 0, 1, 0, 0]
    assert tree.length.tolist() == [0, 1, 1, 1, 1, 1]


def test_order_counts_up_along_nested_branches():
    xyz = np.arange(15.0).reshape(5, 3)
    tree = Skeleton(xyz, [-1, 0, 0, 2, 2])  # 1 continues 0, 3 continues 2, 4 hangs on 2
    assert tree.order.tolist() == [0, 0, 1, 1, 2]


def test_a_branch_starts_with_its_own_radius():
    model = TreeModel(small_tree(), [1, 0.9, 0.8, 0.2, 0.1, 0.3], [0] * 6, [0.0] * 6)
    assert model.start_radius.tolist() == [1, 1, 0.9, 0.2, 0.2, 0.3]
    assert model.volume[5] == pytest.approx(np.pi * 0.3**2)


def test_arrays_cannot_be_changed_but_the_callers_own_can():
    mine = np.zeros((2, 3))
    cloud = PointCloud(mine)
    mine[0, 0] = 7
    with pytest.raises(ValueError, match="read-only"):
        cloud.xyz[0, 0] = 1


def test_pickling_keeps_arrays_frozen_and_content_equal():
    model = TreeModel(small_tree(), [1, 0.9, 0.8, 0.2, 0.1, 0.3], [0] * 6, [0.0] * 6, None, {"a": 1})
    again = pickle.loads(pickle.dumps(model))
    assert not again.radius.flags.writeable
    assert not again.skeleton.xyz.flags.writeable
    np.testing.assert_array_equal(again.skeleton.xyz, model.skeleton.xyz)
    assert dict(again.metadata) == {"a": 1}


@pytest.mark.parametrize(
    ("parent", "said"),
    [
        ([0, 0], "parent\\[0\\] must be -1"),
        ([-1, -1], "no other node may be a root"),
        ([-1, 2, 0], "comes before its parent"),
        ([-1], "shape"),
    ],
)
def test_arrays_that_are_no_tree_are_refused(parent, said):
    with pytest.raises(ModelError, match=said):
        Skeleton(np.zeros((max(len(parent), 2), 3)), parent)


def test_not_finite_and_negative_are_refused():
    with pytest.raises(ModelError, match="finite"):
        Skeleton([[0, 0, np.nan]], [-1])
    with pytest.raises(ModelError, match="negative"):
        TreeModel(Skeleton([[0.0, 0, 0]], [-1]), [-1.0], [0], [0.0])
