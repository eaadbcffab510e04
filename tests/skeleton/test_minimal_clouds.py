"""The minimal-length method on whole clouds: leaves, trunk, flags, figures and options."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.cloud import clean, read_cloud
from pipeline.config import Config
from pipeline.errors import NotATreeError, UsageError
from pipeline.model import PointCloud
from pipeline.skeleton import SkeletonOptions, extract
from pipeline.skeleton.minimal_length import MinimalOptions, _leaves, by_minimal_length
from tests.skeleton.minimal.problems import crown

QUICK = MinimalOptions(search_rounds=2, most_leaves=60)


@pytest.fixture(scope="module")
def leafy():
    """A crown of leaves over no bark at all."""
    problem = crown(300, 6)
    points = np.vstack([problem.leaves, [[0, 0, 11.2], [0, 0, 0.0]]])
    return clean(PointCloud(np.round(points, 4)))


def test_a_crown_without_bark_hangs_on_a_straight_trunk(leafy):
    skeleton = by_minimal_length(leafy, QUICK)
    known = skeleton.metadata["minimal_length"]
    assert "no_trunk" in skeleton.metadata["flags"]
    assert known["leaves"] <= 60
    assert known["length_over_bound"] == pytest.approx(1.0)
    assert known["proven"]
    stem = skeleton.xyz[skeleton.paths[0]]
    off = np.cross(stem - stem[0], stem[-1] - stem[0]) / np.linalg.norm(stem[-1] - stem[0])
    assert np.abs(off).max() < 0.01


def test_flags_say_what_was_relaxed(leafy):
    few = by_minimal_length(leafy, MinimalOptions(search_rounds=0, most_leaves=60, insertion_deg=(10.0,)))
    known = few.metadata["minimal_length"]
    assert known["relaxed"] > 0
    assert "relaxed_angles" in few.metadata["flags"]
    assert ("unreached_leaves" in few.metadata["flags"]) is (known["led_to_nearest"] > 0)


def test_leaves_are_real_points_one_a_cell(leafy):
    leaves, side = _leaves(leafy.xyz, QUICK)
    assert len(leaves) <= 60
    assert side > QUICK.leaf_cell_m
    assert {tuple(p) for p in leaves.tolist()} <= {tuple(p) for p in leafy.xyz.tolist()}


def test_angles_follow_the_order(leafy):
    options = MinimalOptions(insertion_deg=(60.0, 30.0), search_rounds=2, most_leaves=60, least_branch=0.0)
    skeleton = by_minimal_length(leafy, options)
    known = skeleton.metadata["minimal_length"]
    first = [path for path, up in zip(skeleton.paths, skeleton.branch_parent, strict=True) if up == 0]
    stem = skeleton.xyz[skeleton.paths[0]]
    up = (stem[-1] - stem[0]) / np.linalg.norm(stem[-1] - stem[0])
    ways = np.array([skeleton.xyz[path[-1]] - skeleton.xyz[path[0]] for path in first])
    angle = np.degrees(np.arccos(ways @ up / np.linalg.norm(ways, axis=1)))
    assert np.sum(np.abs(angle - 60.0) > 0.1) <= known["relaxed"]
    assert len(angle) > known["relaxed"]


@pytest.mark.parametrize("setting", ["insertion_deg=[42.5, 3.0]", "insertion_deg=[]", "most_leaves=0"])
def test_what_is_out_of_range_is_named(setting):
    with pytest.raises(UsageError, match=setting.split("=", maxsplit=1)[0]):
        Config().with_settings([f"skeleton.{setting}"])


def test_points_without_height_are_no_tree():
    with pytest.raises(NotATreeError, match="metres"):
        by_minimal_length(PointCloud(np.zeros((5, 3))), QUICK)


@pytest.mark.parametrize("work", [extract, by_minimal_length])
def test_no_points_are_no_tree(work):
    with pytest.raises(NotATreeError, match=r"points.*takes two"):
        work(PointCloud(np.zeros((0, 3))), options=SkeletonOptions(method="minimal-length"))


def test_points_below_the_stem_are_named_with_their_heights():
    xyz = np.array([[0.0, 0, -2.0], [0, 1, 1.5], [1, 0, 0]])
    with pytest.raises(
        NotATreeError, match=r"from -2\.00 to 1\.50 m, lie below the stem's foot.* at 4\.00 m"
    ):
        by_minimal_length(PointCloud(xyz, metadata={"ground_z": 4.0}), QUICK)


def test_an_angle_out_of_range_is_told_its_range():
    with pytest.raises(UsageError, match=r"95 degrees is not allowed; give angles from 5 to 90"):
        Config().with_settings(["skeleton.insertion_deg=[42.5, 95]"])


@pytest.mark.parametrize("count", [2, 3, 10])
def test_few_points_give_a_tree(count):
    xyz = np.round(np.random.default_rng(count).normal(0, 1, (count, 3)), 4)
    skeleton = by_minimal_length(PointCloud(xyz), MinimalOptions())
    assert len(skeleton) >= 2


def test_the_simulated_airborne_tree(shared_data: Path):
    cloud = clean(read_cloud(shared_data / "truth" / "syn_A_als.laz"))
    options = Config().with_settings(["skeleton.method=minimal-length", "skeleton.exact_bunches=20"]).skeleton
    skeleton = extract(cloud, options=options)
    truth = np.load(shared_data / "truth" / "syn_A.truth.npz")
    middle = (truth["s"] + truth["e"]) / 2
    a, b = skeleton.world[skeleton.parent[1:]], skeleton.world[1:]
    share = np.linspace(0, 1, 50)[:, None, None]
    from scipy.spatial import cKDTree

    gap = cKDTree((a + share * (b - a)).reshape(-1, 3)).query(middle)[0]
    weight = np.linalg.norm(truth["e"] - truth["s"], axis=1)
    order = np.argsort(gap)
    half = np.searchsorted(np.cumsum(weight[order]), 0.5 * weight.sum())
    assert gap[order][half] < 0.16
    assert skeleton.metadata["method"] == "minimal-length"
