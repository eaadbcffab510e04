"""Pictures of bark and leaves that a person gives, small enough to be sent to a browser."""

from __future__ import annotations

import io

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from pipeline.errors import InputFormatError
from pipeline.formats import png

Pixels = NDArray[np.uint8]

MOST_PX = 1024
"""Of a side on the page; files keep the picture as it is."""
MOST_PIXELS = 64_000_000


def picture(path: str) -> Pixels | None:
    """Read a picture; None where no path is given.

    Returns
    -------
    (H, W, 4) array of uint8 or None
        Red, green, blue and opacity, the top row first, at most `MOST_PX` high and wide.

    Raises
    ------
    InputMissingError, InputFormatError
        If there is none, it is no PNG, or larger than a picture of bark can be.
    """
    if not path:
        return None
    content = png.read(path)
    with Image.open(io.BytesIO(content)) as image:
        if image.width * image.height > MOST_PIXELS:
            msg = f"{path}: has {image.width} x {image.height} pixels; make it smaller"
            raise InputFormatError(msg)
        whole = image.convert("RGBA")
    whole.thumbnail((MOST_PX, MOST_PX))
    return np.asarray(whole)
