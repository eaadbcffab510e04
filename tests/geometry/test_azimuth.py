"""The frame turns with the cloud, gives every point back, and is found again after saving."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.geometry.azimuth import DECIMALS, FRAME, STORED, Frame, azimuth_of
from pipeline.model import PointCloud, Skeleton, TreeModel

RASTER = 10.0**-DECIMALS
angles = st.floats(-np.pi, np.pi)
places = st.tuples(st.floats(-1000, 1000), st.floats(-1000, 1000))


@pytest.fixture(scope="module")
def xyz():
    """A lopsided tree: more of it towards one side."""
    rng = np.random.default_rng(4)
    return rng.normal(size=(300, 3)) * [2.0, 1.0, 3.0] + rng.exponential(1.0, (300, 1)) * [1.0, 0.5, 0.0]


def turned(xyz, angle, about=(0.0, 0.0)):
    c, s = np.cos(angle), np.sin(angle)
    flat = (xyz[:, :2] - about) @ np.array([[c, s], [-s, c]]) + about
    return np.column_stack([flat, xyz[:, 2]])


def test_by_hand():
    frame = Frame(np.pi / 2, (10.0, 20.0))
    np.testing.assert_allclose(frame.turn(np.array([[10.0, 23.0, 5.0]])), [[3.0, 0.0, 5.0]], atol=1e-12)
    np.testing.assert_allclose(frame.back(np.array([[0.0, 1.0, 5.0]]), 7), [[9.0, 20.0, 5.0]], atol=1e-12)


@given(angles, places)
def test_back_undoes_turn(angle, about):
    points = np.random.default_rng(0).uniform(-30, 30, (50, 3)) + [*about, 0.0]
    frame = Frame(angle, about)
    np.testing.assert_allclose(frame.back(frame.turn(points), STORED), points, atol=RASTER)


@given(angles)
def test_the_azimuth_turns_with_the_cloud(xyz, angle):
    ahead = azimuth_of(turned(xyz, angle)) - azimuth_of(xyz) - angle
    assert np.cos(ahead) == pytest.approx(1.0, abs=1e-12)


@given(angles, places)
def test_a_turned_cloud_looks_the_same_in_its_own_frame(xyz, angle, about):
    other = turned(xyz, angle, about)
    here, there = Frame.of(xyz, {}).turn(xyz), Frame.of(other, {}).turn(other)
    np.testing.assert_allclose(there, here, atol=1.1 * RASTER)


@given(angles)
def test_what_is_snapped_lies_where_it_did_and_is_found_again_to_the_bit(xyz, angle):
    cloud = PointCloud(turned(xyz, angle), metadata={"kept": 1})
    frame = Frame.of(cloud.xyz, {})
    snapped = frame.snapped(cloud)
    assert np.abs(snapped.xyz - cloud.xyz).max() <= RASTER
    assert snapped.metadata["kept"] == 1
    again = Frame.of(snapped.xyz[:20], snapped.metadata)  # its own points would give another frame
    assert again == frame
    np.testing.assert_array_equal(again.turn(snapped.xyz), frame.turn(cloud.xyz))


def test_the_frame_of_the_metadata_goes_before_that_of_the_points(xyz):
    known = {FRAME: (0.5, 1.0, 2.0)}
    assert Frame.of(xyz, known) == Frame(0.5, (1.0, 2.0))
    assert Frame.of(xyz, known) != Frame.of(xyz, {})
    assert Frame.of(xyz, known).as_plain == known[FRAME]


def test_rows_come_by_height_whatever_their_order_was(xyz):
    frame = Frame.of(xyz, {})
    cloud = frame.cloud(PointCloud(xyz))
    other = frame.cloud(PointCloud(xyz[np.random.default_rng(1).permutation(len(xyz))]))
    assert (np.diff(cloud.xyz[:, 2]) >= 0).all()
    np.testing.assert_array_equal(cloud.xyz, other.xyz)


def test_ties_of_height_go_by_y_then_x():
    frame = Frame(0.0, (0.0, 0.0))
    points = np.array([[2.0, 1, 0], [1, 1, 0], [9, 0, 0], [0, 0, -1]])
    assert frame.order(points).tolist() == [3, 2, 1, 0]


def test_no_zero_is_negative():
    frame = Frame(0.0, (0.0, 0.0))
    tiny = np.array([[-1e-9, -1e-9, -1e-9]])
    assert not np.signbit(frame.turn(tiny)).any()
    assert not np.signbit(frame.back(tiny, STORED)).any()


def test_a_skeleton_and_a_tree_come_back_to_where_their_cloud_was(xyz):
    frame = Frame(0.7, (3.0, -2.0))
    moved = Skeleton(xyz[:3], [-1, 0, 1], np.array([100.0, 200.0, 5.0]))
    inside = frame.skeleton(moved, np.array([90.0, 210.0, 5.0]))
    np.testing.assert_allclose(inside.xyz, frame.turn(xyz[:3] + [10.0, -10.0, 0.0]))
    assert inside.origin.tolist() == [90.0, 210.0, 5.0]
    back = frame.skeleton_back(inside)
    np.testing.assert_allclose(back.world, moved.world, atol=RASTER)
    tree = TreeModel(inside, np.full(3, 0.1), np.zeros(3, np.uint8), np.zeros(3))
    np.testing.assert_allclose(frame.tree_back(tree).skeleton.world, moved.world, atol=RASTER)
