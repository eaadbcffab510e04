"""Where a branch leaves its mother: by hand, and as the formula says for any axis."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.skeleton.minimal.geometry import branch_point, nearest_place, place_on
from tests.skeleton.minimal.problems import connection

FOOT, TOP = np.zeros(3), np.array([0.0, 0.0, 10.0])
RIGHT = np.pi / 4
places = st.lists(st.floats(-8, 8), min_size=3, max_size=3).map(np.array)


def test_a_leaf_one_metre_off_leaves_one_metre_below_at_45_degrees():
    s, c = branch_point(np.array([1.0, 0.0, 5.0]), FOOT, TOP, 0.0, RIGHT)
    assert (s, c) == pytest.approx((4.0, np.sqrt(2)))


def test_at_a_right_angle_it_leaves_at_the_leafs_height():
    assert branch_point(np.array([0.0, 2.0, 5.0]), FOOT, TOP, 0.0, np.pi / 2) == pytest.approx((5.0, 2.0))


@pytest.mark.parametrize(
    "leaf",
    [
        (3.0, 0.0, 2.0),  # the branch would start below the foot
        (0.0, 3.0, 9.0),  # it starts at 6 and is 4.24 long, but 4 are left of the trunk
        (0.1, 0.0, 10.5),  # it would start above the top
        (0.0, 0.0, -1.0),
    ],
)
def test_what_may_not_be(leaf):
    assert branch_point(np.array(leaf), FOOT, TOP, 0.0, RIGHT)[1] == np.inf


def test_a_mother_that_goes_on_allows_longer_branches():
    leaf = np.array([0.0, 3.0, 9.0])
    assert branch_point(leaf, FOOT, TOP, 0.25, RIGHT)[1] == pytest.approx(3 * np.sqrt(2))


def test_a_leaf_on_its_mother_needs_no_branch():
    assert branch_point(np.array([0.0, 0.0, 7.0]), FOOT, TOP, 0.0, RIGHT) == (7.0, 0.0)


def test_an_axis_without_length_carries_nothing():
    assert branch_point(np.array([0.0, 0.0, 7.0]), FOOT, FOOT, 100.0, RIGHT)[1] == np.inf


def test_the_limits_themselves_are_allowed():
    """Exactly from the foot, and exactly as long as what is left."""
    assert branch_point(np.array([1.0, 0.0, 1.0]), FOOT, TOP, 0.0, RIGHT)[0] == pytest.approx(0.0)
    leaf = np.array([np.sin(RIGHT), 0.0, 9.0 + np.cos(RIGHT)])
    assert branch_point(leaf, FOOT, TOP, 0.0, RIGHT) == pytest.approx((9.0, 1.0))


@given(leaf=places, base=places, tip=places, degrees=st.floats(5, 90))
def test_it_is_the_papers_projection(leaf, base, tip, degrees):
    found = branch_point(leaf, base, tip, 0.0, np.radians(degrees))
    by_hand = connection(leaf, base, tip, 0.0, np.radians(degrees))
    if by_hand is None or np.isinf(found[1]):  # rounding may decide on the very limit
        limits = (found[0], np.linalg.norm(tip - base) - found[0])
        assert (by_hand is None) == np.isinf(found[1]) or min(map(abs, limits)) < 1e-6
        return
    np.testing.assert_allclose(place_on(base, tip, found[0]), by_hand[0], atol=1e-6)
    assert found[1] == pytest.approx(by_hand[1], abs=1e-6)


@given(leaf=places, base=places, tip=places)
def test_no_place_is_nearer_than_the_nearest(leaf, base, tip):
    s, away = nearest_place(leaf, base, tip)
    share = np.linspace(0, 1, 21)[:, None]
    assert away <= np.linalg.norm(base + share * (tip - base) - leaf, axis=1).min() + 1e-9
    assert np.linalg.norm(place_on(base, tip, s) - leaf) == pytest.approx(away, abs=1e-9)
