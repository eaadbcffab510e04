"""Neighbours and buildings: what they darken, and how a tree grows beside them."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.errors import UsageError
from pipeline.growth import Growth, GrowthOptions, Metamers, Shade
from pipeline.growth.light import Shadow
from pipeline.growth.pyramid import FIXED, fixed
from pipeline.growth.shade import sky, sky_hidden

WALL = Shade(boxes=np.array([[[0.3, -8.0, 0.0], [2.0, 8.0, 12.0]]]))
LOW, SHAPE = np.array([-12, -9, -3]), np.array([30, 21, 17])


def grown(shade: Shade | None, light: str, years: int = 14) -> dict[str, np.ndarray]:
    """A tree beside something."""
    growth = Growth(Metamers.one_bud(), GrowthOptions(light=light), seed=2, shade=shade)
    for _ in range(years):
        growth.grow_year()
    return growth.metamers.held()


def test_a_neighbour_shades_like_a_metamer() -> None:
    options, points = GrowthOptions(), np.array([[0.05, 0.05, 0.35], [0.45, 0.15, 0.55]])
    cast = Shadow(options)
    cast.add(points)
    block = Shade(points).block(cast.grid.low, np.array(cast.grid.values.shape), options=options)
    np.testing.assert_array_equal(block, cast.grid.values)
    twice = Shade(np.concatenate([points, points]))
    np.testing.assert_array_equal(
        twice.block(cast.grid.low, np.array(cast.grid.values.shape), options=options), block
    )


def test_half_the_sky_is_behind_an_endless_wall() -> None:
    wall = np.array([[[0.0, -1e4, -1.0], [1.0, 1e4, 1e4]]])
    hidden = sky_hidden(np.array([[-1e-6, 0.0, 0.0], [-1e9, 0.0, 0.0]]), wall, sky())
    assert hidden[0] == pytest.approx(0.5, abs=0.05)
    assert hidden[1] == 0.0


def test_inside_a_building_it_is_dark() -> None:
    options = GrowthOptions()
    block = WALL.block(LOW, SHAPE, options=options)
    i, j, k = np.array([5, 0, 5]) - LOW
    assert block[i, j, k] >= fixed(options.full_light) + FIXED * options.shade
    assert 0 < block[0, j, k] < block[i - 4, j, k] < fixed(options.full_light)
    assert WALL.inside(np.array([[1.0, 0.0, 1.0], [0.0, 0.0, 1.0]])).tolist() == [True, False]


def test_shade_does_not_depend_on_the_box_that_is_asked_for() -> None:
    both = Shade(np.random.default_rng(1).uniform(-1, 1, (50, 3)), WALL.boxes)
    whole = both.block(LOW, SHAPE, options=GrowthOptions())
    part = both.block(LOW + 4, SHAPE - 7, options=GrowthOptions())
    inner = tuple(slice(4, 4 + n) for n in (SHAPE - 7).tolist())
    np.testing.assert_array_equal(whole[inner], part)


@pytest.mark.parametrize("light", ["shadow", "space"])
def test_a_tree_grows_away_from_a_wall_and_never_into_it(light: str) -> None:
    beside, alone = grown(WALL, light)["end"], grown(None, light)["end"]
    assert beside[:, 0].mean() < alone[:, 0].mean() - 0.1
    assert WALL.inside(beside).mean() < 0.01


def test_space_near_a_neighbour_is_taken() -> None:
    x, y, z = np.meshgrid(np.arange(0.4, 2, 0.1), np.arange(-2, 2, 0.1), np.arange(0, 4, 0.1))
    hedge = Shade(np.column_stack([x.ravel(), y.ravel(), z.ravel()]))
    assert (grown(hedge, "space")["end"][:, 0] < 0.6).all()
    assert (grown(None, "space")["end"][:, 0] > 0.6).any()


@pytest.mark.parametrize(
    ("points", "boxes", "told"),
    [
        (np.zeros((2, 2)), np.zeros((0, 2, 3)), r"give \(P, 3\) points"),
        (np.full((1, 3), np.nan), np.zeros((0, 2, 3)), "not finite"),
        (np.zeros((0, 3)), np.zeros((1, 2, 3)), "first corner is not its lowest"),
    ],
)
def test_what_is_no_shade_is_refused(points: np.ndarray, boxes: np.ndarray, told: str) -> None:
    with pytest.raises(UsageError, match=told):
        Shade(points, boxes)
