"""Known tree, points, reconstruction, comparison: the figures that the method must reach."""

from dataclasses import replace

import numpy as np
import pytest

import pipeline
from pipeline.config import Config
from pipeline.model import PointCloud
from tests.scorer import score

SAMPLES = {"maple": 0.04, "lime": 0.10, "oak": 0.06}  # volume within


@pytest.fixture(scope="module", params=SAMPLES)
def sample(request, samples):
    cloud = pipeline.read_cloud(samples / f"{request.param}.laz")
    return request.param, cloud, np.load(samples / f"{request.param}.truth.npz")


def test_the_samples_that_ship_with_the_project(sample):
    name, cloud, truth = sample
    result = score(pipeline.reconstruct(cloud), truth)
    assert result["recall"] > 0.94
    assert result["precision"] > 0.95
    assert abs(result["dbh"]) < 0.02
    assert abs(result["volume"]) < SAMPLES[name]


@pytest.mark.parametrize("method", ["mst", "geodesic"])
def test_a_terrestrial_scan_of_a_known_tree(shared_data, method):
    cloud = pipeline.read_cloud(shared_data / "truth" / "syn_A_clean.laz")
    truth = np.load(shared_data / "truth" / "syn_A.truth.npz")
    tree = pipeline.reconstruct(cloud, Config().with_settings([f"skeleton.method={method}"]))
    result = score(tree, truth)
    assert result["recall"] >= (0.97 if method == "mst" else 0.985)
    assert result["precision"] >= (0.95 if method == "mst" else 0.99)
    assert result["order"] >= (0.6 if method == "mst" else 0.87)
    assert abs(result["dbh"]) < 0.01
    assert abs(result["volume"]) < 0.03


def test_row_order_does_not_change_a_bit(samples):
    cloud = pipeline.read_cloud(samples / "maple.laz")
    other = cloud.take(np.random.default_rng(0).permutation(len(cloud)))
    a, b = pipeline.reconstruct(cloud), pipeline.reconstruct(other)
    np.testing.assert_array_equal(a.skeleton.xyz, b.skeleton.xyz)
    np.testing.assert_array_equal(a.skeleton.parent, b.skeleton.parent)
    np.testing.assert_array_equal(a.radius, b.radius)
    assert a.trunk == b.trunk


def test_national_coordinates_do_not_matter(samples):
    cloud = pipeline.read_cloud(samples / "maple.laz")
    moved = replace(cloud, origin=cloud.origin + [100_000.0, 400_000.0, 0.0])
    a, b = pipeline.reconstruct(cloud), pipeline.reconstruct(moved)
    assert b.trunk.dbh_m == pytest.approx(a.trunk.dbh_m, rel=0.01)
    assert b.volume.sum() == pytest.approx(a.volume.sum(), rel=0.01)


def test_a_low_outlier_and_a_patch_of_ground_do_not_move_the_stem(samples):
    cloud = pipeline.read_cloud(samples / "maple.laz")
    clean = pipeline.reconstruct(cloud)
    rng = np.random.default_rng(1)
    foot = cloud.xyz[np.argmin(cloud.xyz[:, 2])]
    low = foot + [0.4, 0.3, -0.3]
    patch = foot + np.column_stack([rng.uniform(-1.5, 1.5, (3000, 2)), rng.normal(0, 0.01, 3000)])
    for extra in (low[None], patch):
        tree = pipeline.reconstruct(PointCloud(np.vstack([cloud.xyz, extra]), cloud.origin, cloud.crs))
        assert tree.trunk.dbh_m == pytest.approx(clean.trunk.dbh_m, rel=0.05)
        assert tree.volume.sum() == pytest.approx(clean.volume.sum(), rel=0.05)


@pytest.mark.parametrize("share", [0.5, 0.25])
def test_thinner_scans_tell_the_same(samples, share):
    cloud = pipeline.read_cloud(samples / "oak.laz")
    whole = pipeline.reconstruct(cloud)
    some = np.random.default_rng(2).random(len(cloud)) < share
    tree = pipeline.reconstruct(cloud.take(some))
    assert tree.trunk.dbh_m == pytest.approx(whole.trunk.dbh_m, rel=0.03)
    assert tree.volume.sum() == pytest.approx(whole.volume.sum(), rel=0.10)
