"""A model beside another: distances, branches, amounts, and what cannot be compared."""

from __future__ import annotations

import json

import numpy as np
import pytest

from pipeline.accuracy import NotComparableError, compare
from pipeline.model import Skeleton, TreeModel
from tests.accuracy.conftest import changed, pole

FORK = {"parent": [-1, 0, 1, 1, 3]}
NODES = [[0, 0, 0], [0, 0, 2], [0, 0, 4], [1, 0, 2], [2, 0, 2]]
SPREAD = {"min_mm", "max_mm", "mean_mm", "median_mm", "stdev_mm", "p95_mm", "matched"}


def test_a_tree_is_itself(tree):
    found = compare(tree, tree)
    assert (found.nodes.max_mm, found.matched_by) == (0.0, "order")
    assert found.surface.max_mm < 1e-9
    assert found.recall == found.precision == 1.0
    assert found.same_branching
    assert found.branches.matched == found.branches.parent_matched == found.branches.b
    errors = {key: value for key, value in found.to_dict().items() if "_error_" in key}
    assert len(errors) == 7
    assert list(errors.values()) == pytest.approx([0.0] * 7)


def test_figures_by_hand():
    a, b = pole([0, 0, 0], [0, 0, 2], radius=0.11), pole([0, 0, 0], [0, 0, 2.5], radius=0.10)
    found = compare(a, b)
    assert found.nodes.max_mm == found.nodes.min_mm == pytest.approx(500)  # the root does not count as least
    assert found.volume_error_pct == pytest.approx(100 * (1.21 * 0.8 - 1))
    assert found.length_error_pct == pytest.approx(-20)
    assert found.dbh_error_pct == pytest.approx(10)
    assert found.height_error_m == pytest.approx(-0.5)
    assert found.radius_error_mm == pytest.approx(10)
    assert found.recall == pytest.approx((100 + 2) / 125)  # marks every 2 cm, and two more within 5 cm
    assert found.precision == 1.0
    assert found.branch_volume_error_pct is None  # neither has branches


def test_a_branch_on_another_parent_is_noticed():
    b = pole(*NODES, [1, 0, 3], parent=[-1, 0, 1, 1, 3, 3])
    a = pole(*NODES, [1, 0.02, 2.02], [1, 0, 3], parent=[-1, 0, 1, 1, 3, 1, 5])
    found = compare(a, b)
    assert found.matched_by == "nearest"
    assert not found.same_branching
    assert (found.branches.matched, found.branches.parent_matched) == (3, 2)
    assert found.order_accuracy < 1
    assert found.order_confusion_m[2][1] > 0.8


def test_a_missing_branch_lowers_recall_of_its_order():
    found = compare(pole(*NODES[:3]), pole(*NODES, **FORK))
    assert found.recall_by_order[0] == 1.0
    assert found.recall_by_order[1] < 0.03
    assert (found.branches.matched, found.branches.b) == (1, 2)
    assert found.surface.max_mm < 1e-9
    assert found.surface_back.max_mm == pytest.approx(1617, abs=1)


def test_roots_are_laid_together(tree):
    moved = changed(tree, origin=tree.skeleton.origin + [3.0, 4.0, 0.0])
    found = compare(moved, tree, align="root")
    assert found.shift_m == pytest.approx(5)
    assert found.shift_xyz_m == pytest.approx((-3, -4, 0))
    assert found.nodes.max_mm < 1e-9
    assert not found.notes
    asis = compare(moved, tree)
    assert (asis.shift_m, asis.nodes.mean_mm) == (0.0, pytest.approx(5000))
    assert "--align root" in asis.notes[0]


def test_no_overlap_is_said(tree):
    found = compare(changed(tree, origin=[50, 0, 0]), tree)
    assert found.recall == 0.0
    assert found.order_accuracy is None
    assert "do not overlap" in found.notes[0]


def test_skeletons_compare_what_they_have(tree):
    plain = compare(tree.skeleton, tree).to_dict()
    assert plain["nodes"]["max_mm"] == 0
    assert plain["axis"]["max_mm"] < 1e-9
    for key in ("surface", "radius_error_mm", "volume_error_pct", "dbh_error_pct", "branches_ratio"):
        assert plain[key] is None
    assert plain["length_error_pct"] == pytest.approx(0)


def test_keys_of_the_json(tree):
    plain = json.loads(compare(tree, tree).to_json())
    assert set(plain["nodes"]) == set(plain["surface"]) == SPREAD
    wanted = (
        "recall precision recall_by_order order_accuracy branches_ratio radius_error_mm volume_error_pct "
        "stem_volume_error_pct branch_volume_error_pct length_error_pct dbh_error_pct height_error_m bytes "
        "shift_m"
    )
    assert set(wanted.split()) <= set(plain)
    assert "view" not in plain


def test_systems_that_differ_are_refused(tree):
    a, b = changed(tree, crs="EPSG:28992"), changed(tree, crs="EPSG:2154")
    with pytest.raises(NotComparableError, match=r"EPSG:28992 and B in EPSG:2154.*--align root"):
        compare(a, b)
    assert compare(a, b, align="root").nodes.max_mm == 0
    assert compare(a, changed(tree, crs="EPSG:7415")).nodes.max_mm == 0  # the same with heights
    assert compare(a, tree).nodes.max_mm == 0  # one is not known


def test_kilometres_apart_is_refused(tree):
    far = changed(tree, origin=[120_000, 487_000, 0])
    with pytest.raises(NotComparableError, match=r"km apart.*--align root"):
        compare(tree, far)
    assert compare(tree, far, align="root").nodes.max_mm < 1e-6


@pytest.mark.parametrize("empty", [[[0, 0, 0]], [[0, 0, 0], [0, 0, 0]]])
def test_empty_models_are_refused(tree, empty):
    with pytest.raises(NotComparableError, match="B is empty"):
        compare(tree, pole(*empty))


def test_deviations_grow_along_the_way():
    """What the page plots: a tree that is turned about its root deviates in proportion."""
    angle = 0.01
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
    stem = pole(*[[0, 0, k / 10] for k in range(40)])
    along = compare(changed(stem, xyz=stem.skeleton.xyz @ turn.T), stem).view.along[0]
    assert along.value_mm == pytest.approx(2000 * np.sin(angle / 2) * along.path_m)


def test_large_trees_are_compared():
    rng = np.random.default_rng(1)
    count = 20_000
    parent = np.maximum(np.arange(count) - 1 - rng.integers(0, 30, count) * (rng.random(count) < 0.3), -1)
    parent[1:] = np.maximum(parent[1:], 0)
    xyz = np.zeros((count, 3))
    for i in range(1, count):
        xyz[i] = xyz[parent[i]] + rng.normal(0, 0.05, 3) + [0, 0, 0.002]
    big = pole(*xyz.tolist(), parent=parent, radius=0.01)
    assert compare(big, changed(big, xyz=xyz + 0.001)).nodes.matched == count


def test_segments_of_exactly_a_mark_length_are_measured_where_they_stand():
    """Their number of marks hangs on the last digit of where they are."""
    count = 200
    xyz = np.column_stack([np.zeros(count), np.zeros(count), 0.02 * np.arange(count)])
    skeleton = Skeleton(xyz, np.arange(-1, count - 1), np.array([121913.84, 487434.12, -1.25]))
    tree = TreeModel(skeleton, np.full(count, 0.01), np.ones(count, dtype=np.uint8), np.full(count, np.nan))
    found = compare(tree, tree)
    assert found.surface.max_mm < 1e-3
    assert found.view is not None
