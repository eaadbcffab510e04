"""Levels of detail: a quarter of the triangles each, one height and one crown."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from pipeline.mesh import MeshOptions, build
from pipeline.mesh.detail import tolerances
from pipeline.synthetic import TubeTreeOptions, grow_tubes
from tests.mesh.trees import assert_proper, axis_of, inside, random_tree, solids, tree_of

TREES = {
    "tubes": grow_tubes(TubeTreeOptions(seed=3)),
    "random": random_tree(3000, 1),
    "bush": random_tree(900, 8),
}


def test_tolerances_are_those_of_douglas_and_peucker() -> None:
    """A gable of height 1 with a bump of 0.2 on one slope: the bump goes first, the ridge last."""
    chain = np.array([[0, 0, 0], [1, 0, 1], [1.5, 0, 0.7], [2, 0, 0.0]])
    bump = abs(0.5 * 1 - 0.3 * 1) / np.sqrt(2)
    assert tolerances(chain) == pytest.approx([np.inf, 1, bump, np.inf])
    coincident = tolerances(np.zeros((4, 3)))
    assert coincident == pytest.approx([np.inf, 0, 0, np.inf])


@pytest.mark.parametrize("name", TREES)
def test_every_level_has_a_quarter_of_the_triangles(name: str) -> None:
    count = [len(build(TREES[name], options=MeshOptions(lod=lod)).faces) for lod in range(4)]
    for finer, coarser in pairwise(count):
        assert 3.9 < finer / coarser < 4.6
    smooth = [len(build(TREES[name], options=MeshOptions(lod=lod, smooth=True)).faces) for lod in (0, 1)]
    assert 3.9 < smooth[0] / smooth[1] < 8  # bends are no longer rounded, which is more than a quarter


@pytest.mark.parametrize("name", TREES)
@pytest.mark.parametrize("lod", [1, 2, 3])
def test_height_and_crown_stay(name: str, lod: int) -> None:
    """Seen from eighty sides; within the thickness of what is outermost there."""
    tree = TREES[name]
    full = build(tree).vertices
    mesh = build(tree, options=MeshOptions(lod=lod))
    for axis in np.eye(3):
        for to in (axis, -axis):
            outermost = np.argmax(tree.skeleton.xyz @ to + tree.radius)
            thick = 2 * max(tree.radius[outermost], 0.004)
            assert (mesh.vertices @ to).max() == pytest.approx((full @ to).max(), abs=thick)
    size = np.ptp(full, axis=0).max()
    turn = np.linspace(0, 2 * np.pi, 80)
    around = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(80)])
    loss = (full @ around.T).max(axis=0) - (mesh.vertices @ around.T).max(axis=0)
    assert np.abs(loss).max() < 0.03 * size


@pytest.mark.parametrize("name", TREES)
@pytest.mark.parametrize("lod", [1, 2, 3])
def test_what_is_left_is_closed_and_hangs_together(name: str, lod: int) -> None:
    tree = TREES[name]
    mesh = build(tree, options=MeshOptions(lod=lod))
    for solid in solids(mesh):
        assert solid.is_watertight
        assert solid.volume > 0
    drawn = np.unique(mesh.branch)
    above = tree.skeleton.branch_parent[drawn[1:]]
    assert drawn[0] == 0
    assert np.isin(above, drawn).all()


def test_a_branch_moves_onto_its_straightened_parent() -> None:
    """The stem is bowed by 4 cm; drawn straight, its limb begins 4 cm aside."""
    stem = [[0.04 * np.sin(np.pi * z / 4), 0, z] for z in np.linspace(0, 4, 21)]
    limb = [[0.04 + x, 0, 2] for x in np.linspace(0.1, 2, 12)]
    parent = [-1, *range(20), 10, *range(21, 32)]
    tree = tree_of([*stem, *limb], parent, [0.02] * 33)
    mesh = build(tree, options=MeshOptions(lod=3))
    limb_faces = mesh.faces[mesh.branch == 1]
    foot = mesh.vertices[np.unique(limb_faces)]
    middle = foot[foot[:, 0] < 0.2].mean(axis=0)
    stem_faces = mesh.faces[mesh.branch == 0]
    assert inside(middle[None], mesh.vertices, stem_faces).all()


def test_leaves_thin_out_and_grow() -> None:
    tree = TREES["tubes"]
    full, coarse = (build(tree, options=MeshOptions(lod=lod, leaves="quads")) for lod in (0, 1))
    assert coarse.leaf.sum() == pytest.approx(full.leaf.sum() / 4, abs=2)
    a, b = full.only(full.leaf), coarse.only(coarse.leaf)
    assert b.vertices[2] == pytest.approx(a.vertices[2])  # the tip of the first leaf
    assert np.linalg.norm(b.vertices[2] - b.vertices[0]) == pytest.approx(
        2 * np.linalg.norm(a.vertices[2] - a.vertices[0])
    )


def test_small_trees_survive() -> None:
    for tree in (axis_of([[0, 0, 0]]), axis_of([[0, 0, 0], [0, 0, 0]]), axis_of([[0, 0, 0], [0, 0, 1]], 0.1)):
        for lod in range(4):
            mesh = build(tree, options=MeshOptions(lod=lod, smooth=True, leaves="quads"))
            assert_proper(mesh.only(~mesh.leaf))
