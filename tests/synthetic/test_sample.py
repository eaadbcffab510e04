"""Points on the bark: on the surface, evenly, and nowhere inside the wood."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.geometry.surface import Tubes, nearest_tube
from pipeline.model import Skeleton, TreeModel
from pipeline.synthetic import SampleOptions, TubeTreeOptions, grow_tubes, sample


def post(radius: float = 0.1, length: float = 2.0) -> TreeModel:
    """Return one upright cylinder."""
    skeleton = Skeleton(
        np.array([[0, 0, 0], [0, 0, length]]), np.array([-1, 0]), np.array([5.0, 6, 7]), "EPSG:28992"
    )
    return TreeModel(skeleton, np.full(2, radius), np.zeros(2, dtype=np.uint8), np.zeros(2))


@pytest.fixture(scope="module")
def tree() -> TreeModel:
    return grow_tubes(TubeTreeOptions(seed=4, height_m=5, max_order=2))


def test_points_lie_on_a_cylinder_evenly() -> None:
    cloud = sample(post(), options=SampleOptions(noise_m=0, density_per_m2=20_000))
    assert np.linalg.norm(cloud.xyz[:, :2], axis=1) == pytest.approx(np.full(len(cloud), 0.1))
    area = 2 * np.pi * 0.1 * 2
    assert len(cloud) == pytest.approx(20_000 * area, abs=5 * np.sqrt(20_000 * area))
    counts = np.histogram(cloud.xyz[:, 2], bins=10, range=(0, 2))[0]
    assert counts == pytest.approx(np.full(10, 2_000 * area), rel=0.1)
    quarters = np.bincount(2 * (cloud.xyz[:, 0] > 0) + (cloud.xyz[:, 1] > 0))
    assert quarters == pytest.approx(np.full(4, 5_000 * area), rel=0.1)


def test_the_cloud_stands_where_the_tree_stands() -> None:
    cloud = sample(post())
    assert cloud.origin.tolist() == [5, 6, 7]
    assert cloud.crs == "EPSG:28992"


def test_noise_is_as_asked() -> None:
    cloud = sample(post(), options=SampleOptions(noise_m=0.004, density_per_m2=20_000))
    off = np.linalg.norm(cloud.xyz[:, :2], axis=1) - 0.1
    assert off.std() == pytest.approx(0.004, rel=0.05)


def test_without_noise_every_point_is_on_the_surface(tree: TreeModel) -> None:
    cloud = sample(tree, options=SampleOptions(noise_m=0))
    parent = tree.skeleton.parent[1:]
    tubes = Tubes(tree.skeleton.xyz[parent], tree.skeleton.xyz[1:], tree.start_radius[1:], tree.radius[1:])
    assert np.abs(nearest_tube(cloud.xyz, tubes).surface).max() < 0.0005


def test_no_point_is_inside_the_stem(tree: TreeModel) -> None:
    cloud = sample(tree, options=SampleOptions(noise_m=0))
    stem = np.flatnonzero((tree.skeleton.order == 0) & (tree.skeleton.parent >= 0))
    for i in stem:
        a, b = tree.skeleton.xyz[i - 1], tree.skeleton.xyz[i]
        share = (cloud.xyz - a) @ (b - a) / ((b - a) @ (b - a))
        away = np.linalg.norm(cloud.xyz - a - share[:, None] * (b - a), axis=1)
        radius = tree.radius[i - 1] + share * (tree.radius[i] - tree.radius[i - 1])
        assert not ((share > 0) & (share < 1) & (away < radius - 0.001)).any()


def test_one_side_is_half_of_a_cylinder() -> None:
    whole = sample(post())
    half = sample(post(), options=SampleOptions(one_sided=True, scanner_azimuth_deg=90, noise_m=0))
    assert len(half) == pytest.approx(len(whole) / 2, rel=0.1)
    assert half.xyz[:, 1].min() > 0


def test_ground_has_its_class() -> None:
    cloud = sample(post(), options=SampleOptions(ground_radius_m=2, noise_m=0))
    ground = cloud.xyz[cloud.attributes["classification"] == 2]
    assert len(ground) == pytest.approx(100 * np.pi * 4, rel=0.1)
    assert (ground[:, 2] == 0).all()
    assert np.linalg.norm(ground[:, :2], axis=1).max() <= 2
    assert (sample(post()).attributes["classification"] == 1).all()


def test_a_seed_gives_one_cloud(tree: TreeModel) -> None:
    one, two, other = (sample(tree, options=SampleOptions(seed=seed)) for seed in (1, 1, 2))
    assert one.xyz.tobytes() == two.xyz.tobytes()
    assert one.xyz.tobytes() != other.xyz.tobytes()
