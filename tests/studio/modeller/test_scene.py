"""The scene: what stands in it, and what another colour leaves as it is."""

import numpy as np
import pytest

pytest.importorskip("trame_pyvista", reason='needs the modeller; pip install "treepipe[studio]"')

from pipeline.formats.png import packed
from pipeline.studio.modeller import scene as scenes
from pipeline.studio.modeller.modelling import Modeller, envelope
from pipeline.studio.modeller.parameters import changed
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


def test_twigs_are_shown_instead_of_the_tree_while_it_grows(scene, modeller):
    steps = []
    modelled = modeller.model(SMALL, steps.append)
    scene.show(modelled)
    last = [step for step in steps if not isinstance(step, str)][-1]
    scene.grow((last.xyz, last.parent))
    assert scene.growing
    (lines,) = surfaces(scene)
    assert (lines.GetNumberOfPoints(), lines.GetNumberOfLines()) == (last.nodes, last.nodes - 1)
    scene.grow(None)
    assert not scene.growing
    assert sum(surface.GetNumberOfCells() for surface in surfaces(scene)) == modelled.triangles


def test_pictures_of_ones_own_are_worn_and_taken_off(scene, modeller, tmp_path):
    (tmp_path / "mine.png").write_bytes(packed(np.full((3, 5, 3), 90, dtype=np.uint8)))
    mine = changed(SMALL, bark_picture=str(tmp_path / "mine.png"), leaf_picture=str(tmp_path / "mine.png"))
    modelled = modeller.model(mine)
    scene.show(modelled)
    for actor in (scene.bark, scene.leaves):
        assert actor.texture.to_array().shape == (3, 5, 4)
        assert actor.prop.color.float_rgb == (1, 1, 1)
    surface = scene.bark.mapper.GetInput()
    assert surface.active_texture_coordinates.shape == (3 * len(modelled.wood.faces), 2)
    assert np.ptp(surface.active_texture_coordinates) > 1
    scene.show(modeller.model(SMALL))
    assert scene.bark.texture is None
    assert scene.bark.prop.color.float_rgb == modeller.model(SMALL).bark
    assert sum(surface.GetNumberOfCells() for surface in surfaces(scene)) == modelled.triangles
