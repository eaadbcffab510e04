"""Tubes: hand-computed volumes, and closed, outward solids for however hostile an axis."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pipeline.errors import ModelError
from pipeline.mesh import Mesh, TubeOptions, tubes
from pipeline.mesh.surface import corner_share, side_counts
from pipeline.model import TreeModel
from tests.mesh.trees import assert_proper, axis_of, random_tree, solids, tree_of
from tests.pace import slowdown


def test_a_cylinder_has_the_volume_of_the_cylinder() -> None:
    mesh = tubes(axis_of([[0, 0, 0], [0, 0, 2]], 0.1))
    assert mesh.branch_volume == pytest.approx([np.pi * 0.1**2 * 2], rel=1e-9)
    assert mesh.vertices[:, 2].min() == pytest.approx(0, abs=1e-12)
    assert mesh.vertices[:, 2].max() == pytest.approx(2)
    assert mesh.world[:, 0].min() > 99_999
    assert mesh.crs == "EPSG:28992"
    assert_proper(mesh)


def test_a_cone_stump_has_the_volume_of_its_frustum() -> None:
    tree = tree_of([[0, 0, 0], [0.6, 0, 0.8]], [-1, 0], [0.1, 0.08])  # sixteen sides at both ends
    assert tubes(tree).branch_volume == pytest.approx([np.pi / 3 * (0.01 + 0.008 + 0.0064)], rel=1e-9)


def test_a_mitred_bend_keeps_the_volume() -> None:
    mesh = tubes(axis_of([[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1]], 0.05))
    assert mesh.branch_volume == pytest.approx([np.pi * 0.05**2 * 3], rel=1e-6)
    assert_proper(mesh)


def test_side_branches_start_on_the_parent_axis_with_their_own_radius() -> None:
    tree = tree_of([[0, 0, 0], [0, 0, 1], [0, 0, 2], [1, 0, 1]], [-1, 0, 1, 1], [0.2, 0.2, 0.2, 0.05])
    mesh = tubes(tree)
    side = mesh.vertices[np.unique(mesh.faces[mesh.branch == 1])]
    assert side[:, 0].min() == pytest.approx(0, abs=1e-12)
    assert np.abs(side[:, 2] - 1).max() < 0.06
    assert mesh.branch_volume == pytest.approx([np.pi * 0.04 * 2, np.pi * 0.0025], rel=1e-9)


def test_a_thread_is_drawn_four_millimetres_thick() -> None:
    mesh = tubes(axis_of([[0, 0, 0], [0, 0, 1]], 0.0))
    assert mesh.branch_volume == pytest.approx([np.pi * 0.004**2], rel=1e-9)
    thin = tubes(axis_of([[0, 0, 0], [0, 0, 1]], 0.0), options=TubeOptions(min_radius_m=0.0005))
    assert thin.branch_volume == pytest.approx([np.pi * 0.0005**2], rel=1e-9)


def test_a_tree_without_length_draws_nothing() -> None:
    for tree in (tree_of([[0, 0, 0]], [-1], [0.1]), axis_of([[0, 0, 0], [0, 0, 0], [0, 0, 0.0005]])):
        mesh = tubes(tree)
        assert len(mesh.vertices) == len(mesh.faces) == len(mesh.branch) == len(mesh.branch_volume) == 0


def test_coincident_nodes_change_nothing() -> None:
    plain = tubes(axis_of([[0, 0, 0], [0, 0, 1], [0, 0.2, 2]]))
    doubled = tubes(axis_of([[0, 0, 0], [0, 0, 0], [0, 0, 1], [0, 0, 1.0005], [0, 0.2, 2], [0, 0.2, 2]]))
    assert len(doubled.vertices) == len(plain.vertices)
    assert doubled.branch_volume == pytest.approx(plain.branch_volume, rel=1e-3)
    assert_proper(doubled)


@pytest.mark.parametrize("back", [0.0, 1e-9, 0.3, 0.9999])
def test_an_axis_that_turns_right_back_stays_a_solid(back: float) -> None:
    mesh = tubes(axis_of([[0, 0, 0], [0, 0, 1], [0, 0, back]], 0.02))
    assert_proper(mesh)
    assert mesh.vertices[:, 2].max() > 0.99


def test_a_crooked_thick_axis_does_not_cut_itself() -> None:
    """Nodes every centimetre, five millimetres to either side, on a trunk of half a metre."""
    z = np.arange(0, 1, 0.01)
    mesh = tubes(axis_of(np.column_stack([0.005 * (-1.0) ** np.arange(100), 0 * z, z]), 0.25))
    assert_proper(mesh)
    assert mesh.branch_volume[0] == pytest.approx(np.pi * 0.25**2 * 0.99, rel=0.01)
    # rings that do not cut each other: the corners of the wall rise around the trunk
    wall = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    inside = np.abs(wall.face_normals[:, 2]) < 0.99
    outward = (wall.triangles_center[:, :2] * wall.face_normals[:, :2]).sum(axis=1)
    assert (outward[inside] > 0).all()


def test_sides_follow_the_radius() -> None:
    options = TubeOptions()
    radius = np.array([0.004, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5])
    sides = side_counts(radius, options)
    assert sides.tolist() == [4, 6, 8, 12, 16, 24, 32]
    middle = radius * (1 - np.cos(np.pi / sides))
    assert (middle[:-1] <= options.max_deviation_m).all()  # the last has as many sides as are allowed
    fine = TubeOptions(max_deviation_m=1e-5)
    edges = 2 * np.sin(np.pi / side_counts(radius, fine)) * radius * corner_share(side_counts(radius, fine))
    assert (edges >= fine.min_edge_m).all()
    assert set(side_counts(radius, TubeOptions(min_sides=5, max_sides=5)).tolist()) == {5}


def test_options_and_meshes_refuse_nonsense() -> None:
    with pytest.raises(ValueError, match="lower min_sides"):
        TubeOptions(min_sides=8, max_sides=4)
    with pytest.raises(ModelError, match="outside 0 to 1"):
        Mesh(np.zeros((2, 3)), np.array([[0, 1, 2]], dtype=np.int32), np.zeros(1, dtype=np.int32))
    with pytest.raises(ModelError, match="branch"):
        Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]], dtype=np.int32), np.zeros(2, dtype=np.int32))
    with pytest.raises(ModelError, match="one a vertex"):
        Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]), np.zeros(1), normals=np.zeros((2, 3)))


def test_trimesh_agrees() -> None:
    mesh = tubes(random_tree(400, 3))
    for solid in solids(mesh):
        assert solid.is_watertight
        assert solid.is_winding_consistent
        assert solid.volume > 0


def test_volume_is_that_of_the_drawn_frusta() -> None:
    tree = random_tree(3000, 1)
    a, b = np.maximum(tree.start_radius, 0.004), np.maximum(tree.radius, 0.004)
    drawn = np.pi / 3 * (a * a + a * b + b * b) * tree.skeleton.length
    each = np.bincount(tree.skeleton.branch, drawn)
    mesh = tubes(tree)
    assert mesh.branch_volume.sum() == pytest.approx(drawn.sum(), rel=0.002)
    assert np.abs(mesh.branch_volume / each - 1).max() < 0.01
    assert_proper(mesh)


def test_the_cost_follows_the_number_of_axes() -> None:
    one = random_tree(1000, 2)
    nodes, root = one.skeleton.xyz, one.skeleton.parent < 0

    def bunch(copies: int) -> TreeModel:
        """Return copies of the tree that all start at the first one's root."""
        parent = [np.where(root, 0 if k else -1, one.skeleton.parent + k * len(one)) for k in range(copies)]
        return tree_of(np.tile(nodes, (copies, 1)), np.concatenate(parent), np.tile(one.radius, copies))

    small, large = bunch(5), bunch(20)
    assert len(tubes(large).branch_volume) == 4 * len(tubes(small).branch_volume)
    assert slowdown(tubes, small, large) < 12  # four times the axes; 16 where it is quadratic


coordinate = st.one_of(st.floats(-1, 1, width=32), st.sampled_from([0.0, 0.5, 1.0, 0.5005, 0.502, -0.5]))
node = st.tuples(
    st.integers(0, 1000), coordinate, coordinate, coordinate, st.sampled_from([0.0, 0.001, 0.01, 0.08, 0.4])
)


@settings(max_examples=150, deadline=None)
@given(st.lists(node, min_size=1, max_size=24), st.integers(1, 24))
@example([(k, 0.0, 0.0, z, 0.01) for k, z in enumerate([1.0, 0.0, 1.0, 0.0, 1.0])], 1)
@example([(k, 0.0, 0.0, 0.002 * (k % 3), 0.4) for k in range(20)], 1)
@example([(0, np.cos(k), np.sin(k), 0.5, 0.001) for k in range(20)], 24)  # one fork, twenty ways
@example([(k, 0.1 * np.cos(k / 2), 0.1 * np.sin(k / 2), 0.0, 0.08) for k in range(24)], 1)  # round in circles
def test_however_hostile_a_tree_every_tube_is_a_solid(
    nodes: list[tuple[int, float, float, float, float]], wide: int
) -> None:
    """Random parents among the last `wide` nodes: paths (1), bushes (24), with coincident nodes."""
    parent = [-1] + [max(i - n[0] % wide, 0) for i, n in enumerate(nodes)]
    xyz = [(0.0, 0.0, 0.0)] + [n[1:4] for n in nodes]
    mesh = tubes(tree_of(xyz, parent, [0.05] + [n[4] for n in nodes]))
    assert_proper(mesh)
