"""Pictures of bark and of leaves, painted from a seed, and the look of a tree."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from pipeline.formats import png
from pipeline.mesh.look import Look
from pipeline.model import Floats
from pipeline.synthetic.colonization.colours import LEAF_COLOURS, RGB, STEM_COLOURS
from pipeline.synthetic.colonization.options import ColonizationOptions

BARK_STREAM, LEAF_STREAM = 3, 4
SIDE_PX = 128
WAVES = 60
BLADES = 9  # leaves on the picture of a spray


def look_of(options: ColonizationOptions) -> Look:
    """Return colours and pictures of a tree: pictures of yours where the options name some.

    Raises
    ------
    InputMissingError, InputFormatError
        If a picture that is named is not there or is no PNG.
    """
    stem, leaf = STEM_COLOURS[options.stem_colour], LEAF_COLOURS[options.leaf_colour]
    mine = options.bark_picture, options.leaf_picture
    bark_png = png.read(mine[0]) if mine[0] else png.packed(bark_picture(stem, options.seed))
    if mine[1]:
        leaf_png = png.read(mine[1])
    else:
        holes = options.leaf_type != "triangle"
        leaf_png = png.packed(leaf_picture(leaf, options.seed, holes=holes))
    return Look(_shares(stem), _shares(leaf), bark_png, leaf_png)


def bark_picture(colour: RGB, seed: int) -> NDArray[np.uint8]:
    """(H, W, 3) fissured bark that goes on beyond all four edges."""
    random = np.random.default_rng([seed, BARK_STREAM])
    relief = _waves(random, (12, 4))
    ridge = 1.0 - np.abs(relief)
    return _shaded(colour, 0.55 + 0.5 * ridge + 0.1 * _waves(random, (30, 30)))


def leaf_picture(colour: RGB, seed: int, *, holes: bool) -> NDArray[np.uint8]:
    """(H, W, 4) a spray of leaves along a midrib from the middle of the lower edge, with nothing between.

    Without `holes` it is all leaf.
    """
    random = np.random.default_rng([seed, LEAF_STREAM])
    y, x = np.mgrid[SIDE_PX:0:-1, 0:SIDE_PX] / SIDE_PX
    light = 0.85 + 0.2 * _waves(random, (8, 8))
    opaque = np.abs(x - 0.5) < 0.012
    for k in range(BLADES):
        side = 0.0 if k == BLADES - 1 else (-1.0) ** k * random.uniform(0.8, 1.1)
        foot = 0.08 + 0.6 * k / (BLADES - 1)
        along = (x - 0.5) * np.sin(side) + (y - foot) * np.cos(side)
        across = (x - 0.5) * np.cos(side) - (y - foot) * np.sin(side)
        half = 0.09 * np.sin(np.pi * np.clip(along / 0.34, 0, 1)) ** 0.8
        inside = np.abs(across) < half
        light = np.where(inside, random.uniform(0.8, 1.15) - 0.25 * (np.abs(across) < 0.006), light)
        opaque |= inside
    shown = np.where(opaque | (not holes), 255, 0).astype(np.uint8)
    return np.dstack([_shaded(colour, light), shown])


def _waves(random: Generator, most: tuple[int, int]) -> Floats:
    """(H, W) a mixture of whole waves, at most so many across and up, of deviation about 1/2."""
    y, x = np.mgrid[0:SIDE_PX, 0:SIDE_PX] * (2 * np.pi / SIDE_PX)
    across, up = random.integers(-most[0], most[0] + 1, WAVES), random.integers(-most[1], most[1] + 1, WAVES)
    phase = random.uniform(0, 2 * np.pi, WAVES)
    total = np.zeros((SIDE_PX, SIDE_PX))
    for k in range(WAVES):
        total += np.sin(across[k] * x + up[k] * y + phase[k])
    return np.asarray(total / np.sqrt(2 * WAVES))


def _shaded(colour: RGB, light: Floats) -> NDArray[np.uint8]:
    return np.clip(np.round(np.array(colour) * light[:, :, None]), 0, 255).astype(np.uint8)


def _shares(colour: RGB) -> tuple[float, float, float]:
    red, green, blue = colour
    return red / 255, green / 255, blue / 255
