"""What the fit knows of a tree beside its axes, and the warnings that follow from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.cylinders.crown import Crown
from pipeline.cylinders.radii import Radii
from pipeline.geometry.axes import Axes
from pipeline.geometry.estimates import CYLINDER
from pipeline.geometry.windows import Shared, Windows
from pipeline.model import MEASURED

ONE_SIDE = np.radians(240.0)
FORK_M = 1.3


@dataclass(frozen=True, eq=False)
class Measured:
    """Points by branch, the last windows, and the radii.

    Parameters
    ----------
    shared : Shared
    windows : Windows
    radii : Radii
    crown : Crown
    """

    shared: Shared
    windows: Windows
    radii: Radii
    crown: Crown


def flags(axes: Axes, measured: Measured, ground_z: float) -> tuple[str, ...]:
    """Warnings about a tree, sorted.

    Parameters
    ----------
    axes : Axes
        With the final radii.
    measured : Measured
    ground_z : float
        Height of the ground, relative to the origin.
    """
    stem = np.arange(int(axes.first[0]), int(axes.first[1]))
    seen = stem[measured.radii.source[stem] == MEASURED]
    fitted = seen[measured.windows.kind[seen] == CYLINDER]
    found = []
    if not len(seen):
        found.append("no_trunk")
    if len(fitted) and np.median(measured.windows.arc[fitted]) < ONE_SIDE:
        found.append("one_sided")
    if measured.crown.sparse:
        found.append("sparse")
    if measured.crown.leafy:
        found.append("leafy")
    if _forked_low(axes, ground_z):
        found.append("several_stems")
    return tuple(sorted(found))


def _forked_low(axes: Axes, ground_z: float) -> bool:
    """Whether a limb as stout as half the stem leaves it below breast height and grows up high."""
    tall = float(axes.xyz[:, 2].max() - ground_z)
    for b in range(1, len(axes.foot)):
        low, high = int(axes.first[b]), int(axes.first[b + 1])
        foot = int(axes.foot[b])
        on_stem = axes.first[0] <= foot < axes.first[1]
        if not on_stem or axes.xyz[foot, 2] - ground_z > FORK_M:
            continue
        stout = axes.radius[min(low + 1, high - 1)] > 0.5 * axes.radius[foot]
        if stout and axes.xyz[low:high, 2].max() - ground_z > 0.5 * tall:
            return True
    return False
