"""Which way a branch goes on, once radii are fitted."""

import numpy as np
import pytest

from pipeline.cylinders.restructure import continue_anew
from pipeline.geometry.axes import Axes

STEP_M = 0.04
DIRECTION = np.array([np.sin(np.radians(40)), 0.0, np.cos(np.radians(40))])


def fork(straight_square, side_square):
    """A branch of 4 cm radius that forks into a straight way on and one at 40 degrees."""
    stem = np.arange(26)[:, None] * [0.0, 0.0, 2 * STEP_M]
    side = stem[12] + np.arange(14)[:, None] * 2 * STEP_M * DIRECTION
    square = np.concatenate([np.full(13, 1.6e-3), np.full(13, straight_square), np.full(14, side_square)])
    return Axes(np.vstack([stem, side]), np.array([0, 26, 40]), np.array([-1, 12]), square)


def way_of_the_stem(axes):
    """Where the first branch ends."""
    anew = continue_anew(axes, window_m=0.2, step_m=STEP_M)
    return anew.xyz[anew.first[1] - 1]


@pytest.mark.parametrize("lost", [0.0, -4e-6])
def test_a_twig_that_noise_leaves_without_a_radius_still_goes_straight_on(lost):
    """Its sister's 3 mm are no more than noise makes of the same twig."""
    assert way_of_the_stem(fork(lost, 9e-6))[0] == pytest.approx(0.0, abs=1e-9)


def test_the_stouter_way_on_is_taken_where_radii_tell():
    assert way_of_the_stem(fork(4e-6, 1.6e-3))[0] > 0.5
