"""The picture of a year: bark around the wood, colours, marks."""

import numpy as np
import pytest

from pipeline.model import Skeleton, TreeModel
from pipeline.studio.years.limbs import branch_at
from pipeline.studio.years.plan import Start
from pipeline.studio.years.rods import STOUT_SIDES, rods

pytest.importorskip("pyvista", reason="draws; pip install pyvista")

from pipeline.studio.years.scene import COLOURINGS, NEWEST, WOOD, YOUNG, Scene, colours_of


def hand_made():
    """A stem of two segments, with a side branch at its middle."""
    xyz = [[0, 0, 0], [0, 0, 1], [0, 0, 2], [1, 0, 1]]
    graph = Skeleton(np.array(xyz, dtype=float), np.array([-1, 0, 1, 1], dtype=np.int32))
    return TreeModel(graph, np.array([0.1, 0.1, 0.1, 0.1]), np.zeros(4, dtype=np.uint8), np.full(4, np.nan))


def test_bark_lies_around_the_axes_and_looks_outward():
    bark = rods(hand_made())
    assert len(bark.vertices) == STOUT_SIDES * 5
    assert len(bark.faces) == 2 * STOUT_SIDES * 3
    stem = bark.vertices[: 3 * STOUT_SIDES]
    assert np.allclose(np.hypot(stem[:, 0], stem[:, 1]), 0.1, atol=1e-6)
    a, b, c = (bark.vertices[bark.faces[:, k]] for k in range(3))
    out = np.cross(b - a, c - a)
    assert ((out * bark.normals[bark.faces[:, 0]]).sum(axis=1) > 0).all()
    assert set(bark.node.tolist()) == {0, 1, 2, 3}


def test_every_kind_of_tree_is_drawn(grower, plan):
    story = grower.grow(plan(), lambda _: None)
    for year in story.years[1:]:
        bark = rods(year.tree)
        assert np.isfinite(bark.vertices).all()
        assert bark.faces.max() < len(bark.vertices)
        assert np.allclose(np.linalg.norm(bark.normals, axis=1), 1, atol=1e-5)


def test_new_wood_is_green_and_scanned_wood_is_brown(grower, plan, standing):
    story = grower.grow(plan(start=Start("oak", standing), years=3), lambda _: None)
    shown = colours_of(story.years[3], "age")
    kinds = {tuple(colour) for colour in np.unique(shown, axis=0).tolist()}
    assert kinds == {WOOD, YOUNG, NEWEST}
    assert (shown == WOOD).all(axis=1).sum() == pytest.approx(len(standing), rel=0.1)
    assert (colours_of(story.years[0], "age") == WOOD).all()


def test_a_scene_shows_years_and_marks(grower, plan):
    story = grower.grow(plan(), lambda _: None)
    scene = Scene()
    for colouring in COLOURINGS:
        scene.show(story.years[8], colouring)
    scene.look()
    year = story.years[8]
    branch = branch_at(year.limbs, 5, year.limbs.end[5], year.tree)
    scene.mark(year.limbs, branch)
    assert sum(bool(actor.visibility) for actor in scene.plotter.actors.values()) >= 3
    scene.mark(None, None)
    scene.show(story.years[0], "age")
    assert not any(actor.visibility for actor in scene.plotter.actors.values())
