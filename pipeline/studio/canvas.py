"""What the pictures of all tabs begin with: a plotter that never renders, under one sky."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import pyvista as pv

from pipeline.view.graphics import NoGraphicsError, prepare

SKY, HORIZON = "#dfe7ee", "#f7f7f4"


def empty_plotter() -> Any:
    """Return a plotter that holds nothing yet; the browser draws what is put into it."""
    with suppress(NoGraphicsError):  # nothing is drawn here, so that none is needed
        prepare()
    make: Any = pv.Plotter
    plotter = make(off_screen=True)
    plotter.set_background(HORIZON, top=SKY)
    return plotter
