"""The report against a tree computed by hand."""

from __future__ import annotations

import dataclasses
import json
import math

import numpy as np
import pytest

import pipeline
from pipeline.model import Skeleton, TreeModel, Trunk
from pipeline.report import crown_base, report

KEYS = """
name source status crs crs_assumed method method_reason points_in points_used dropped leaf_share
noise_mm ground_z nodes edges branches max_order height_m crown_diameter_m crown_base_m dbh_cm
dbh_lo_cm dbh_hi_cm dbh_arc_deg dbh_source volume_l volume_lo_l volume_hi_l stem_volume_l
branch_volume_l length_m length_lo_m length_hi_m radius_share surface_mm lsystem flags seconds
peak_rss_mb version config_hash
"""


def small_tree(**metadata):
    """Build a stem of 3 m (radius 0.1), a shoot of 0.05 m at 1 m, a branch of 1 m (radius 0.05) at 2 m."""
    xyz = np.array([[0, 0, 0], [0, 0, 1], [0, 0, 2], [0, 0, 3], [1, 0, 2], [0.05, 0, 1]], dtype=float)
    skeleton = Skeleton(xyz, np.array([-1, 0, 1, 2, 2, 1]), np.array([1e5, 4e5, 10.0]), "EPSG:28992")
    radius = np.array([0.1, 0.1, 0.1, 0.1, 0.05, 0.01])
    source = np.array([0, 0, 0, 1, 2, 2], dtype=np.uint8)
    trunk = Trunk(0.2, 0.19, float("nan"), 270.0, "measured", 0.0)
    return TreeModel(skeleton, radius, source, np.full(6, np.nan), trunk, metadata)


def test_keys_are_those_of_the_contract_in_order():
    assert list(json.loads(report(small_tree()).to_json())) == KEYS.split()


def test_figures_by_hand():
    told = report(small_tree(ground_z=-0.5, top_z=3.25, crown_area_m2=math.pi, flags=("no_ground",)))
    assert told.height_m == pytest.approx(3.75)
    assert told.ground_z == pytest.approx(9.5)
    assert told.crown_diameter_m == pytest.approx(2.0)
    assert told.crown_base_m == pytest.approx(2.5)
    assert told.stem_volume_l == pytest.approx(1000 * math.pi * 0.03)
    assert told.branch_volume_l == pytest.approx(1000 * math.pi * (0.0025 + 0.000005))
    assert told.volume_l == pytest.approx(told.stem_volume_l + told.branch_volume_l)
    assert told.length_m == pytest.approx(4.05)
    assert told.radius_share == pytest.approx(
        {"measured": 2 / 4.05, "propagated": 1 / 4.05, "allometric": 1.05 / 4.05}
    )
    assert (told.dbh_cm, told.dbh_lo_cm, told.dbh_source) == (
        pytest.approx(20),
        pytest.approx(19),
        "measured",
    )
    assert (told.branches, told.max_order, told.edges, told.flags) == (3, 1, 5, ["no_ground"])


def test_what_is_unknown_is_null_never_nan():
    plain = report(small_tree(noise_mm=float("inf"))).to_dict()
    assert plain["dbh_hi_cm"] is None
    assert plain["noise_mm"] is None
    for key in ("method", "points_in", "volume_lo_l", "crown_diameter_m", "config_hash", "name"):
        assert plain[key] is None
    assert set(plain["dropped"].values()) == set(plain["seconds"].values()) == {None}
    assert plain["lsystem"] == {"bytes": None, "max_error_mm": None}


def test_numpy_numbers_become_json():
    metadata = {"points_in": np.int64(5), "surface_mm": {"mean": np.float64(1.5), "median": np.float32(1)}}
    plain = json.loads(report(small_tree(**metadata)).to_json())
    assert plain["points_in"] == 5
    assert plain["surface_mm"] == {"mean": 1.5, "median": 1.0, "p95": None}


def test_intervals_seconds_and_leaves():
    tree = small_tree(
        volume_interval_l=(90.0, 110.0), length_interval_m=(3.0, 5.0), dropped={"leaf": 25}, points_in=100
    )
    told = report(tree, seconds={"read": 1.0, "fit": 2.0})
    assert (told.volume_lo_l, told.volume_hi_l, told.length_lo_m, told.length_hi_m) == (90, 110, 3, 5)
    assert told.leaf_share == 0.25
    assert told.seconds == {"read": 1, "clean": None, "skeleton": None, "fit": 2, "write": None, "total": 3}


def test_a_bare_pole_has_no_crown():
    skeleton = Skeleton(np.array([[0, 0, 0], [0, 0, 1.0]]), np.array([-1, 0]))
    pole = TreeModel(skeleton, np.full(2, 0.1), np.zeros(2, dtype=np.uint8), np.full(2, np.nan))
    assert crown_base(pole) is None
    told = report(pole)
    assert told.dbh_cm is told.dbh_source is None
    assert "DBH unknown" in told.headline


def test_one_node_is_reported():
    skeleton = Skeleton(np.zeros((1, 3)), np.array([-1]))
    alone = TreeModel(skeleton, np.ones(1), np.zeros(1, dtype=np.uint8), np.ones(1))
    assert json.loads(report(alone).to_json())["radius_share"]["measured"] is None


def test_headline_has_the_interval():
    trunk = dataclasses.replace(small_tree().trunk, hi_m=0.21)
    tree = small_tree(top_z=3.0, ground_z=0.0)
    tree = TreeModel(tree.skeleton, tree.radius, tree.radius_source, tree.radius_rmse, trunk, tree.metadata)
    assert report(tree, name="oak").headline.startswith("oak\nheight 3.0 m,  DBH 20.0 cm (19.0 to 21.0),")


def test_the_module_answers_to_the_functions_name():
    assert pipeline.report(small_tree()).nodes == 6
