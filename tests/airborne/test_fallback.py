"""Trees without a trunk, and how it is told that a tree has none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.airborne import modelling
from pipeline.airborne.allometry import breast_height_diameter
from pipeline.airborne.fallback import FallbackOptions, fallback, stem_line
from pipeline.airborne.modelling import ModelOptions, model_tree
from pipeline.cityjson import check, to_cityjson
from pipeline.cloud import read_cloud
from pipeline.lsystem import encode, max_error
from pipeline.model import ALLOMETRIC, PointCloud
from pipeline.report import report
from tests.airborne.trees import crown, level, outlined, stages


def radius_at(tree, height_m):
    stem = tree.skeleton.paths[0]
    z = tree.skeleton.xyz[stem, 2] - tree.metadata["ground_z"]
    return np.interp(height_m, z, tree.radius[stem])


def turned(cloud, tree, shift):
    """Return the same tree from another origin."""
    moved = PointCloud(cloud.xyz - shift, cloud.origin + shift, cloud.crs)
    return moved, replace(
        tree,
        apex=tree.apex - shift,
        ground_z=tree.ground_z - shift[2],
        base=tree.base - shift[:2],
        crown=tree.crown - shift[:2],
    )


def test_the_stem_is_straight_from_the_ground_to_the_apex():
    cloud = crown()
    tree = replace(outlined(cloud), base=np.array([20.5, 29.5]))
    made = fallback(cloud, tree)
    stem = made.skeleton.xyz[made.skeleton.paths[0]]
    assert stem[0] == pytest.approx([20.5, 29.5, 0.0])
    assert stem[-1, 2] >= 15.0
    share = (stem[:, 2] / 15.0)[:, None]
    straight = (1 - share) * [20.5, 29.5, 0.0] + share * [20.0, 30.0, 15.0]
    assert np.abs(stem - straight).max() < 1e-3


def test_the_diameter_is_that_of_the_allometry():
    cloud = crown()
    tree = outlined(cloud)
    options = FallbackOptions(biome="temperate-conifer", leaf_type="gymnosperm")
    made = fallback(cloud, tree, options=options)
    wanted = breast_height_diameter(15.0, tree.crown_diameter_m, options=options)
    assert (made.trunk.dbh_m, made.trunk.lo_m, made.trunk.hi_m) == wanted
    assert made.trunk.source == "allometric"
    assert 2 * radius_at(made, 1.3) == pytest.approx(wanted.dbh_m, rel=0.01)
    assert (made.radius_source == ALLOMETRIC).all()


def test_cross_sections_follow_the_wood_beyond():
    made = fallback(crown(), outlined(crown()))
    graph = made.skeleton
    carried = graph.subtree_length + np.where(graph.branch_start, 0.5 * graph.length, 0.0) + 0.05
    ratio = made.radius**2 / carried
    stout = made.radius > 0.0031
    assert np.percentile(ratio[stout], 90) < 1.5 * np.percentile(ratio[stout], 10)
    assert (made.radius[1:] <= made.radius[graph.parent[1:]] + 1e-12).all()


def test_the_crown_is_made_of_the_points():
    cloud = crown(600)
    made = fallback(cloud, outlined(cloud), options=FallbackOptions(crown_spacing_m=0.25))
    gap = np.linalg.norm(cloud.xyz[:, None] - made.skeleton.xyz[None], axis=2).min(axis=1)
    assert np.quantile(gap, 0.9) < 0.6
    coarse = fallback(cloud, outlined(cloud), options=FallbackOptions(crown_spacing_m=1.0))
    assert len(coarse) < 0.5 * len(made)


def test_it_says_that_it_is_a_guess():
    made = fallback(crown(), outlined(crown()), reasons=("few_points",))
    told = report(made)
    assert {"fallback", "few_points"} <= set(told.flags)
    assert told.dbh_source == "allometric"
    assert told.volume_lo_l < told.volume_l < told.volume_hi_l
    assert told.height_m == pytest.approx(15.0)
    assert told.radius_share["allometric"] == pytest.approx(1.0)


def test_it_can_be_written():
    made = fallback(crown(), outlined(crown()))
    assert max_error(made, encode(made)) <= 0.0006
    assert check(to_cityjson(made, name="tree")) == []


@given(st.integers(0, 40), st.integers(0, 5), st.sampled_from([0.0, 14.9, 20.0, np.nan]))
def test_any_points_make_a_tree(count, seed, ground):
    """None, one, few, below the ground, without ground: there is a model of some height, with a flag."""
    cloud = crown(40, seed=seed)
    tree = replace(outlined(cloud), points=np.arange(count), ground_z=ground)
    made = model_tree(cloud, tree, None, stages=stages()).tree
    assert {"fallback"} <= set(made.metadata["flags"])
    assert len(made) >= 2
    assert report(made).height_m > 0
    assert np.isfinite(made.radius).all()


def test_points_of_one_place_make_a_stem():
    cloud = PointCloud(np.tile([[5.0, 6.0, 12.0]], (50, 1)))
    tree = replace(outlined(crown()), points=np.arange(50), apex=np.array([5.0, 6.0, 12.0]))
    made = model_tree(cloud, replace(tree, base=np.array([5.0, 6.0])), None, stages=stages()).tree
    assert made.metadata["method"] == "straight_stem"
    assert {"fallback", "few_points"} <= set(made.metadata["flags"])


def test_a_tree_lower_than_breast_height_has_no_diameter_there():
    cloud = crown(60, height=1.2, width=0.8)
    assert fallback(cloud, outlined(cloud)).trunk.dbh_m is None


@given(st.permutations(range(60)))
def test_the_order_of_the_points_does_not_matter(order):
    cloud = crown(60)
    tree = outlined(cloud)
    one = model_tree(cloud, tree, None, stages=stages()).tree
    other = model_tree(cloud, replace(tree, points=np.array(order)), None, stages=stages()).tree
    assert one.skeleton.xyz.tobytes() == other.skeleton.xyz.tobytes()
    assert one.radius.tobytes() == other.radius.tobytes()


@given(st.tuples(*[st.integers(-500, 500)] * 3))
def test_the_origin_of_the_cell_does_not_matter(shift):
    cloud = crown(80)
    tree = outlined(cloud)
    moved, same = turned(cloud, tree, np.array(shift, dtype=np.float64))
    one = model_tree(cloud, tree, None, stages=stages()).tree
    other = model_tree(moved, same, None, stages=stages()).tree
    assert encode(one) == encode(other)


def test_an_error_becomes_a_flag(monkeypatch):
    def broken(*_inputs, **_options):
        msg = "did not converge"
        raise RuntimeError(msg)

    monkeypatch.setattr(modelling, "find_trunk", broken)
    made = model_tree(crown(), outlined(crown()), None, stages=stages())
    assert made.error == "did not converge"
    assert {"failed", "fallback"} <= set(made.tree.metadata["flags"])
    monkeypatch.setattr("pipeline.airborne.fallback.extract", broken)
    again = model_tree(crown(), outlined(crown()), None, stages=stages())
    assert again.tree.metadata["method"] == "straight_stem"


def test_points_are_bounded():
    cloud = crown(4000)
    few = stages()._replace(model=ModelOptions(most_points=500))
    made = model_tree(cloud, outlined(cloud), None, stages=few).tree
    assert 50 < len(made) < 1500


def test_the_amsterdam_tree_shows_its_trunk(shared_data):
    """57.1 cm by two mobile scanners, 14.7 to 15.3 m high."""
    cloud = read_cloud(shared_data / "trees" / "ahn4_121913_487434.las")
    ground = read_cloud(shared_data / "trees" / "ahn4_121913_487434.ground.laz")
    ground_z = float(np.median(ground.world[:, 2]) - cloud.origin[2])
    made = model_tree(cloud, outlined(cloud, ground_z), level(cloud, ground_z), stages=stages())
    told = report(made.tree)
    assert "fallback" not in told.flags
    assert told.dbh_lo_cm < 57.1 < told.dbh_hi_cm
    assert told.dbh_source == "propagated"
    assert made.bark_points == 0
    assert 14.2 <= told.height_m <= 15.3


def test_a_trunk_seen_all_round_is_measured(shared_data):
    cloud = read_cloud(shared_data / "truth" / "syn_B_als.laz")
    ground_z = float(cloud.xyz[:, 2].min())
    made = model_tree(cloud, outlined(cloud, ground_z), level(cloud, ground_z), stages=stages())
    assert made.tree.trunk.source == "measured"
    assert made.tree.trunk.lo_m < 0.5484 < made.tree.trunk.hi_m
    assert made.bark_points >= 12


@pytest.mark.parametrize("seed", [0, 8])
def test_three_circles_are_chance(seed):
    """A simulated flight at 40 pulses on a square metre sees too little of a thin stem to measure it."""
    pytest.importorskip("open3d")
    from pipeline.synthetic import AlsOptions, TubeTreeOptions, grow_tubes, scan

    truth = grow_tubes(TubeTreeOptions(seed=seed))
    made = scan(truth, options=AlsOptions(density_per_m2=40, seed=seed))
    on_tree = np.asarray(made.returns.surface) <= 1
    cloud = PointCloud(made.cloud.xyz[on_tree], made.cloud.origin)
    modelled = model_tree(cloud, outlined(cloud), level(cloud), stages=stages())
    assert modelled.tree.trunk.source == "allometric"
    lowest = stem_line(outlined(cloud))[0]
    assert modelled.tree.skeleton.xyz[0, 2] + modelled.tree.skeleton.origin[2] == pytest.approx(
        lowest[2] + cloud.origin[2]
    )


def test_trunk_points_below_the_crown_are_found_again(shared_data):
    """A segmentation that starts at 2 m leaves the foot of the trunk to no tree."""
    cloud = read_cloud(shared_data / "trees" / "ahn4_121913_487434.las")
    ground = read_cloud(shared_data / "trees" / "ahn4_121913_487434.ground.laz")
    ground_z = float(np.median(ground.world[:, 2]) - cloud.origin[2])
    whole, terrain = outlined(cloud, ground_z), level(cloud, ground_z)
    high = cloud.xyz[:, 2] > ground_z + 2.5
    middle = np.median(cloud.xyz[high, :2], axis=0)
    crown_alone = replace(whole, points=np.flatnonzero(high), base=middle)
    found = modelling.near_stems(cloud, [crown_alone], terrain)[0]
    assert 0 < len(found) < len(cloud) - len(crown_alone.points)
    without = model_tree(cloud, crown_alone, terrain, stages=stages()).tree
    told = report(model_tree(cloud, crown_alone, terrain, stages=stages(), beside=found).tree)
    assert "fallback" in without.metadata["flags"]
    assert "fallback" not in told.flags
    assert told.dbh_lo_cm < 57.1 < told.dbh_hi_cm
