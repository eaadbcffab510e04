"""`Look`: the colours of bark and leaves, and the pictures on them."""

from __future__ import annotations

from typing import NamedTuple

from pipeline.mesh.triangles import BARK_RGB, LEAF_RGB

RGB = tuple[float, float, float]


class Look(NamedTuple):
    """What a tree looks like.

    Attributes
    ----------
    bark, leaf : (float, float, float)
        Colours, red, green and blue from 0 to 1.
    bark_png, leaf_png : bytes or None
        Pictures, whole PNG files; where there is one it bears the colour. That of a leaf may have holes.
    """

    bark: RGB = BARK_RGB
    leaf: RGB = LEAF_RGB
    bark_png: bytes | None = None
    leaf_png: bytes | None = None


PLAIN = Look()
