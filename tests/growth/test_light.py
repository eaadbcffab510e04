"""Shadow by hand and by plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.growth import GrowthOptions, Metamers, grow
from pipeline.growth.lattice import Lattice, zeros
from pipeline.growth.light import REACH, Shadow, around
from pipeline.growth.pyramid import FIXED, pyramid, towards_light

POINTS = np.random.default_rng(7).uniform(-0.6, 0.6, (40, 3))
FOOT = np.array([0], dtype=np.int32)
TERMINAL = np.array([False])


def shade_of(points: np.ndarray, options: GrowthOptions) -> dict[tuple[int, ...], int]:
    """The shade of points by the equation of the thesis: a b^-q in (I +- p, J +- p, K - q), p up to q."""
    shade: dict[tuple[int, ...], int] = {}
    for i, j, k in np.floor(points / options.voxel_m).astype(int):
        for q in range(options.shade_layers + 1):
            for u in range(-q, q + 1):
                for v in range(-q, q + 1):
                    amount = round(FIXED * options.shade * options.shade_fall**-q)
                    shade[i + u, j + v, k - q] = shade.get((i + u, j + v, k - q), 0) + amount
    return shade


def tree_at(point: np.ndarray) -> Metamers:
    """A bud at a point."""
    return Metamers.one_bud(point)


@pytest.mark.parametrize("layers", [0, 1, 5])
def test_shade_is_that_of_plain_python(layers: int) -> None:
    options = GrowthOptions(shade_layers=layers)
    shadow = Shadow(options)
    shadow.add(POINTS)
    known = shade_of(POINTS, options)
    held = {tuple(at + shadow.grid.low): v for at, v in np.ndenumerate(shadow.grid.values) if v}
    assert held == {at: v for at, v in known.items() if v}


def test_light_is_what_shade_leaves_and_never_below_nothing() -> None:
    options = GrowthOptions()
    shadow = Shadow(options)
    points = np.tile([[0.05, 0.05, 0.05]], (3, 1))
    shadow.add(points[:1])
    tree = tree_at(points[0])
    assert shadow.at_buds(tree).terminal[0] == pytest.approx(options.full_light)
    shadow.add(points[1:])
    assert shadow.at_buds(tree).terminal[0] == pytest.approx(options.full_light - 2 * options.shade, abs=1e-6)
    shadow.add(np.repeat(points, 5, axis=0))
    assert shadow.at_buds(tree).terminal[0] == 0.0


def test_the_way_is_that_of_plain_numpy() -> None:
    options = GrowthOptions()
    shadow = Shadow(options)
    shadow.add(POINTS)
    known = shade_of(POINTS, options)
    near = around(REACH)
    assert len(near.offset) == 32
    for point in POINTS[:10]:
        cell = np.floor(point / options.voxel_m).astype(int)
        shade = np.array([known.get(tuple(cell + at), 0) for at in near.offset])
        way = -(shade[:, None] * near.offset / np.linalg.norm(near.offset, axis=1)[:, None]).sum(axis=0)
        got = shadow.towards(tree_at(point), FOOT, TERMINAL)[0]
        np.testing.assert_allclose(got, way / np.linalg.norm(way), atol=1e-9)


def test_without_shade_there_is_no_way() -> None:
    assert not Shadow(GrowthOptions()).towards(tree_at(np.zeros(3)), FOOT, TERMINAL).any()


def test_the_discrete_way_goes_to_the_neighbours_with_the_least_shade() -> None:
    shadow = Shadow(GrowthOptions(direction="discrete", shade_layers=0))
    step = around(1).offset
    open_side = np.array([1, 0, 1])
    shadow.add((step[(step != open_side).any(axis=1)] + 0.5) * 0.1)
    way = shadow.towards(tree_at(np.array([0.05, 0.05, 0.05])), FOOT, TERMINAL)[0]
    np.testing.assert_allclose(way, np.array([1, 0, 1]) / np.sqrt(2), atol=1e-9)


def test_tilted_light_casts_its_shade_to_the_other_side() -> None:
    options = GrowthOptions(light_tilt_deg=45.0, light_azimuth_deg=90.0)
    np.testing.assert_allclose(towards_light(options), [0, np.sqrt(0.5), np.sqrt(0.5)], atol=1e-12)
    form = pyramid(options)
    middle = (form.offset * form.amount[:, None]).sum(axis=0) / form.amount.sum()
    assert middle[1] < -0.5
    assert middle[2] < -0.5
    assert abs(middle[0]) < 0.05
    upright = pyramid(GrowthOptions())
    assert len(upright.offset) == sum((2 * q + 1) ** 2 for q in range(6))
    assert form.amount.sum() == pytest.approx(upright.amount.sum(), rel=0.15)


def test_a_tree_leans_to_tilted_light() -> None:
    lean = []
    for seed in range(4):
        held = grow(GrowthOptions(light_tilt_deg=40.0), 14, seed=seed).metamers.held()
        lean.append(held["end"][:, 0].mean())
    assert np.mean(lean) > 0.15


def test_a_box_that_grows_to_one_side_does_not_grow_to_the_others() -> None:
    box = Lattice(0.1, zeros)
    for reach in np.arange(0.2, 1.0, 0.1):
        box.cover(np.array([[-reach, -reach, 0.0], [reach, reach, 0.5]]), 2)

    for height in np.arange(1.0, 9.0, 0.5):
        box.cover(np.array([[-0.9, -0.9, 0.0], [0.9, 0.9, height]]), 2)
    assert box.values.shape[2] > 80
    assert max(box.values.shape[:2]) <= 2 * 24  # twice what is needed
