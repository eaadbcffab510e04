"""Rounded bends: through the nodes, within the bark, and never over a straight trunk."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.mesh import MeshOptions, build, tubes
from pipeline.mesh.axes import Axes
from pipeline.mesh.building import settled
from pipeline.mesh.smoothing import hermite, smoothed
from pipeline.mesh.surface import MITRE, axes_of, rings_of
from pipeline.mesh.tube import Rules, tube
from pipeline.model import TreeModel
from pipeline.synthetic import TubeTreeOptions, grow_tubes
from tests.mesh.trees import assert_proper, axis_of, distance, inside, random_tree, singly

SMOOTH = MeshOptions(smooth=True)


def axes(tree: TreeModel, options: MeshOptions = SMOOTH) -> list[tuple[Axes, Axes]]:
    """Return every axis as it is and as it is rounded."""
    plain = settled(axes_of(tree, options), options)
    return list(zip(singly(plain), singly(smoothed(plain, options)), strict=True))


def test_as_they_stand_the_options_draw_the_tubes() -> None:
    tree = random_tree(300, 5)
    mesh, plain = build(tree), tubes(tree)
    assert np.array_equal(mesh.vertices, plain.vertices)
    assert np.array_equal(mesh.faces, plain.faces)
    assert mesh.normals is None
    assert not mesh.leaf.any()


def test_a_curve_of_the_textbook() -> None:
    """Halfway between (0, 0) and (1, 0), with tangents straight up and down: up by an eighth of each."""
    ends = np.array([[0.0, 0, 0]]), np.array([[1.0, 0, 0]])
    tangents = np.array([[0.0, 0, 1]]), np.array([[0.0, 0, -1]])
    assert hermite(*ends, *tangents, np.array([0.5])) == pytest.approx(np.array([[[0.5, 0, 0.25]]]))
    straight = hermite(*ends, ends[1], ends[1], np.array([0.25, 0.5]))
    assert straight == pytest.approx(np.array([[[0.25, 0, 0], [0.5, 0, 0]]]))


def test_a_straight_trunk_stays_straight_below_its_first_bend() -> None:
    """The bent trunks of 2021: two straight metres lean over because the next ten centimetres do."""
    points = np.array([[0, 0, 0], [0, 0, 2], [0.06, 0, 2.08], [0.12, 0, 2.16], [0.3, 0, 2.6]])
    axis = axis_of(points, 0.1)
    ((_, curve),) = axes(axis)
    below = curve.points[curve.points[:, 2] <= 2]
    assert np.abs(below[:, 0]).max() < 0.006  # with tangents of three-point differences: 0.17 m
    trunk = build(axis, options=SMOOTH)
    foot = trunk.vertices[: rings_of(axes_of(axis, SMOOTH), SMOOTH).sides[0]]
    assert np.linalg.norm(foot.mean(axis=0)) < 1e-9
    assert np.abs(foot[:, 2]).max() < 0.001


def test_axes_are_rounded_each_by_itself() -> None:
    plain = settled(axes_of(random_tree(400, 2), SMOOTH), SMOOTH)
    for axis, curve in zip(singly(plain), singly(smoothed(plain, SMOOTH)), strict=True):
        alone = smoothed(axis, SMOOTH)
        assert all(np.array_equal(one, other) for one, other in zip(alone, curve, strict=True))


def test_a_straight_axis_gets_no_rings() -> None:
    straight = axis_of(np.column_stack([0 * np.arange(6), 0 * np.arange(6), np.arange(6) * 0.3]), 0.05)
    assert np.array_equal(build(straight, options=SMOOTH).vertices, tubes(straight).vertices)
    bent = axis_of([[0, 0, 0], [0, 0, 1], [0.5, 0, 2]], 0.05)
    assert np.array_equal(
        build(bent, options=MeshOptions(smooth=True, subdivisions=0)).vertices, tubes(bent).vertices
    )


def assert_faithful(tree: TreeModel) -> None:
    """Rings stand on all nodes; neither line leaves the other by more than the share; nodes lie inside."""
    raw = {int(axis.branch[0]): axis for axis in singly(axes_of(tree, SMOOTH))}
    for _, curve in axes(tree):
        made = tube(rings_of(curve, SMOOTH), Rules(SMOOTH.ring_gap_m, MITRE))
        centres = curve.points[made.kept]
        nodes = raw[int(curve.branch[0])]
        assert distance(nodes.points, centres).max() < 0.001
        assert (distance(centres, nodes.points) <= 0.5 * curve.radius[made.kept] + 1e-9).all()
        assert inside(nodes.points[1:-1], made.vertices, made.faces).all()


@pytest.mark.parametrize("seed", [1, 2])
def test_every_node_lies_inside_and_on_the_middle_line(seed: int) -> None:
    assert_faithful(grow_tubes(TubeTreeOptions(seed=seed)))
    assert_faithful(random_tree(600, seed))


@pytest.mark.parametrize("angle", [20, 60, 89, 120, 150, 179])
def test_a_sharp_bend_is_not_pinched(angle: float) -> None:
    """Rings keep their width at the bend, and none is turned over."""
    turn = np.radians(angle)
    axis = axis_of([[0, 0, 0], [0, 0, 1], [np.sin(turn), 0, 1 + np.cos(turn)]], 0.05)
    mesh = build(axis, options=SMOOTH)
    assert_proper(mesh)
    ((_, curve),) = axes(axis)
    rings = rings_of(curve, SMOOTH)
    made = tube(rings, Rules(SMOOTH.ring_gap_m, MITRE))
    sides = int(rings.sides[0])
    corners = made.vertices.reshape(-1, sides, 3)
    centres = curve.points[made.kept]
    off = np.linalg.norm(corners - centres[:, None], axis=2)
    assert off.min() >= 0.05
    assert off.max() < 0.05 * 1.5
    ahead = np.gradient(centres, axis=0)
    normals = np.cross(corners[:, 0] - centres, corners[:, 1] - centres)
    assert ((normals * ahead).sum(axis=1) > 0).all()
    straight = np.pi * 0.05**2 * 2
    assert tubes(axis).branch_volume.sum() * 0.99 < mesh.branch_volume.sum() < straight * 1.02


def test_rings_do_not_twist_along_a_helix() -> None:
    """The corners of a ring stand nearly where those of the ring before do."""
    t = np.linspace(0, 4 * np.pi, 60)
    axis = axis_of(np.column_stack([0.5 * np.cos(t), 0.5 * np.sin(t), 0.2 * t]), 0.03)
    ((_, curve),) = axes(axis)
    rings = rings_of(curve, SMOOTH)
    made = tube(rings, Rules(SMOOTH.ring_gap_m, MITRE))
    arms = made.vertices.reshape(-1, int(rings.sides[0]), 3) - curve.points[made.kept][:, None]
    turned = (arms[1:] * arms[:-1]).sum(axis=2) / (
        np.linalg.norm(arms[1:], axis=2) * np.linalg.norm(arms[:-1], axis=2)
    )
    assert np.degrees(np.arccos(turned.min())) < 15


def test_normals_point_outward_and_blend() -> None:
    mesh = build(random_tree(200, 4), options=SMOOTH)
    assert mesh.normals is not None
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1)
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    face = np.cross(b - a, c - a)
    against = sum((mesh.normals[mesh.faces[:, k]] * face).sum(axis=1) for k in range(3))
    assert (against > 0).mean() > 0.98


coordinate = st.one_of(st.floats(-1, 1, width=32), st.sampled_from([0.0, 0.5, 1.0, 0.5005, -0.5]))
node = st.tuples(coordinate, coordinate, coordinate)


@settings(max_examples=80)
@given(st.lists(node, min_size=1, max_size=16), st.sampled_from([0.002, 0.02, 0.2]))
def test_however_hostile_an_axis_it_stays_a_solid(
    nodes: list[tuple[float, float, float]], radius: float
) -> None:
    axis = axis_of([(0.0, 0.0, 0.0), *nodes], radius)
    assert_proper(build(axis, options=SMOOTH))
    for plain, curve in axes(axis):
        share = 0.5 * np.maximum(curve.radius, 0.004)
        assert (distance(curve.points, plain.points) <= share + 1e-9).all()


def test_on_real_trees(shared_data: Path) -> None:
    """A few nodes in a thousand stand at kinks too sharp for their thickness; they get no ring."""
    import pipeline

    tree = pipeline.reconstruct(pipeline.read_cloud(shared_data / "trees" / "tree7.xyz"))
    off = []
    raw = {int(axis.branch[0]): axis for axis in singly(axes_of(tree, SMOOTH))}
    for _, curve in axes(tree):
        off.append(distance(raw[int(curve.branch[0])].points, curve.points))
    assert (np.concatenate(off) < 0.001).mean() > 0.995
    assert_proper(build(tree, options=SMOOTH))
