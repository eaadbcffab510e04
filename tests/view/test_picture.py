"""The picture: drawn where graphics are there, an error with the remedy where not."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.errors import PipelineError
from pipeline.model import PointCloud, Skeleton, TreeModel
from pipeline.view import PictureOptions, graphics
from pipeline.view.picture import picture

SMALL = PictureOptions(width_px=600, height_px=400)
FAR = np.array([120_000.0, 487_000.0, 0.0])


@pytest.fixture(scope="module")
def tree():
    xyz = np.array([[0, 0, 0], [0, 0, 1], [0, 0, 2.0], [0.7, 0, 1.8]])
    skeleton = Skeleton(xyz, np.array([-1, 0, 1, 1]), FAR)
    return TreeModel(
        skeleton, np.array([0.1, 0.08, 0.05, 0.03]), np.zeros(4, dtype=np.uint8), np.full(4, np.nan)
    )


@pytest.fixture(scope="module")
def cloud():
    rng = np.random.default_rng(1)
    return PointCloud(rng.uniform([-0.1, -0.1, 0], [0.1, 0.1, 2], (500, 3)), FAR)


def needs_graphics():
    try:
        graphics.prepare()
    except graphics.NoGraphicsError as error:
        pytest.skip(str(error))


def test_stem_and_branch_have_their_colours(tree, cloud, tmp_path):
    needs_graphics()
    image = pytest.importorskip("PIL.Image")
    picture(tree, cloud, tmp_path / "oak.png", title="oak\nheight 2.0 m", options=SMALL)
    with image.open(tmp_path / "oak.png") as drawn:
        pixels = np.asarray(drawn.convert("RGB")).astype(int)
    assert pixels.shape == (400, 600, 3)
    assert (pixels[0] == 255).all()  # white to the edge
    model = pixels[60:370, 150:300]
    red, green, blue = (model[..., k] for k in range(3))
    is_orange = (red > 150) & (blue < 60) & (green < red)
    is_brown = (red > blue + 20) & (red < 130)
    assert is_brown.sum() > is_orange.sum() > 50  # a stem, and a branch that is thinner
    points = pixels[60:370, :150]
    is_green = points[..., 0] < points[..., 1] - 20
    assert is_green.sum() > 100  # points
    assert not (points[..., 0] > points[..., 2] + 90).any()  # and no wood


def test_a_title_that_is_no_text_is_drawn(tree, cloud, tmp_path):
    needs_graphics()
    picture(tree, cloud, tmp_path / "oak.png", title="oak\udce4\nheight 2.0 m", options=SMALL)
    assert (tmp_path / "oak.png").stat().st_size > 1000


def test_many_points_are_thinned(tree, tmp_path):
    needs_graphics()
    cloud = PointCloud(np.random.default_rng(2).uniform(0, 1, (5000, 3)), FAR)
    picture(tree, cloud, tmp_path / "a.png", options=SMALL.model_copy(update={"most_points": 1000}))
    assert (tmp_path / "a.png").stat().st_size > 1000


def test_no_graphics_names_the_remedy(tree, cloud, tmp_path, monkeypatch):
    monkeypatch.setattr(graphics, "has_egl", lambda: False)
    monkeypatch.setattr(graphics.sys, "platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(PipelineError, match="apt-get install libegl1 libgl1"):
        picture(tree, cloud, tmp_path / "oak.png")
    assert list(tmp_path.iterdir()) == []


def test_missing_library_is_no_egl(monkeypatch):
    def refuse(_name):
        raise OSError

    graphics.has_egl.cache_clear()
    monkeypatch.setattr(graphics.ctypes, "CDLL", refuse)
    assert not graphics.has_egl()
    graphics.has_egl.cache_clear()
