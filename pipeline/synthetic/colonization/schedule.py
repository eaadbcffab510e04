"""How the distance within which a branch uses up free space changes while a tree grows."""

from __future__ import annotations

import numpy as np

from pipeline.model import Floats
from pipeline.synthetic.colonization.options import GrowthOptions


def influence(gnarliness: float) -> float:
    """Return how far a tip sees free space, metres."""
    return 0.5 + 0.8 * (1.0 - gnarliness)


def kill_limits(gnarliness: float) -> tuple[float, float]:
    """Return the kill distance at densities 1 and 0, metres; both stay below `influence`."""
    return 0.05 + 0.05 * (1.0 - gnarliness), 0.4125 + (1.25 - 0.4125) * (1.0 - gnarliness)


def kill_distances(options: GrowthOptions) -> Floats:
    """(I,) the kill distance at every iteration, metres."""
    least, most = kill_limits(options.gnarliness)
    power = 2 if options.kill_interpolation == "squared" else 1
    begin, end = (
        most**power - density * (most**power - least**power)
        for density in (options.density_begin, options.density_end)
    )
    window = (options.sigmoid_from, options.sigmoid_to)
    return np.asarray(sigmoid_steps(begin, end, options.iterations, window) ** (1.0 / power))


def sigmoid_steps(begin: float, end: float, count: int, window: tuple[float, float]) -> Floats:
    """Go from one value to another along a window of the sigmoid function.

    Parameters
    ----------
    begin, end : float
        The values before and after; reached where the window is wide.
    count : int
        How many values.
    window : (float, float)
        Where the sigmoid is entered and left.

    Examples
    --------
    >>> sigmoid_steps(2.0, 1.2, 30, (-8.0, 8.0))[[0, 14, 29]].round(4)
    array([1.9997, 1.6548, 1.2003])
    """
    x = np.linspace(*window, count) if count > 1 else np.full(count, window[0])
    return np.asarray(begin - (begin - end) / (1.0 + np.exp(-x)))
