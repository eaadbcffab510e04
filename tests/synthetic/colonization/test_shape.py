"""Radii, axes, hanging branches and leaves of a grown tree, on cases small enough to check by hand."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.model import Skeleton
from pipeline.synthetic.colonization import (
    PRESETS,
    ColonizationOptions,
    dressed,
    grow_colonization,
    leaves_of,
)
from pipeline.synthetic.colonization.colours import LEAF_COLOURS, STEM_COLOURS
from pipeline.synthetic.colonization.shape import axes, bend_angle, hanging, pipe_exponent, pipe_radii

QUICK = {"crown_width_m": 2.0, "crown_height_m": 2.0, "crown_depth_m": 2.0, "density_begin": 0.3}


def test_pipe_rule():
    assert pipe_exponent(0.55) == pytest.approx(1.9)
    radius = pipe_radii(np.array([-1, 0, 1, 1]), 0.003, 2.0)
    np.testing.assert_allclose(radius, [0.003 * np.sqrt(2)] * 2 + [0.003] * 2)


def test_a_stouter_stem_from_the_same_growth():
    slim, stout = (grow_colonization(ColonizationOptions(**QUICK, stem_thickness=s)) for s in (0.2, 0.8))
    np.testing.assert_array_equal(slim.skeleton.tips.size, stout.skeleton.tips.size)
    assert stout.radius[0] > 2 * slim.radius[0]


def test_an_axis_goes_on_with_its_thickest_child_and_the_stem_with_itself():
    parent = np.array([-1, 0, 1, 1, 3])
    assert axes(parent, np.array([3.0, 3, 1, 2, 1]), 1).tolist() == [1, 3, -1, 4, -1]
    assert axes(parent, np.array([3.0, 3, 1, 2, 1]), 3).tolist() == [1, 2, -1, 4, -1]
    assert axes(parent, np.array([3.0, 3, 1, 1, 1]), 1)[1] == 2  # the eldest of equals


@pytest.mark.parametrize(("theta", "psi"), [(180, 0), (120, 32), (90, 36), (60, 32)])
def test_the_four_angles_of_the_thesis(theta, psi):
    assert bend_angle(theta, 0.8) == pytest.approx(psi)
    lean = np.radians(theta)
    way = np.array([np.sin(lean), 0.0, -np.cos(lean)])  # theta from straight down
    skeleton = Skeleton(np.array([[0, 0, 0], [0, 0, 1], [0, 0, 2], way + [0, 0, 1]]), np.array([-1, 0, 1, 1]))
    options = ColonizationOptions(pendulous=0.8, pendulous_start=0.0)
    step = hanging(skeleton, options)[3] - [0, 0, 1]
    assert np.linalg.norm(step) == pytest.approx(1)
    assert np.degrees(np.arccos(-step[2])) == pytest.approx(theta - psi)
    assert step[1] == pytest.approx(0, abs=1e-12)


def test_a_segment_takes_along_what_it_carries():
    xyz = np.array([[0, 0, 0], [0, 0, 1], [0, 0, 2.0], [1, 0, 1], [2, 0, 1]])
    skeleton = Skeleton(xyz, np.array([-1, 0, 1, 1, 3]))
    bent = hanging(skeleton, ColonizationOptions(pendulous=0.8, pendulous_start=0.0))
    np.testing.assert_array_equal(bent[:3], xyz[:3])  # the stem does not hang
    first, second = bent[3] - bent[1], bent[4] - bent[3]
    angles = np.degrees(np.arccos([-first[2], -second[2]]))
    np.testing.assert_allclose(angles, [54.0, 54.0 - bend_angle(54.0, 0.8)])


def test_the_order_by_depth_starts_anywhere_on_the_tree():
    xyz = np.array([[0, 0, 0], [0, 0, 1], [0.1, 0, 2.0]])
    skeleton = Skeleton(xyz, np.array([-1, 0, 1]))
    by_depth = ColonizationOptions(pendulous=0.8, pendulous_start=1.0, pendulous_order="depth")
    bent = hanging(skeleton, by_depth)
    assert bent[1].tolist() == [0, 0, 1]
    assert bent[2, 2] < 2.0


def test_hanging_moves_no_segment_out_of_length():
    options = ColonizationOptions(**PRESETS["pendulous"])
    bent = grow_colonization(options)
    straight = grow_colonization(options.model_copy(update={"pendulous": 0.0}))
    np.testing.assert_allclose(bent.skeleton.length, straight.skeleton.length, atol=1e-9)
    assert bent.skeleton.xyz[:, 2].mean() < straight.skeleton.xyz[:, 2].mean()


def leaves(tree, **changes):
    return leaves_of(tree, ColonizationOptions(**QUICK, **changes))


def test_leaves_sit_on_thin_segments_alone():
    tree = grow_colonization(ColonizationOptions(**QUICK))
    some = leaves(tree, leaves_per_node=3)
    thin = np.flatnonzero(tree.radius < 0.009)
    assert sorted(set(some.node)) == thin.tolist()
    assert len(some.at) == 3 * len(thin)
    foot, tip = tree.skeleton.xyz[tree.skeleton.parent[some.node]], tree.skeleton.xyz[some.node]
    way = np.linalg.norm(some.at - foot, axis=1) + np.linalg.norm(some.at - tip, axis=1)
    np.testing.assert_allclose(way, np.linalg.norm(tip - foot, axis=1))
    for vector in (some.rib, some.normal):
        np.testing.assert_allclose(np.linalg.norm(vector, axis=1), 1)
    np.testing.assert_allclose((some.rib * some.normal).sum(axis=1), 0, atol=1e-12)
    assert some.size_m.mean() == pytest.approx(0.7, rel=0.05)
    assert some.size_m.std() == pytest.approx(0.14, rel=0.15)


def test_a_fraction_of_leaves_is_a_probability():
    tree = grow_colonization(ColonizationOptions(**QUICK))
    thin = np.count_nonzero(tree.radius < 0.009)
    assert len(leaves(tree, leaves_per_node=0.7).at) == pytest.approx(0.7 * thin, rel=0.1)
    assert len(leaves(tree, leaves_per_node=0).at) == 0


def test_more_leaves_leave_the_others_where_they_are():
    tree = grow_colonization(ColonizationOptions(**QUICK))
    few, many = (leaves(tree, leaves_per_node=count) for count in (0.7, 2.0))
    assert {tuple(p) for p in few.at} <= {tuple(p) for p in many.at}


def test_shade_takes_leaves_away_from_below():
    tree = grow_colonization(ColonizationOptions(**QUICK))
    light, shaded = leaves(tree, leaves_per_node=5), leaves(tree, leaves_per_node=5, leaf_shade=1.0)
    assert len(shaded.at) < 0.8 * len(light.at)
    assert shaded.at[:, 2].mean() > light.at[:, 2].mean()
    assert shaded.at[:, 2].max() == light.at[:, 2].max()


def test_every_colour_to_choose_is_there():
    fields = ColonizationOptions.model_fields
    assert fields["stem_colour"].annotation.__args__ == tuple(STEM_COLOURS)
    assert fields["leaf_colour"].annotation.__args__ == tuple(LEAF_COLOURS)
    assert (len(STEM_COLOURS), len(LEAF_COLOURS)) == (5, 10)


@pytest.mark.parametrize(
    ("kind", "triangles", "corners"),
    [
        ("triangle", 1, 3),
        ("square", 2, 4),
        ("cross-foil", 4, 8),
        ("custom-square", 2, 4),
        ("custom-cross-foil", 4, 8),
    ],
)
def test_the_five_types_of_leaves(kind, triangles, corners):
    options = ColonizationOptions(**QUICK, iterations=12, leaf_type=kind)
    tree = grow_colonization(options)
    hung, mesh = leaves_of(tree, options), dressed(tree, options)
    assert np.count_nonzero(mesh.leaf) == triangles * len(hung.at)
    first = np.flatnonzero(mesh.leaf)[0]
    points = mesh.vertices[mesh.faces[first:].min() :]
    assert len(points) == corners * len(hung.at)
    edge = np.linalg.norm(points[1] - points[0])
    assert edge == pytest.approx(hung.size_m[0])
    np.testing.assert_allclose((points[0] + points[1]) / 2, hung.at[0], atol=1e-12)


def test_more_sides_make_more_triangles_of_bark():
    few, many = (
        ColonizationOptions(**QUICK, iterations=12, leaves_per_node=0, ring_sides=n) for n in (3, 12)
    )
    tree = grow_colonization(few)
    assert not dressed(tree, few).leaf.any()
    assert len(dressed(tree, many).faces) > 3 * len(dressed(tree, few).faces)
