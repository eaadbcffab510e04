"""Beams and which of them can hit anything; without open3d."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.synthetic.beams import BeamOptions, sub_rays, sunflower
from pipeline.synthetic.ground import disc, terrain
from pipeline.synthetic.returns import Echoes, recorded
from pipeline.synthetic.silhouette import Grid, cells_towards


def test_a_sunflower_fills_the_disc_around_its_middle() -> None:
    for count in (1, 7, 19, 61):
        places = sunflower(count)
        assert places.shape == (count, 2)
        assert places.mean(axis=0) == pytest.approx([0, 0], abs=1e-12)
        assert np.linalg.norm(places, axis=1).max() <= 1.1
    inner = np.linalg.norm(sunflower(61), axis=1) < np.sqrt(0.5)
    assert inner.mean() == pytest.approx(0.5, abs=0.05)


def test_sub_rays_widen_with_the_range() -> None:
    options = BeamOptions(aperture_m=0.004, divergence_mrad=1.0, sub_rays=19)
    heading = np.array([[1.0, 0, 0], [0, 0, -1.0], [0.6, 0, 0.8]])
    start, way = sub_rays(np.zeros((3, 3)), heading, options)
    assert np.linalg.norm(way, axis=1) == pytest.approx(1.0)
    for range_m, diameter in ((0.0, 0.004), (10.0, 0.014), (100.0, 0.104)):
        ends = (start + range_m * way).reshape(3, 19, 3)
        across = ends - range_m * heading[:, None]
        off = np.linalg.norm(across, axis=2)
        assert off.max(axis=1) == pytest.approx(diameter / 2, rel=0.06)
        assert np.abs((across * heading[:, None]).sum(axis=2)).max() < 1e-3


def hits(direction: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Möller and Trumbore's test of all directions from the zero against all triangles."""
    a, b, c = (triangles[:, k] for k in range(3))
    across = np.cross(direction[:, None], c - a)
    size = (across * (b - a)).sum(axis=2)
    u = (across * -a).sum(axis=2) / size
    turned = np.cross(-a, b - a)
    v = (direction[:, None] * turned).sum(axis=2) / size
    far = (turned * (c - a)).sum(axis=1) / size
    return ((u >= 0) & (v >= 0) & (u + v <= 1) & (far > 0)).any(axis=1)


def everywhere(grid: Grid) -> np.ndarray:
    """Return the numbers of all directions of a coarse grid."""
    turn = np.arange(-int(np.pi / grid.step) - 1, int(np.pi / grid.step) + 1)
    rise = np.arange(-int(np.pi / 2 / grid.step), int(np.pi / 2 / grid.step))
    return np.stack(np.meshgrid(turn, rise, indexing="ij"), axis=-1).reshape(-1, 2)


@pytest.mark.parametrize("seed", range(6))
def test_no_direction_that_hits_is_left_out(seed: int) -> None:
    rng = np.random.default_rng(seed)
    middle = rng.normal(0, 4, (12, 1, 3)) * (1 if seed % 2 else [0.2, 0.2, 1.0])  # half of them overhead
    triangles = middle + rng.normal(0, 0.1 if seed < 3 else 1.5, (12, 3, 3))
    grid = Grid(np.radians(1.7), rng.random(2), float(rng.uniform(-4, 4)))
    corners, faces = triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3)
    chosen = {tuple(cell) for cell in cells_towards(corners, faces, grid, (0.0, 0.0)).tolist()}
    cells = everywhere(grid)
    hit = cells[hits(grid.directions(cells), triangles)]
    assert len(hit)
    azimuth = (hit[:, 0] + grid.phase[0]) * grid.step
    assert {tuple(cell) for cell in hit[np.abs(azimuth) < np.pi].tolist()} <= chosen


def test_few_directions_are_chosen_in_vain() -> None:
    square = np.array([[9.0, -1, -1], [9, 1, -1], [9, 1, 1], [9, -1, 1]])
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    grid = Grid(np.radians(0.5), np.array([0.5, 0.5]), 0.0)
    chosen = cells_towards(square, faces, grid, (0.0, 0.0))
    side = 2 * np.degrees(np.arctan2(1, 9)) / 0.5
    assert len(chosen) == pytest.approx(side**2, rel=0.1)
    assert len(np.unique(chosen, axis=0)) == len(chosen)
    wider = cells_towards(square, faces, grid, (0.0, 2 * grid.step))
    assert len(wider) == pytest.approx((side + 2) ** 2, rel=0.1)
    assert len(cells_towards(square, faces[:0], grid, (0.0, 0.0))) == 0


def test_returns_are_counted_and_weak_or_late_ones_dropped() -> None:
    beam = np.array([0, 0, 2, 2, 2, 5])
    zero = np.zeros(6)
    echoes = Echoes(beam, zero, zero, np.array([7, 1, 2, 3, 2, 1]), beam, zero, np.zeros((6, 3)))
    options = BeamOptions(sub_rays=7, least_share=0.2, max_returns=2)
    kept, number, count = recorded(echoes, options)
    assert kept.beam.tolist() == [0, 2, 2]
    assert number.tolist() == [1, 1, 2]
    assert count.tolist() == [1, 2, 2]
    nothing = recorded(echoes, options.model_copy(update={"sub_rays": 61}))
    assert len(nothing[0].beam) == len(nothing[1]) == len(nothing[2]) == 0


def test_ground_rises_and_is_rough_as_asked() -> None:
    flat, squares = disc(terrain(0, 0, np.random.default_rng(1)), 2.0)
    assert (flat[:, 2] == 0).all()
    a, b, c = (flat[squares[:, k]] for k in range(3))
    up = np.cross(b - a, c - a)[:, 2] / 2
    assert (up > 0).all()
    assert up.sum() == pytest.approx(np.pi * 4, rel=0.05)
    slope = terrain(20, 0, np.random.default_rng(1))
    assert np.degrees(np.arctan(np.linalg.norm(slope.slope))) == pytest.approx(20)
    rough = terrain(0, 0.05, np.random.default_rng(2))
    places = np.random.default_rng(3).uniform(-20, 20, (4000, 2))
    assert rough.height(places).std() == pytest.approx(0.05, rel=0.1)
    assert rough.height(np.zeros((1, 2))) == pytest.approx(0)
    assert len(disc(rough, 0.0)[1]) == 0
