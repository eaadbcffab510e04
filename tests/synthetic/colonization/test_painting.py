"""Pictures of bark and leaves: of the colour asked for, repeatable, and without edges."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from pipeline.synthetic.colonization import ColonizationOptions, grow, look_of
from pipeline.synthetic.colonization.colours import STEM_COLOURS
from pipeline.synthetic.colonization.painting import bark_picture, leaf_picture


@pytest.mark.parametrize("name", STEM_COLOURS)
def test_bark_has_its_colour_and_goes_on_beyond_its_edges(name):
    pixels = bark_picture(STEM_COLOURS[name], 1).astype(float)
    np.testing.assert_allclose(pixels.mean(axis=(0, 1)), STEM_COLOURS[name], rtol=0.25)
    for axis in (0, 1):
        steps = np.abs(np.diff(pixels, axis=axis)).mean(axis=(1 - axis, 2))
        over = np.abs(pixels.take(0, axis) - pixels.take(-1, axis)).mean()
        assert over < 2 * steps.max()


def test_the_same_seed_gives_the_same_pictures():
    one, two, other = (look_of(ColonizationOptions(seed=seed)) for seed in (1, 1, 2))
    assert one == two
    assert one.bark_png != other.bark_png


def test_pictures_decode_and_leaves_have_holes():
    look = look_of(ColonizationOptions())
    assert look.bark_png is not None
    assert look.leaf_png is not None
    assert Image.open(io.BytesIO(look.bark_png)).mode == "RGB"
    opaque = np.array(Image.open(io.BytesIO(look.leaf_png)))[:, :, 3]
    assert 0.1 < (opaque == 255).mean() < 0.9
    assert leaf_picture((1, 2, 3), 1, holes=False)[:, :, 3].min() == 255


@pytest.mark.parametrize("seed", [0, 29, 30, 51, 58])
def test_a_low_density_at_the_beginning_still_makes_a_tree(seed):
    colony, _ = grow(ColonizationOptions(seed=seed))
    assert len(colony.xyz) > 300
    assert colony.reason == "max_iter"
