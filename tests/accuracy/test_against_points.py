"""A model beside points: coverage, points without wood, wood without points."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.accuracy import NotComparableError, compare_cloud
from pipeline.model import PointCloud
from tests.accuracy.conftest import changed, pole


def ring(z, radius=0.1, count=40, middle=(0.0, 0.0)):
    turn = np.linspace(0, 2 * np.pi, count, endpoint=False)
    x, y = middle[0] + radius * np.cos(turn), middle[1] + radius * np.sin(turn)
    return np.column_stack([x, y, np.full(count, z)])


BARK = np.concatenate([ring(z) for z in np.arange(0, 3.01, 0.05)])
MODEL = pole([0, 0, 0], [0, 0, 1], [0, 0, 2], [0, 0, 3], [1, 0, 2], radius=0.1, parent=[-1, 0, 1, 2, 2])


def test_points_on_the_bark_are_explained():
    found = compare_cloud(MODEL, PointCloud(BARK))
    assert found.surface.max_mm < 1e-9
    assert found.surface.matched == len(BARK)
    assert (found.coverage, found.unexplained.points) == (1.0, 0)
    assert found.unsupported.branches == 1  # no point lies on the branch
    assert found.unsupported.length_m == pytest.approx(0.8, abs=0.1)
    assert found.nodes is None


def test_unexplained_points_are_found_where_they_are():
    clump = ring(2.5, 0.05, 30, middle=(1.0, 1.0))
    found = compare_cloud(MODEL, PointCloud(np.concatenate([BARK, clump, [[3.0, 0.0, 1.0]]])))
    assert found.unexplained.points == 31
    assert found.coverage == pytest.approx(1 - 31 / (len(BARK) + 31))
    first, second = found.unexplained.clumps
    assert (first.points, second.points) == (30, 1)
    assert (first.x, first.y, first.z) == pytest.approx((1.0, 1.0, 2.5))


def test_places_are_in_the_coordinates_of_the_input():
    origin = [120_000.0, 487_000.0, 3.0]
    cloud = PointCloud(np.concatenate([BARK, [[3.0, 0.0, 1.0]]]), np.array(origin), "EPSG:28992")
    found = compare_cloud(changed(MODEL, origin=origin, crs="EPSG:28992"), cloud)
    clump = found.unexplained.clumps[0]
    assert (clump.x, clump.y, clump.z) == pytest.approx((120_003, 487_000, 4))
    assert found.surface.median_mm < 1e-6


def test_ground_water_and_noise_do_not_count():
    low = [[0.5, 0.5, 0.0]] * 4
    kind = np.array([1] * len(BARK) + [2, 7, 9, 18])
    cloud = PointCloud(np.concatenate([BARK, low]), attributes={"classification": kind})
    assert compare_cloud(MODEL, cloud).unexplained.points == 0


def test_the_order_of_rows_does_not_matter():
    rng = np.random.default_rng(0)
    points = BARK + rng.normal(0, 0.03, BARK.shape)
    one, other = (compare_cloud(MODEL, PointCloud(p)) for p in (points, rng.permutation(points)))
    assert one.to_json() == other.to_json()


def test_skeletons_have_no_bark():
    found = compare_cloud(MODEL.skeleton, PointCloud(BARK))
    assert found.surface is None
    assert found.coverage is None
    assert found.axis.median_mm == pytest.approx(100)


@pytest.mark.parametrize(
    ("cloud", "told"),
    [
        (PointCloud(BARK + [30, 0, 0]), r"do not overlap, 28\.\d m"),
        (PointCloud(BARK + [30_000, 0, 0]), "30.0 km"),
        (PointCloud(np.zeros((0, 3))), "cloud is empty"),
        (PointCloud(BARK, crs="EPSG:2154"), "convert one of them"),
    ],
)
def test_what_cannot_be_compared(cloud, told):
    with pytest.raises(NotComparableError, match=told):
        compare_cloud(changed(MODEL, crs="EPSG:28992"), cloud)
