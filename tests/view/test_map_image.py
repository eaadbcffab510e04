"""The picture of the map: crowns where they are, by height, whatever their number."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from pipeline.view import map_image
from pipeline.view.map_image import write_map_image
from pipeline.view.map_trees import Figure, TreeMap
from tests.view.test_map_page import small


def pixels(path):
    return np.asarray(Image.open(path).convert("RGB")).astype(int)


def painted(path):
    """Share of pixels that are green or blue rather than paper or ink, as crowns and the scale are."""
    rgb = pixels(path)
    return float(((rgb.max(axis=-1) - rgb.min(axis=-1)) > 40).mean())


def test_crowns_are_drawn(tmp_path):
    write_map_image(small(), tmp_path / "map.png", title="Trees of $Oost$")
    bare = small()
    empty = TreeMap([], np.empty((0, 2)), np.empty((0, 2)), np.zeros(1, dtype=np.int64), {
        name: Figure(one.label, one.unit, np.empty(0)) for name, one in bare.figures.items()
    }, frames=bare.frames)  # fmt: skip
    write_map_image(empty, tmp_path / "empty.png")
    assert painted(tmp_path / "map.png") > painted(tmp_path / "empty.png") + 0.0005
    height, width, _ = pixels(tmp_path / "map.png").shape
    assert 700 < height < 3000
    assert 1000 < width < 2500


def test_many_trees_are_drawn_as_pixels(tmp_path, monkeypatch):
    draw, n = np.random.default_rng(0), 3000
    xy = draw.uniform(0, 2000, (n, 2)) + [121_000, 487_000]
    figures = {
        "height_m": Figure("height", "m", draw.uniform(2, 30, n)),
        "crown_diam_m": Figure("crown diameter", "m", np.full(n, 12.0)),
    }
    trees = TreeMap([], xy, np.empty((0, 2)), np.zeros(n + 1, dtype=np.int64), figures, total=n)
    monkeypatch.setattr(map_image, "MOST_CROWNS", 100)
    write_map_image(trees, tmp_path / "map.png")
    cover = n * np.pi * 36 / 2000**2
    assert painted(tmp_path / "map.png") == pytest.approx(cover * 0.8, abs=0.06)
