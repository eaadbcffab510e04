"""The scene: what stands in it, and what another colour leaves as it is."""

import numpy as np
import pytest

pytest.importorskip("trame_pyvista", reason='needs the modeller; pip install "treepipe[studio]"')

from pipeline.studio import scene as scenes
from pipeline.studio.modelling import Modeller, envelope
from pipeline.studio.parameters import changed
from pipeline.synthetic.colonization import ColonizationOptions

SMALL = ColonizationOptions(iterations=8, crown_width_m=2, crown_height_m=3, crown_depth_m=2)


@pytest.fixture
def modeller():
    return Modeller(lambda: 0.0)


@pytest.fixture
def scene():
    made = scenes.Scene()
    yield made
    made.plotter.close()


def surfaces(scene):
    actors = scene.plotter.renderer.actors.values()
    return [actor.mapper.GetInput() for actor in actors if actor.visibility]


def test_bark_and_leaves_stand_in_the_scene(scene, modeller):
    modelled = modeller.model(SMALL)
    scene.show(modelled)
    assert sum(surface.GetNumberOfCells() for surface in surfaces(scene)) == modelled.triangles
    assert sum(surface.GetNumberOfPoints() for surface in surfaces(scene)) == modelled.vertices


def test_another_colour_leaves_the_triangles_as_they_are(scene, modeller):
    scene.show(modeller.model(SMALL))
    before = surfaces(scene)
    red = modeller.model(changed(SMALL, leaf_colour="red"))
    scene.show(red)
    assert all(a is b for a, b in zip(before, surfaces(scene), strict=True))
    assert red.leaf in [actor.prop.color.float_rgb for actor in scene.plotter.renderer.actors.values()]


def test_points_of_the_crown_come_and_go(scene, modeller):
    scene.show(modeller.model(SMALL))
    assert not scene.shaping
    points = envelope(SMALL)
    scene.shape(points)
    assert scene.shaping
    assert len(points) in [surface.GetNumberOfPoints() for surface in surfaces(scene)]
    scene.shape(None)
    assert not scene.shaping


def test_of_very_many_leaves_whole_ones_are_left_out(modeller, monkeypatch):
    foliage = modeller.model(SMALL).foliage
    monkeypatch.setattr(scenes, "MOST_LEAF_FACES", len(foliage.faces) // 3)
    surface = scenes.leaf_surface(foliage, "cross-foil")
    assert len(foliage.faces) / 5 < surface.n_cells <= len(foliage.faces) / 3
    assert surface.n_points == 2 * surface.n_cells  # eight corners and four triangles a leaf
    assert np.isfinite(surface.active_texture_coordinates).all()


def test_a_tree_without_leaves_is_drawn(scene, modeller):
    modelled = modeller.model(changed(SMALL, leaves_per_node=0.0))
    scene.show(modelled)
    assert modelled.triangles == len(modelled.wood.faces)
