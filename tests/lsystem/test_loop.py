"""The compiled loop and turtle equal their Python originals, and the turtle repeats the loop."""

from __future__ import annotations

from math import pi

import numpy as np
import pytest

from pipeline.lsystem.loop import close_loop, decimals_for, folded, turn
from pipeline.lsystem.tokens import tokenise
from pipeline.lsystem.turtle import Walk, walk
from pipeline.model import TreeModel


def test_the_loop_equals_its_python_original(bush: TreeModel) -> None:
    arguments = bush.skeleton.xyz[:500], bush.skeleton.parent[:500], 1000, 0
    for fast, slow in zip(close_loop(*arguments), close_loop.py_func(*arguments), strict=True):
        np.testing.assert_array_equal(fast, slow)


def test_the_turtle_equals_its_python_original() -> None:
    symbols, values = tokenise("-(90)F(1)[>(30)+(12.5)!(0.1)F(0.25)[F(2)]]<(7)F(1)X")
    fast, slow = (Walk(*function(symbols, values, pi / 180)) for function in (walk, walk.py_func))
    np.testing.assert_allclose(fast.xyz, slow.xyz, rtol=0, atol=1e-15)
    for a, b in zip(fast[1:], slow[1:], strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize(
    ("length", "decimals"), [(0, 0), (0.02, 0), (0.03, 1), (0.3, 2), (3, 3), (25, 4), (999, 4)]
)
def test_decimals_follow_the_length(length: float, decimals: int) -> None:
    assert decimals_for(length) == decimals


def test_angles_fold_into_a_half_open_turn() -> None:
    assert [folded(a, 10, 1800) for a in (0, 179.96, -179.96, 180, -180, 540, 359.9)] == [
        *(0, 1800, 1800, 1800, 1800, 1800, -1),
    ]


def test_the_smaller_roll_is_taken() -> None:
    # Heading up with roll 0, to the west: rotate past the vertical rather than roll half round.
    assert turn(np.array([-1.0, 0.0, 0.0]), -90.0, 0.0, 1.0, 10) == (-900, 0)
    # Heading up, to the south: 90 degrees either way, the positive one is taken.
    assert turn(np.array([0.0, -1.0, 0.0]), -90.0, 0.0, 1.0, 10) == (-900, 900)


def test_no_roll_on_a_vertical_heading() -> None:
    assert turn(np.array([1e-9, -1e-9, 2.0]), -90.0, 33.0, 2.0, 10) == (0, 0)
    assert turn(np.array([0.0, 0.0, -2.0]), -90.0, 33.0, 2.0, 10) == (1800, 0)
