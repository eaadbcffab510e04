"""What must not matter does not: row order, north, place, mirror, thinning, noise, strays, gaps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import pipeline
from pipeline.config import Config
from pipeline.model import PointCloud
from pipeline.run import reconstruct
from pipeline.synthetic import SampleOptions, TubeTreeOptions, grow_tubes, sample
from tests.scorer import true_diameter

TREES = {5: 5.0, 7: 6.0}
"""Height in metres by seed."""
DENSITY_PER_M2 = 4000.0


def grown(seed, height, **other):
    return grow_tubes(
        TubeTreeOptions(
            **{"seed": seed, "height_m": height, "trunk_radius_m": 0.014 * height, "max_order": 2} | other
        )
    )


def scan(tree, **other):
    """Points on a tree, without their classes."""
    options = {"seed": 1, "density_per_m2": DENSITY_PER_M2, "noise_m": 0.002} | other
    return np.array(sample(tree, options=SampleOptions(**options)).xyz)


class Case:
    """A known tree, its points, and what is made of them."""

    def __init__(self, seed: int) -> None:
        self.truth = grown(seed, TREES[seed])
        self.xyz = scan(self.truth)
        self.base = reconstruct(PointCloud(self.xyz))

    @property
    def foot(self):
        """The lowest point."""
        return self.xyz[np.argmin(self.xyz[:, 2])]

    def stem_at(self, z):
        """(K, 2) the true axis of the stem at these heights."""
        return stem_at(self.truth, z)


def stem_at(tree, z):
    axis = tree.skeleton.xyz[tree.skeleton.paths[0]]
    return np.column_stack([np.interp(z, axis[:, 2], axis[:, k]) for k in (0, 1)])


def stem_radius(tree, z):
    path = tree.skeleton.paths[0]
    return np.interp(z, tree.skeleton.xyz[path, 2], tree.radius[path])


@pytest.fixture(scope="module", params=TREES)
def case(request):
    return Case(request.param)


def off(tree, base):
    """Relative differences of diameter, volume and length."""
    return {
        "dbh": tree.trunk.dbh_m / base.trunk.dbh_m - 1,
        "volume": tree.volume.sum() / base.volume.sum() - 1,
        "length": tree.skeleton.length.sum() / base.skeleton.length.sum() - 1,
    }


def assert_close(tree, base, **within):
    found = off(tree, base)
    assert {name: found[name] for name in within} == {
        name: pytest.approx(0.0, abs=most) for name, most in within.items()
    }


def turned(xyz, degrees, about):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    flat = (xyz[:, :2] - about[:2]) @ np.array([[c, s], [-s, c]]) + about[:2]
    return np.column_stack([flat, xyz[:, 2]])


def test_the_base_is_the_truth(case):
    """Else nothing below would mean anything."""
    assert case.base.trunk.dbh_m == pytest.approx(dbh_of(case.truth), rel=0.01)
    assert case.base.volume.sum() == pytest.approx(case.truth.volume.sum(), rel=0.03)
    assert case.base.skeleton.length.sum() == pytest.approx(case.truth.skeleton.length.sum(), rel=0.03)


def dbh_of(tree):
    graph = tree.skeleton
    arrays = {"s": graph.xyz[graph.parent[1:]], "e": graph.xyz[1:], "order": graph.order[1:]}
    return true_diameter(arrays | {"r": (tree.start_radius[1:] + tree.radius[1:]) / 2})


def test_row_order_changes_not_a_bit(case):
    other = reconstruct(PointCloud(np.random.default_rng(0).permutation(case.xyz)))
    for name in ("xyz", "parent"):
        np.testing.assert_array_equal(getattr(other.skeleton, name), getattr(case.base.skeleton, name))
    for name in ("radius", "radius_source", "radius_rmse"):
        np.testing.assert_array_equal(getattr(other, name), getattr(case.base, name))
    assert other.trunk == case.base.trunk
    assert other.metadata["volume_interval_l"] == case.base.metadata["volume_interval_l"]


@pytest.mark.parametrize("degrees", [37.3, 90.0])
def test_north_makes_no_difference(case, degrees):
    tree = reconstruct(PointCloud(turned(case.xyz, degrees, case.xyz[1000])))
    assert_close(tree, case.base, dbh=0.001, volume=0.001, length=0.001)


def test_places_far_from_zero_make_no_difference(case):
    """Not even where the coordinates themselves are large, and not only their origin."""
    tree = reconstruct(PointCloud(case.xyz + [1e5, -1e5, 0.0]))
    assert_close(tree, case.base, dbh=0.01, volume=0.01)
    z = np.linspace(0.3, 0.6 * TREES[5], 30)
    np.testing.assert_allclose(stem_radius(tree, z), stem_radius(case.base, z), rtol=0.01)


def test_a_mirror_image_is_the_same_tree(case):
    tree = reconstruct(PointCloud(case.xyz * [-1.0, 1.0, 1.0]))
    assert_close(tree, case.base, dbh=0.03, volume=0.03)


def ten_times(stage: dict[str, Any]) -> dict[str, Any]:
    """Scale the options of a stage with the cloud."""
    unit = {name: 100 if name.endswith("_m2") else 10 if name.endswith("_m") else 1 for name in stage}
    return {name: unit[name] * value if unit[name] > 1 else value for name, value in stage.items()}


def test_a_cloud_ten_times_as_large_is_a_tree_ten_times_as_large(case):
    """With the method given: which one is chosen hangs on the spacing of points in metres.

    The noise is 10 mm after scaling, for no noise counts as more than 20 mm.
    """
    xyz = scan(case.truth, noise_m=0.001)
    plain = Config().with_settings(["skeleton.method=geodesic"]).model_dump()
    plain |= {stage: ten_times(plain[stage]) for stage in ("clean", "skeleton", "cylinders")}
    base, tree = reconstruct(PointCloud(xyz)), reconstruct(PointCloud(10 * xyz), Config.model_validate(plain))
    assert tree.volume.sum() / 1000 == pytest.approx(base.volume.sum(), rel=0.05)
    assert tree.skeleton.length.sum() / 10 == pytest.approx(base.skeleton.length.sum(), rel=0.05)
    z = np.linspace(0.3, 1.4, 20)  # breast height stays where it is, so that diameter is another
    np.testing.assert_allclose(stem_radius(tree, 10 * z) / 10, stem_radius(base, z), rtol=0.05)


@pytest.mark.parametrize("share", [0.5, 0.25])
def test_thinner_scans_tell_the_same(case, share):
    some = np.random.default_rng(1).random(len(case.xyz)) < share
    tree = reconstruct(PointCloud(case.xyz[some]))
    assert_close(tree, case.base, dbh=0.03, volume=0.10)


def test_one_point_a_metre_below_the_root(case):
    tree = reconstruct(PointCloud(np.vstack([case.xyz, case.foot - [0.0, 0.0, 1.0]])))
    assert_close(tree, case.base, dbh=0.05, volume=0.05)
    assert tree.metadata["ground_z"] == pytest.approx(case.base.metadata["ground_z"], abs=0.02)


@pytest.mark.parametrize("classified", [False, True])
def test_a_patch_of_ground(case, classified):
    """Three metres square, found by its shape or by its class."""
    options = SampleOptions(
        seed=1,
        density_per_m2=DENSITY_PER_M2,
        noise_m=0.002,
        ground_radius_m=2.2,
        ground_density_per_m2=300.0,
    )
    cloud = sample(case.truth, options=options)
    within = np.abs(cloud.xyz[:, :2]).max(axis=1) < 1.5
    soil = cloud.attributes["classification"] == 2
    cloud = cloud.take(within | ~soil)
    assert (soil & within).sum() > 2000
    tree = reconstruct(cloud if classified else PointCloud(cloud.xyz))
    assert_close(tree, case.base, dbh=0.05, volume=0.05)
    assert tree.metadata["ground_source"] == ("class" if classified else "found")
    assert tree.metadata["ground_z"] == pytest.approx(0.0, abs=0.01 if classified else 0.03)


@pytest.mark.parametrize("noise_m", [0.010, 0.015])
def test_noise_does_not_move_the_diameter(case, noise_m):
    tree = reconstruct(PointCloud(scan(case.truth, noise_m=noise_m)))
    assert_close(tree, case.base, dbh=0.05)
    assert 1.1 > tree.metadata["noise_mm"] / (1000 * noise_m) > 0.8


def test_noise_of_20_mm_does_not_move_the_diameter_of_a_stem_of_20_cm():
    truth = grown(7, 6.0, trunk_radius_m=0.11)
    tree = reconstruct(PointCloud(scan(truth, noise_m=0.020)))
    assert tree.trunk.dbh_m == pytest.approx(dbh_of(truth), rel=0.05)
    assert tree.volume.sum() == pytest.approx(truth.volume.sum(), rel=0.15)


def test_two_stems_half_a_metre_apart_are_told():
    """As long as their crowns do not grow into each other."""
    both = [grown(seed, 6.0, crown_base=0.5, crown_width=0.03) for seed in (5, 7)]
    xyz = np.vstack([scan(both[0]), scan(both[1]) + [0.5, 0.0, 0.0]])
    assert "several_stems" in reconstruct(PointCloud(xyz)).metadata["flags"]
    assert "several_stems" not in reconstruct(PointCloud(scan(both[0]))).metadata["flags"]


@pytest.mark.parametrize(("fork", "told"), [(0.15, True), (0.2, True), (0.45, False)])
def test_a_stem_that_forks_below_breast_height_is_told(fork, told):
    tree = grown(7, 6.0, fork=fork, max_order=1, crown_base=0.4)
    flags = reconstruct(PointCloud(scan(tree))).metadata["flags"]
    assert ("several_stems" in flags) == told


def test_a_gap_in_the_stem_is_bridged(case):
    z = case.xyz[:, 2]
    away = np.linalg.norm(case.xyz[:, :2] - case.stem_at(z), axis=1)
    cut = (np.abs(z - 2.5) < 0.125) & (away < 0.15)
    assert cut.sum() > 200
    tree = reconstruct(PointCloud(case.xyz[~cut]))
    assert_close(tree, case.base, dbh=0.03, volume=0.03)
    assert np.ptp(tree.skeleton.xyz[:, 2]) == pytest.approx(np.ptp(case.base.skeleton.xyz[:, 2]), abs=0.03)
    gap = np.linspace(2.375, 2.625, 26)
    assert np.linalg.norm(stem_at(tree, gap) - case.stem_at(gap), axis=1).max() < 0.03
    np.testing.assert_allclose(stem_radius(tree, gap), stem_radius(case.truth, gap), rtol=0.1)


def jittered(cloud, rng):
    """The cloud, turned about its middle by any angle, with an error of 1 mm."""
    points = turned(cloud.xyz, rng.uniform(0, 360), cloud.xyz.mean(axis=0))
    points = points + rng.normal(0, 0.001, points.shape)
    return PointCloud(points, cloud.origin, cloud.crs, dict(cloud.attributes))


@pytest.mark.parametrize(("name", "within"), [("tree1.xyz", 0.15), ("archi_tree1.las", 0.06)])
def test_a_real_tree_turned_and_jittered(shared_data, name, within):
    """In the frame of the map, where north matters: the figures differ, but no more than they say."""
    cloud = pipeline.read_cloud(shared_data / "trees" / name)
    rng, config = np.random.default_rng(7), Config().with_settings(["clean.canonical_azimuth=false"])
    trees = [reconstruct(jittered(cloud, rng), config) for _ in range(3)]
    volume = np.array([1000 * tree.volume.sum() for tree in trees])
    length = np.array([tree.skeleton.length.sum() for tree in trees])
    stout = np.array([stout_branches(tree) for tree in trees])
    assert np.ptp(volume) > 0  # the runs do differ
    np.testing.assert_allclose(volume, np.median(volume), rtol=within)
    np.testing.assert_allclose(length, np.median(length), rtol=0.04)
    np.testing.assert_allclose(stout, np.median(stout), rtol=0.20)
    low, high = np.array([tree.metadata["volume_interval_l"] for tree in trees]).T
    assert low.max() <= volume.min()
    assert volume.max() <= high.min()


def stout_branches(tree):
    """Branches that are a centimetre thick or more at their start."""
    return sum(2 * tree.radius[path[1]] >= 0.01 for path in tree.skeleton.paths)
