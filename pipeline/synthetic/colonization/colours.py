"""The colours to choose from, as red, green and blue from 0 to 255."""

from __future__ import annotations

from pipeline.synthetic.colonization.options import LeafColour, StemColour

RGB = tuple[int, int, int]

STEM_COLOURS: dict[StemColour, RGB] = {
    "brown": (102, 76, 51),
    "dark-brown": (66, 48, 34),
    "light-brown": (139, 110, 78),
    "grey": (128, 124, 117),
    "grey-brown": (104, 94, 82),
}
LEAF_COLOURS: dict[LeafColour, RGB] = {
    "green": (72, 112, 44),
    "dark-green": (38, 74, 34),
    "light-green": (124, 160, 68),
    "yellow-green": (160, 170, 60),
    "olive": (104, 108, 52),
    "yellow": (208, 178, 52),
    "orange": (204, 120, 40),
    "red": (170, 54, 36),
    "crimson": (120, 28, 44),
    "pink": (226, 160, 178),
}
