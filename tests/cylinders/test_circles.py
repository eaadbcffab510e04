"""Circles of the skeleton stand in for windows of the stem that show no bark."""

from dataclasses import fields, replace

import numpy as np
import pytest

from pipeline.cylinders.circles import SOUND, with_circles
from pipeline.geometry.axes import Axes
from pipeline.geometry.estimates import CYLINDER, MOMENTS, NONE
from pipeline.geometry.windows import Windows

STEM, BRANCH = 11, 3
CIRCLES = ((0.9, 0.20, 0.01), (1.45, 0.18, 0.02))
"""Height, radius and its standard error."""
NEAR = [4, 5, 7, 8]
"""Nodes of the stem within 20 cm of a circle."""


@pytest.fixture(scope="module")
def axes():
    """A stem of 2 m with a node every 20 cm, and a branch that passes the circles' heights too."""
    stem = np.column_stack([np.zeros((STEM, 2)), np.linspace(0, 2, STEM)])
    branch = np.array([[0.0, 0, 0.8], [0.5, 0, 0.9], [1.0, 0, 1.4]])
    square = np.full(STEM + BRANCH, 0.04)
    return Axes(np.vstack([stem, branch]), np.array([0, STEM, STEM + BRANCH]), np.array([-1, 4]), square)


@pytest.fixture
def windows():
    """Windows that say nothing."""
    count = STEM + BRANCH
    return Windows(
        np.full(count, NONE),
        np.full((count, 3), 0.05),
        np.zeros(count),
        np.full(count, np.inf),
        np.full(count, np.inf),
        np.full(count, 3),
        np.full(count, 0.01),
        np.zeros(count),
        np.zeros(count),
        np.zeros((count, 3)),
    )


def test_without_circles_the_windows_are_the_same(windows, axes):
    assert with_circles(windows, axes, ()) is windows


def test_nodes_near_a_circle_take_the_nearest_one(windows, axes):
    found = with_circles(windows, axes, CIRCLES)
    assert np.flatnonzero(found.kind == CYLINDER).tolist() == NEAR
    np.testing.assert_allclose(found.square[NEAR], np.square([0.20, 0.20, 0.18, 0.18]))
    np.testing.assert_allclose(found.centre_variance[NEAR], np.square([0.01, 0.01, 0.02, 0.02]))
    assert (found.evidence[NEAR] == 1.0).all()
    assert found.arc[NEAR] == pytest.approx(2 * np.pi)
    assert (found.shift[NEAR] == 0.0).all()


def test_between_two_circles_the_nearer_one_counts(windows, axes):
    found = with_circles(windows, axes, ((0.9, 0.20, 0.01), (1.05, 0.18, 0.02)))
    np.testing.assert_allclose(found.square[[4, 5, 6]], np.square([0.20, 0.18, 0.18]))


def test_the_variance_is_that_of_a_square_whose_root_has_the_error(windows, axes):
    found = with_circles(windows, axes, CIRCLES[:1])
    drawn = np.random.default_rng(0).normal(0.20, 0.01, 200_000) ** 2
    assert found.variance[4] == pytest.approx(drawn.var(), rel=0.02)


def test_other_nodes_and_branches_stay_as_they_were(windows, axes):
    found = with_circles(windows, axes, CIRCLES)
    rest = np.setdiff1d(np.arange(STEM + BRANCH), NEAR)
    for each in fields(Windows):
        np.testing.assert_array_equal(getattr(found, each.name)[rest], getattr(windows, each.name)[rest])


def test_a_sound_window_needs_no_circle(windows, axes):
    kind, evidence = windows.kind.copy(), windows.evidence.copy()
    kind[[4, 5, 7]] = [CYLINDER, CYLINDER, MOMENTS]
    evidence[[4, 5, 7]] = [SOUND, SOUND - 0.01, 1.0]
    found = with_circles(replace(windows, kind=kind, evidence=evidence), axes, CIRCLES)
    assert (found.square[[4, 5, 7]] > 0).tolist() == [False, True, True]


def test_the_windows_given_are_not_changed(windows, axes):
    before = {each.name: getattr(windows, each.name).copy() for each in fields(Windows)}
    with_circles(windows, axes, CIRCLES)
    for name, values in before.items():
        np.testing.assert_array_equal(getattr(windows, name), values)
