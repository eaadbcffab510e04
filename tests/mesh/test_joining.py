"""The union: one closed surface, no volume twice, nothing lost."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from pipeline.errors import MissingExtraError, ModelError
from pipeline.mesh import Mesh, MeshOptions, build, joining, tubes, union
from pipeline.synthetic import TubeTreeOptions, grow_tubes
from tests.mesh.trees import axis_of, random_tree, tree_of
from tests.pace import slowdown

TREE = grow_tubes(TubeTreeOptions(seed=5))


@pytest.fixture(autouse=True)
def _library() -> None:
    pytest.importorskip("manifold3d", reason="the extra mesh is not installed")


def surface(mesh: Mesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)


@pytest.mark.parametrize("options", [MeshOptions(), MeshOptions(smooth=True), MeshOptions(lod=2)])
def test_one_closed_surface(options: MeshOptions) -> None:
    apart, joined = build(TREE, options=options), union(TREE, options=options)
    solid = surface(joined)
    assert solid.is_watertight
    assert solid.is_winding_consistent
    assert solid.body_count == 1
    each = apart.branch_volume
    assert each.max() < solid.volume < each.sum()
    assert solid.volume > 0.9 * each.sum()
    assert set(joined.branch.tolist()) <= set(apart.branch.tolist())
    assert joined.branch_volume.sum() == pytest.approx(solid.volume)
    assert joined.crs == apart.crs
    assert np.array_equal(joined.origin, apart.origin)


def test_two_beams() -> None:
    """One square beam grows out of another: the volume where they cross counts once."""
    beam = 0.05
    tree = tree_of([[0, 0, 0], [0, 0, 1], [0, 0, 2], [1, 0, 1]], [-1, 0, 1, 1], [beam] * 4)
    square = MeshOptions(min_sides=4, max_sides=4)
    apart, joined = build(tree, options=square), union(tree, options=square)
    side = beam * np.sqrt(np.pi)  # of the square with the circle's area
    shared = apart.branch_volume.sum() - joined.branch_volume.sum()
    assert 0.2 * side**3 < shared < side**3
    away = joined.vertices[joined.vertices[:, 0] > 0.5]
    assert len(away) == 4
    outer = joined.vertices[:, 0] > 0.2
    assert set(joined.branch[outer[joined.faces].all(axis=1)].tolist()) == {1}


def test_the_same_mesh_gives_the_same_surface() -> None:
    one, two = union(TREE), union(TREE)
    assert np.array_equal(one.vertices, two.vertices)
    assert np.array_equal(one.faces, two.faces)
    assert np.array_equal(one.branch, two.branch)


def test_leaves_are_left_alone() -> None:
    leafy = build(TREE, options=MeshOptions(leaves="quads"))
    joined = union(leafy)
    assert np.array_equal(joined.only(joined.leaf).vertices, leafy.only(leafy.leaf).vertices)
    assert surface(joined.only(~joined.leaf)).is_watertight
    assert not joined.leaf[: (~joined.leaf).sum()].any()


def test_nothing_joined_is_nothing() -> None:
    assert len(union(axis_of([[0, 0, 0]])).faces) == 0


def test_an_open_tube_is_named() -> None:
    mesh = tubes(TREE)
    holed = mesh.only(np.arange(len(mesh.faces)) != np.flatnonzero(mesh.branch == 2)[0])
    with pytest.raises(ModelError, match="branch 2 is not closed"):
        union(holed)


def test_the_remedy_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def absent(name: str) -> None:
        raise ModuleNotFoundError(name)

    monkeypatch.setattr(joining, "import_module", absent)
    with pytest.raises(MissingExtraError, match=r"treepipe\[mesh\]"):
        union(TREE)


def test_seven_thousand_nodes_are_joined_at_a_cost_in_proportion() -> None:
    tree = random_tree(7000, 3)
    assert surface(union(tree)).is_watertight
    small = random_tree(1750, 3)
    assert slowdown(union, small, tree, repeats=2) < 12  # four times the nodes; 16 where it is quadratic
