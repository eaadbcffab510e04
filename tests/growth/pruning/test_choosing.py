"""Branches that are not there: the nearest is told; and places and ways that are no three numbers."""

from __future__ import annotations

import re

import numpy as np
import pytest

from pipeline.errors import UsageError
from pipeline.growth import Growth, GrowthOptions, Metamers
from pipeline.growth.pruning import OPERATIONS, CutToBud, FacingBud, operation_of
from pipeline.growth.pruning.selecting import goes_to, starts_of

TOLD = re.compile(r"nearest is of order (\d+), begins (-?[\d.]+) m above the foot, at \(([^)]*)\), and (.*):")


def told(chosen: CutToBud, growth: Growth) -> tuple[int, float, str]:
    """Return order, height and way of the branch that the error calls the nearest."""
    with pytest.raises(UsageError, match=r"cut-to-bud: no branch fits .*: correct what it is") as caught:
        chosen.check_chosen(growth)
    order, height, _, way = TOLD.search(str(caught.value)).groups()
    return int(order), float(height), way


def test_the_branch_of_the_nearest_order_is_told(tree_of) -> None:
    growth = tree_of(12)
    tree = growth.metamers
    assert told(CutToBud(order=9), growth)[0] == tree.order[: len(tree)].max()


def test_the_branch_at_the_nearest_height_is_told(tree_of) -> None:
    growth = tree_of(12)
    tree = growth.metamers
    heights = tree.begin[starts_of(tree), 2] - tree.end[0, 2]
    assert told(CutToBud(lowest_m=50), growth)[1] == pytest.approx(heights.max(), abs=0.005)
    assert told(CutToBud(highest_m=-1), growth)[1] == 0.0
    sides = heights[1:][tree.order[starts_of(tree)[1:]] == 1]
    assert told(CutToBud(order=1, lowest_m=50), growth)[1] == pytest.approx(sides.max(), abs=0.005)


def test_the_branch_that_goes_nearest_to_the_azimuth_is_told(tree_of) -> None:
    growth = tree_of(12)
    ways = goes_to(growth.metamers, starts_of(growth.metamers))
    chosen = CutToBud(azimuth_deg=ways[3] + 0.01, azimuth_within_deg=0.005)
    assert told(chosen, growth)[2] == f"goes to {ways[3]:.0f} degrees in plan"


def test_nothing_is_said_where_a_branch_fits_or_none_is_chosen(tree_of) -> None:
    growth = tree_of(12)
    for chosen in (CutToBud(order=1), CutToBud(all=True), CutToBud(highest_m=0.5), CutToBud()):
        chosen.check_chosen(growth)


def test_a_bud_has_no_side_branch_yet() -> None:
    growth = Growth(Metamers.one_bud(), GrowthOptions(), seed=0)
    with pytest.raises(UsageError, match="has no side branch yet; choose the stem, order = 0, or a"):
        FacingBud(all=True).check_chosen(growth)
    assert np.isnan(goes_to(growth.metamers, [0])).all()


@pytest.mark.parametrize(
    ("name", "key", "value", "said"),
    [
        ("stake", "direction", [1, 0], "direction = 1,0 is not allowed; give three numbers x,y,z"),
        ("facing-bud", "direction", "down", "direction = down is not allowed; give three numbers"),
        ("bend-and-tie", "direction", [1, 0, "x"], "direction = 1,0,x is not allowed; give three numbers"),
        ("stake", "direction", [0, 0, 0], "a direction of no length leads nowhere; give for example 0,0,1"),
        ("cut-to-bud", "position", 1, "position = 1 is not allowed; give three numbers x,y,z"),
    ],
)  # fmt: skip
def test_places_and_ways_are_three_numbers(name, key, value, said) -> None:
    with pytest.raises(UsageError) as caught:
        operation_of(name, {key: value})
    assert said in str(caught.value)


def test_every_operation_tells_what_it_looks_for() -> None:
    for operation in OPERATIONS.values():
        what, remedy = operation.sought.split("; ")
        assert what
        assert remedy
        keys = set(re.findall(r"\w+_m\b", operation.sought))
        assert keys <= operation.model_fields.keys()
