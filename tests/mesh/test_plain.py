"""The compiled drawing of all branches at once is that of plain Python, branch by branch."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.mesh import MeshOptions, TubeOptions, tubes
from pipeline.mesh.axes import nodes_of
from pipeline.mesh.detail import moved
from pipeline.mesh.foliage import places
from pipeline.mesh.rings import Planes, Rings, ring_corners, ring_planes
from pipeline.mesh.surface import MITRE, axes_of, rings_of
from pipeline.mesh.touching import climbs, touching_ring
from pipeline.mesh.triangles import with_normals
from pipeline.model import Floats, TreeModel
from pipeline.synthetic import TubeTreeOptions, grow_tubes
from pipeline.synthetic.colonization import ColonizationOptions, grow_colonization
from tests.mesh import plain
from tests.mesh.trees import axis_of, random_tree, tree_of
from tests.pace import slowdown

GAP = TubeOptions().ring_gap_m


def helix(turns: float, rise: float, count: int, radius: float) -> TreeModel:
    """Wind an axis half a metre wide, that rises so much on a turn."""
    t = np.linspace(0, turns, count)
    turn = 2 * np.pi * t
    return axis_of(np.column_stack([0.5 * np.cos(turn), 0.5 * np.sin(turn), rise * t]), radius)


TREES = {
    "tubes": lambda: grow_tubes(TubeTreeOptions(seed=2, height_m=5.0)),
    "colonization": lambda: grow_colonization(ColonizationOptions(seed=1, iterations=25)),
    "random": lambda: random_tree(400, 7),
    "a coil that touches itself": lambda: helix(2, 0.0, 81, 0.05),
    "a coil that does not": lambda: helix(2, 0.2, 81, 0.05),
    "crooked and thick": lambda: axis_of(np.random.default_rng(3).normal(0, 0.1, (60, 3)), 0.05),
    "nothing": lambda: axis_of([[0, 0, 0], [0, 0, 0]]),
}


@pytest.mark.parametrize("name", TREES)
@pytest.mark.parametrize("options", [TubeOptions(), TubeOptions(min_sides=7, max_sides=7)], ids=["4-32", "7"])
def test_the_same_vertices_faces_and_places(name: str, options: TubeOptions) -> None:
    assert_same(TREES[name](), options)


def assert_same(tree: TreeModel, options: TubeOptions) -> None:
    """Equal to the last bit, but that a library's sines may differ in it."""
    mesh, want = tubes(tree, options=options, tile_m=0.1), plain.drawing(tree, options, 0.1)
    assert mesh.uv is not None
    assert np.array_equal(mesh.faces, want.faces)
    assert np.array_equal(mesh.branch, want.branch)
    np.testing.assert_allclose(mesh.vertices, want.vertices, rtol=0, atol=1e-13)
    np.testing.assert_allclose(mesh.uv, want.uv, rtol=0, atol=1e-12)


coordinate = st.one_of(st.floats(-1, 1, width=32), st.sampled_from([0.0, 0.5, 1.0, 0.5005, 0.502, -0.5]))
thickness = st.sampled_from([0.0, 0.001, 0.01, 0.08, 0.4])
node = st.tuples(st.integers(0, 4), coordinate, coordinate, coordinate, thickness)


@settings(max_examples=50, deadline=None)
@given(st.lists(node, min_size=1, max_size=20))
def test_the_same_of_a_hostile_tree(nodes: list[tuple[int, float, float, float, float]]) -> None:
    parent = [-1] + [max(i - n[0], 0) for i, n in enumerate(nodes)]
    tree = tree_of([(0.0, 0.0, 0.0)] + [n[1:4] for n in nodes], parent, [0.05] + [n[4] for n in nodes])
    assert_same(tree, TubeOptions())


def standing(tree: TreeModel) -> tuple[Floats, np.ndarray, Rings, Planes]:
    """Return the corners and planes of all rings on the stem, whether they fit or not."""
    rings = rings_of(axes_of(tree, TubeOptions()), TubeOptions())
    planes = ring_planes(rings.points, MITRE)
    first = np.concatenate([[0], np.cumsum(rings.sides)])
    return ring_corners(rings, planes), first, rings, planes


def test_the_same_rings_touch() -> None:
    """With a gap of three centimetres, so that many coils touch themselves and many do not."""
    random, wide = np.random.default_rng(1), 0.03
    found, climbing = [], []
    for _ in range(60):
        coil = helix(random.uniform(1.5, 4.0), random.uniform(0.0, 0.25), 50, random.uniform(0.004, 0.1))
        corners, first, rings, planes = standing(coil)
        found.append(touching_ring(corners, first, rings, planes, wide))
        climbing.append(climbs(rings, planes, wide))
        assert found[-1] == plain.touching_ring(corners, first, rings, planes, wide)
    assert 10 < sum(one < 0 for one in found) < 50
    assert not all(climbing)


def test_what_climbs_does_not_touch() -> None:
    corners, first, rings, planes = standing(axis_of(np.outer(np.arange(50), [0.01, 0.0, 0.04]), 0.02))
    assert climbs(rings, planes, GAP)
    assert plain.touching_ring(corners, first, rings, planes, GAP) == -1


def test_looking_for_touching_rings_follows_their_number() -> None:
    """A coil that nowhere touches itself, wound eight times as far."""
    short, long = (standing(helix(turns, 0.15, 160 * turns, 0.05)) for turns in (80, 640))
    assert not climbs(*short[2:], GAP)
    looked = slowdown(lambda rings: touching_ring(*rings, GAP), short, long)
    assert looked < 30  # 8 where it is linear, 64 where it is quadratic


def test_normals_are_the_mean_of_the_faces_around() -> None:
    mesh = tubes(random_tree(200, 3))
    flat = np.arange(len(mesh.faces)) % 5 == 0
    a, b, c = (mesh.vertices[mesh.faces[:, k]] for k in range(3))
    square = np.cross(b - a, c - a) * np.where(flat, 1e-9, 1.0)[:, None]
    total = np.zeros_like(mesh.vertices)
    for k in range(3):
        np.add.at(total, mesh.faces[:, k], square)
    assert np.array_equal(
        with_normals(mesh, flat).normals, total / np.linalg.norm(total, axis=1, keepdims=True)
    )


def test_leaves_are_where_interpolation_puts_them() -> None:
    tree = random_tree(300, 6)
    options = MeshOptions(leaves="quads", leaves_per_tip=9)
    found = places(tree, options, np.random.default_rng(4))
    paths = [path for path in tree.skeleton.paths if len(path) > 1]
    jitter = np.random.default_rng(4).uniform(0.0, 1.0, (len(paths), 9))
    for twig, path in enumerate(paths):
        upward = tree.skeleton.xyz[path[::-1]]
        arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(upward, axis=0), axis=1))])
        down = min(options.leaf_zone_m, 0.8 * arc[-1]) * (np.arange(9) - 0.5 + jitter[twig]).clip(0) / 9
        down[0] = 0.0
        here = slice(9 * twig, 9 * twig + 9)
        assert np.array_equal(found.radius[here], np.interp(down, arc, tree.radius[path[::-1]]))
        for k in range(3):
            assert np.array_equal(found.at[here, k], np.interp(down, arc, upward[:, k]))


def test_branches_move_with_what_is_left_of_their_parents() -> None:
    tree = random_tree(400, 9)
    axes = axes_of(tree, TubeOptions())
    node = nodes_of(tree, axes.branch)
    left = np.random.default_rng(2).random(len(node)) < 0.3
    left[axes.foot] = left[axes.tip] = True
    found = moved(tree.skeleton.xyz, node, axes.first, axes.points, left)
    place = tree.skeleton.xyz.copy()
    for start, stop in zip(axes.first[:-1], axes.first[1:], strict=True):
        path, chain, stays = node[start:stop], axes.points[start:stop], left[start:stop]
        points = np.concatenate([place[path[:1]], chain[1:]])
        arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(chain, axis=0), axis=1))])
        for k in range(3):
            place[path[1:], k] = np.interp(arc, arc[stays], points[stays, k])[1:]
        assert np.array_equal(found[start:stop], points)
