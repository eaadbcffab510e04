"""A radius is measured where the windows around it bear it out, and where it is the points' own."""

from types import SimpleNamespace

import numpy as np

from pipeline.cylinders.support import measured_nodes

EVEN = np.full(40, 1e-4)


def measured(square=EVEN, *, fitted=EVEN, bears=True, own=1.0, first=(0, 40)):
    axes = SimpleNamespace(first=np.array(first))
    return measured_nodes(
        axes, square, fitted, np.broadcast_to(bears, 40).copy(), np.broadcast_to(own, 40).copy()
    )


def test_windows_that_agree_are_measured():
    assert measured().all()


def test_windows_that_contradict_each_other_are_not():
    """As circles through leaves do: now twice, now half of what the branch can be."""
    assert not measured(EVEN * np.tile([0.25, 4.0], 20)).any()


def test_one_that_strays_among_many_leaves_them_measured():
    square = EVEN.copy()
    square[20] *= 9
    assert measured(square).all()


def test_a_lone_window_measures_nothing():
    bears = np.zeros(40, dtype=bool)
    bears[18:22] = True
    assert not measured(bears=bears).any()


def test_a_branch_of_three_nodes_can_be_measured():
    assert measured(first=(0, 3, 40))[:3].all()


def test_branches_do_not_speak_for_each_other():
    bears = np.arange(40) < 20
    square = np.where(np.arange(40) < 20, EVEN, 9 * EVEN)
    found = measured(square, bears=bears | (np.arange(40) == 20), first=(0, 20, 40))
    assert found[:20].all()
    assert not found[20:].any()


def test_what_habit_has_made_of_a_window_is_not_the_points_own():
    own = np.where(np.arange(40) < 20, 0.8, 0.3)
    assert measured(own=own).tolist() == [True] * 20 + [False] * 20


def test_noise_below_zero_is_no_radius():
    assert not measured(-EVEN, fitted=np.zeros(40)).any()
