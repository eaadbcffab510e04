"""At a fork the straight, thick, heavy way goes on."""

import numpy as np

from pipeline.geometry.branching import continue_branches, longest_child
from pipeline.geometry.numbering import number_by_paths


def fork(radius=(0.1, 0.1, 0.05, 0.05)):
    # 0 - 1, then 2 straight up and 3 to the side, 3 - 4 on and on
    xyz = np.array([[0, 0, 0], [0, 0, 1], [0, 0, 2], [1, 0, 1], [3, 0, 1.0]])
    parent = np.array([-1, 0, 1, 1, 3])
    return xyz, parent, np.array([radius[0], radius[1], radius[2], radius[3], radius[3]])


def test_straight_beats_long():
    xyz, parent, radius = fork()
    assert continue_branches(xyz, parent, radius, 0.5).tolist() == [1, 2, -1, 4, -1]


def test_much_thicker_beats_straight():
    xyz, parent, radius = fork((0.1, 0.1, 0.002, 0.09))
    assert continue_branches(xyz, parent, radius, 0.5).tolist() == [1, 3, -1, 4, -1]


def test_longest_child_follows_the_way_to_the_farthest_tip():
    parent = np.array([-1, 0, 1, 1, 3])
    step = np.array([0.0, 1, 1, 1, 1])
    assert longest_child(parent, step).tolist() == [1, 3, -1, 4, -1]


def test_numbers_run_branch_by_branch():
    parent = np.array([-1, 0, 1, 1, 2, 3])
    ahead = np.array([1, 3, 4, 5, -1, -1])
    assert number_by_paths(parent, ahead).tolist() == [0, 1, 3, 5, 2, 4]
