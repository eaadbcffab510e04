"""The two orders of a tree, on a tree small enough to draw."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pipeline.lsystem import canonical, decode, encode
from pipeline.lsystem.numbering import carried, continued, numbered, told
from pipeline.model import TreeModel

# Stem 0-1-2-3, branches 4-5 and 6 on node 1, branch 7 on node 2, twig 8 on node 4.
PARENT = np.array([-1, 0, 1, 2, 1, 4, 1, 2, 4], dtype=np.int32)
CONTINUATION = np.array([1, 2, 3, -1, 5, -1, -1, -1, -1], dtype=np.int32)


def test_an_l_string_tells_side_branches_first() -> None:
    assert told(PARENT, CONTINUATION).tolist() == [0, 1, 4, 8, 5, 6, 2, 7, 3]


def test_a_model_is_numbered_by_branches_breadth_first() -> None:
    assert numbered(PARENT, CONTINUATION)[0].tolist() == list(range(9))
    # The same tree in the order of its L-string gets the same numbers.
    order = told(PARENT, CONTINUATION)
    rank = np.argsort(order)
    parent = np.where(PARENT < 0, -1, rank[PARENT])[order].astype(np.int32)
    continuation = np.where(CONTINUATION < 0, -1, rank[CONTINUATION])[order].astype(np.int32)
    old, new_parent = numbered(parent, continuation)
    assert order[old].tolist() == list(range(9))
    assert new_parent.tolist() == PARENT.tolist()


def test_compiled_orders_equal_their_python_originals() -> None:
    wood = np.arange(9.0)
    bracketed = np.zeros(9, dtype=bool)
    cases = [
        (told, (PARENT, CONTINUATION)),
        (carried, (PARENT, wood)),
        (continued, (PARENT, ~bracketed, wood)),
    ]
    for kernel, arguments in cases:
        np.testing.assert_array_equal(kernel(*arguments), kernel.py_func(*arguments))


def test_the_child_outside_brackets_continues_whatever_it_carries() -> None:
    parent = np.array([-1, 0, 0, 0], dtype=np.int32)
    wood = np.array([9.0, 1, 5, 2])
    assert continued(parent, np.array([False, True, True, False]), wood)[0] == 3
    assert continued(parent, np.array([False, True, True, True]), wood)[0] == 2


def test_canonical_is_what_comes_back(tree_of: Callable[..., TreeModel]) -> None:
    rng = np.random.default_rng(3)
    parent = [-1, *(int(rng.integers(0, i)) for i in range(1, 80))]
    tree = tree_of(rng.normal(size=(80, 3)), parent, rng.uniform(0.01, 0.1, 80))
    ours = canonical(tree)
    assert not np.array_equal(ours.skeleton.parent, tree.skeleton.parent)
    assert canonical(ours) is ours
    back = decode(encode(tree))
    assert np.array_equal(back.skeleton.parent, ours.skeleton.parent)
    assert sorted(ours.radius) == sorted(tree.radius)
    # Branches are the same ones, under whatever numbers.
    lengths = [sorted(map(len, model.skeleton.paths)) for model in (tree, ours, back)]
    assert lengths[0] == lengths[1] == lengths[2]
