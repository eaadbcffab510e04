"""Where bark shows in a tree whose leaves were dropped: from each foot on, as far as cylinders hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.axes import Axes
from pipeline.geometry.estimates import CYLINDER, NONE
from pipeline.geometry.windows import Windows

EVEN = 0.5  # evidence that speaks neither for bark nor against it
LEAST_NODES, LEAST_GAIN = 3, 1.0  # what it takes: a leaf or two may pass for bark by chance


def shown_bark(axes: Axes, windows: Windows) -> NDArray[np.bool_]:
    """(M,) nodes whose window is bark, and not what leaves are left around a twig.

    The leaves that stay lie as near to a twig as the search for lines lets them: their distance is
    that search's, not the wood's. Cylinders alone can tell, and by chance some fit a sleeve of leaves.
    So a branch is believed from its foot up to where the sum of the evidence, less a half each, is
    largest.

    Parameters
    ----------
    axes : Axes
    windows : Windows
    """
    fitted = windows.kind == CYLINDER
    gain = np.where(windows.kind == NONE, 0.0, np.where(fitted, windows.evidence, 0.0) - EVEN)
    out = np.zeros(len(gain), dtype=bool)
    for low, high in zip(axes.first[:-1], axes.first[1:], strict=True):
        total = np.cumsum(gain[low:high])
        best = int(np.argmax(total))
        if best >= LEAST_NODES and total[best] > LEAST_GAIN:
            out[low : low + best + 1] = True
    return np.asarray(out & fitted)


def bark_only(windows: Windows, axes: Axes) -> Windows:
    """Windows of a tree in leaf, with no evidence where no bark shows."""
    return replace(windows, evidence=np.where(shown_bark(axes, windows), windows.evidence, 0.0))
