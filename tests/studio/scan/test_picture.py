"""Colours with their legends, shapes, and the scene."""

import numpy as np
import pytest

pytest.importorskip("trame_pyvista", reason='needs the studio; pip install "treepipe[studio]"')

from pipeline.config import Config
from pipeline.model import Skeleton, TreeModel
from pipeline.studio.folders import Folders
from pipeline.studio.scan import scene as scenes
from pipeline.studio.scan.colouring import PAIR, SOURCES, along, modes_of, painted, rgb, rounded_up
from pipeline.studio.scan.making import Maker, Result, Shown, Wish
from pipeline.studio.scan.shapes import THINNEST_M, axes, cylinders, evenly, shares, zero_of
from pipeline.studio.scan.telling import picture_of, result_of


@pytest.fixture(scope="module")
def shown(folder):
    wish = Wish(folder / "twig.laz", 1, other=folder / "twig.truth.npz")
    return Maker(Folders([folder])).make(wish, lambda _stage: None)


@pytest.fixture
def scene():
    made = scenes.ScanScene()
    yield made
    made.plotter.close()


def alone(shown):
    return shown._replace(other=None, compared=None)


def visible(scene):
    return {name for name, actor in scene._actors.items() if actor.visibility}


def data_of(scene, name):
    return scene._actors[name].mapper.GetInput()


def test_heights_go_from_the_ground_to_the_top(shown):
    paint = painted(shown.result, "height")
    assert paint.legend.bar.unit == "m"
    assert paint.legend.bar.low == 0
    assert paint.legend.bar.high == pytest.approx(shown.result.figures["height_m"], abs=0.05)
    top = int(np.argmax(shown.result.used.xyz[:, 2]))
    assert paint.points[top].tolist() == pytest.approx(rgb(paint.legend.bar.colours[-1]), abs=8)


def test_classes_are_those_of_the_wood_and_points_follow_it(shown):
    tree = shown.result.tree
    for mode, number, colours in (
        ("order", tree.skeleton.order[1:], scenes.painted(shown.result, "order").legend.classes),
        ("source", tree.radius_source[1:], [(colour, "") for colour in SOURCES]),
    ):
        paint = painted(shown.result, mode)
        wanted = np.array([rgb(colour) for colour, _ in colours], dtype=np.uint8)[number]
        assert (paint.segments == wanted).all()
        assert (paint.points == paint.segments[shown.result.near]).all()
    shares_ = [float(words.split(": ")[1].split(" %")[0]) for _, words in paint.legend.classes]
    assert sum(shares_) == pytest.approx(100, abs=1)


def test_distances_are_those_of_the_points(shown):
    paint = painted(shown.result, "distance")
    view = shown.result.off.view
    assert paint.legend.bar.unit == "mm"
    beyond = rgb(paint.legend.classes[0][0])
    count = int((paint.points == beyond).all(axis=1).sum())
    assert count == int((view.point_mm > paint.legend.bar.high).sum()) <= 0.05 * len(view.point_mm)
    furthest = view.points[int(np.argmax(view.point_mm))]
    own = int(np.argmin(np.abs(shown.result.used.world - furthest).sum(axis=1)))
    assert paint.points[own].tolist() == list(beyond)


def test_a_skeleton_has_heights_and_orders_alone():
    graph = Skeleton(np.array([[0, 0, 0], [0, 0, 1.0]]), np.array([-1, 0]))
    result = Result("x", graph, Config(), {})
    assert modes_of(result) == ["height", "order"]
    assert painted(result, "source").legend.title.startswith("Height")


def test_ramps_and_round_ends():
    assert along(("#000000", "#ffffff"), np.array([-1, 0.5, 2])).tolist() == [[0] * 3, [128] * 3, [255] * 3]
    assert [rounded_up(value) for value in (0.4, 1.0, 1.1, 21, 0)] == [0.5, 1.0, 2.0, 50.0, 1.0]


def test_cylinders_have_the_ends_and_radii_of_their_segments():
    graph = Skeleton(np.array([[0, 0, 0], [0, 0, 1.0], [0, 0, 1.0], [1.0, 0, 1]]), np.array([-1, 0, 1, 2]))
    radius = np.array([0.2, 0.1, 0.1, 0.0])
    tree = TreeModel(graph, radius, np.zeros(4, np.uint8), np.full(4, np.nan))
    shape = cylinders(tree, zero_of(graph))
    first = shape.vertices[shape.segment == 0]
    assert np.linalg.norm(first[:8, :2], axis=1) == pytest.approx(0.2)
    assert np.linalg.norm(first[8:, :2], axis=1) == pytest.approx(0.1)
    assert set(shape.segment.tolist()) == {0, 2}  # one has no length
    tip = shape.vertices[shape.segment == 2][-8:]
    assert np.hypot(tip[:, 1], tip[:, 2] - 1).min() == pytest.approx(THINNEST_M)
    corners = shape.vertices[shape.cells]
    out = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert (np.einsum("ij,ij->i", out, shape.normals[shape.cells[:, 0]]) > 0).all()


def test_far_coordinates_keep_their_millimetres():
    graph = Skeleton(
        np.array([[0, 0, 0], [0, 0, 1.001]]), np.array([-1, 0]), origin=np.array([1e5, 4e5, 2.5])
    )
    lines = axes(graph, zero_of(graph)).vertices.astype(np.float32)
    assert lines[1, 2] - lines[0, 2] == pytest.approx(1.001, abs=1e-5)


def test_of_many_points_some_are_drawn_evenly():
    assert evenly(10, 5).tolist() == [0, 2, 4, 6, 9]
    assert evenly(3).tolist() == [0, 1, 2]
    assert shares([900_000, 300_000, 0]) == [225_000, 75_000, 0]


def test_layers_are_switched_one_by_one(scene, shown):
    scene.show(alone(shown), "height", "over")
    scene.switch(dict.fromkeys(scenes.LAYERS, True))
    assert visible(scene) == {"cloud", "rest", "axes", "wood"}  # the twig has no leaves
    scene.switch({"cloud": False, "wood": True, "axes": False, "rest": False})
    assert visible(scene) == {"wood"}
    assert scene.has()["leaves"] is False


def test_all_points_and_segments_stand_in_the_scene(scene, shown):
    drawn = scene.show(alone(shown), "height", "over")
    result = shown.result
    assert data_of(scene, "cloud").GetNumberOfPoints() == len(result.used)
    assert data_of(scene, "axes").GetNumberOfCells() == len(result.tree) - 1
    assert drawn.shown == drawn.points == len(result.used) + len(result.rest)
    before = data_of(scene, "wood").GetPoint(5)
    scene.show(alone(shown), "source", "over")
    assert data_of(scene, "wood").GetPoint(5) == before


def test_thinned_points_are_told(scene, shown, monkeypatch):
    monkeypatch.setattr(scenes, "shares", lambda counts: shares(counts, 1000))
    drawn = scene.show(alone(shown), "height", "over")
    line = picture_of(alone(shown), drawn, scene.has())["scan_line"]
    assert f"{drawn.shown:,} of {drawn.points:,}; figures are of all" in line
    assert drawn.shown <= 1000


def test_two_models_stand_over_each_other_in_two_colours_or_apart(scene, shown):
    drawn = scene.show(shown, "order", "over")
    scene.switch({})
    assert {"wood", "other_wood"} <= visible(scene)
    colours = [
        np.unique(scenes.pv.wrap(data_of(scene, name))["rgb"], axis=0) for name in ("wood", "other_wood")
    ]
    assert [each.tolist() for each in colours] == [[list(rgb(colour))] for colour in PAIR]
    assert [legend.title for legend in drawn.legends] == ["Two models", "Branch order"]
    over = np.array(data_of(scene, "other_wood").GetBounds())
    scene.show(shown, "order", "side")
    apart = np.array(data_of(scene, "other_wood").GetBounds())
    assert apart[0] > over[1]
    assert apart[4:] == pytest.approx(over[4:])


def test_the_panel_tells_figures_flags_and_the_comparison(shown):
    said = result_of(Shown(*shown))
    figures = {row[0]: row[2] for row in said["scan_rows"]}
    assert figures["height_m"].endswith(" m")
    assert " to " in figures["dbh_cm"]
    assert figures["points_used"] == f"{len(shown.result.used):,}"
    assert said["scan_other"] == "twig.truth.npz"
    assert [table["name"] for table in said["scan_tables"]][:2] == ["distances, mm", "tree"]
    assert all(flag["says"] != flag["name"] for flag in said["scan_flags"])
