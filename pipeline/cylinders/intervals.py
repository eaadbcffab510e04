"""How well the volume and the length of a fitted tree are known: 90 % intervals in closed form.

Volume, on a logarithmic scale. All wood is split by evidence (0 to 1, how much the points of a window look
like bark), node by node. Then

1. *structure*: wood that bark shows stands. For the rest there are two witnesses, the fitted radius and the
   pipe model scaled to the shown wood of the same tree. The interval reaches from the lesser to the greater
   of the two, and further the more they disagree: points of leaves and of bundled twigs are wider than wood.
2. *random*: a bias common to the whole tree (bark, trunks out of round), errors of shown radii (common to a
   branch, independent between branches), noise misjudged (it is taken off every squared radius, so all twigs
   err together, and more to the thick side) and wood that is not shown (one common error). They add in
   quadrature, and so does the error of the allometry where it gives the stem or where no bark shows at all.

Length. Every branch ends where its points do and the last are missing, so what is lost goes with the spacing
of points along each branch, and with the noise; where bark does not show, some wood may be false. Leaves
(standing or dropped) hide twigs: the length is then little more than a lower bound, and there may be as much
more as if every dropped point stood for as much length as a kept one.

The factors below make at least nine of ten intervals hold the truth on 310 trees of
`pipeline.synthetic.grow_tubes`: 4 to 20 m tall, of order 2 and 3, forked or not, twigs of 2 to 5 mm; 1,500 to
8,000 points on a square metre of bark, 2 to 12 mm noise, seen all round or from one side; and 40 points with
20 mm noise, as from the air. ``tests/benchmarks/intervals.py`` measures it on other seeds. What those trees
do not have is not calibrated: leaves, bark, occlusion, twigs shorter than 20 cm, and radii that stray far
from the pipe model. The allowances for leaves are judged, not measured; that for disagreement of the two
witnesses lets an urban scan whose crown shows no bark span what several programs make of it.

References
----------
Shinozaki et al. (1964), "A quantitative analysis of plant form: the pipe model theory".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.cylinders.allometry import LOG_ERROR, WITHIN_90
from pipeline.cylinders.habit import carried_length
from pipeline.cylinders.measured import Measured
from pipeline.geometry.axes import Axes
from pipeline.geometry.estimates import MOMENTS, NONE
from pipeline.model import ALLOMETRIC, TreeModel

Floats = NDArray[np.float64]

MICRO = 6  # decimals of the results
SLIMMEST_M = 0.001  # no wood is thinner
BARE = 0.01  # share of shown wood below which no radius is known better than by allometry


class Sides(NamedTuple):
    """A factor for the low and for the high side of an interval."""

    low: float
    high: float


# Shares of the volume, or logarithms of it, at 90 %.
COMMON = 0.005  # bark, trunks out of round
BRANCHES = 0.22  # of the standard error of shown radii: windows of a branch are partly independent
NOISE = Sides(0.35, 0.03)  # of the volume that the noise would make by itself
UNSHOWN = Sides(0.26, 0.18)  # relative error of wood that is not shown, common to all of it
DISPUTED = Sides(0.5, 0.2)  # how far beyond the two witnesses, as a share, where they disagree entirely
ALLOMETRY = WITHIN_90 * 2.0 * LOG_ERROR  # a volume goes with the diameter's square

# Logarithms of the length.
KEPT = 0.003  # wood that is false, at least
FALSE = 0.035  # share of the wood without bark that may be false
BEYOND = 2.2  # spacings of points along a branch that its end may lie beyond the last
BLURRED = 0.9  # a metre: of length lost a metre of noise
FEWEST_PER_M = 1.0  # points: branches that show fewer count as showing these
LEAFY = Sides(0.4, 0.4)  # leaves taken for twigs; twigs hidden by leaves

# Of the share of points that cleaning took for leaves: volume of the branches among them.
AMONG_LEAVES = 0.3


def intervals(
    tree: TreeModel, axes: Axes, measured: Measured, noise: float, *, leaves_dropped: int = 0
) -> dict[str, tuple[float, float]]:
    """Return the 90 % intervals of a tree's volume and length; they hold the tree's own figures.

    Parameters
    ----------
    tree : TreeModel
        The finished model, about whose volume and length the intervals lie.
    axes : Axes
        The dense axes that it was made from, with radii.
    measured : Measured
        Points by branch, windows, radii and crown.
    noise : float
        Range noise, metres.
    leaves_dropped : int
        Points that cleaning took for leaves.

    Returns
    -------
    dict
        ``volume_interval_l`` in litres and ``length_interval_m`` in metres: (low, high).
    """
    volume, length = 1000.0 * float(tree.volume.sum()), float(tree.skeleton.length.sum())
    step = _steps(axes)
    if not step.any():
        return {"volume_interval_l": (volume, volume), "length_interval_m": (length, length)}
    leaves = leaves_dropped / max(leaves_dropped + int(measured.shared.first[-1]), 1)
    return {
        "volume_interval_l": _about(volume, volume_sides(axes, measured, noise, leaves)),
        "length_interval_m": _about(length, length_sides(axes, measured, noise, leaves)),
    }


def volume_sides(axes: Axes, measured: Measured, noise: float, leaves: float) -> Sides:
    """Logarithms by which the volume may be less and more.

    Parameters
    ----------
    axes : Axes
    measured : Measured
    noise : float
        Range noise, metres.
    leaves : float
        Share of the points that cleaning took for leaves.
    """
    windows, radii, step = measured.windows, measured.radii, _steps(axes)
    radius = np.maximum(axes.radius, SLIMMEST_M)
    fitted = np.pi * step * radius**2
    total = float(fitted.sum())
    by_allometry = radii.source == ALLOMETRIC
    shown = np.where(by_allometry, 0.0, windows.evidence)
    sure = float((shown * fitted).sum()) / total
    least, most = _witnesses(fitted, np.pi * step * carried_length(axes), shown)
    dispute = (most - least) / max(most, 1e-12)
    least, most = least * (1.0 - DISPUTED.low * dispute), most * (1.0 + DISPUTED.high * dispute)

    of_radii = 2.0 * np.pi * step * radius * shown * np.where(np.isfinite(radii.error), radii.error, 0.0)
    branches = float(np.linalg.norm(np.bincount(axes.branch, of_radii))) / total
    taken_off = np.where(windows.kind == MOMENTS, 2.0, 1.0) * (windows.kind != NONE)
    blur = float(np.pi * noise**2 * (step * taken_off).sum()) / total
    allometry = ALLOMETRY if by_allometry.any() or sure < BARE else 0.0
    common = [COMMON, BRANCHES * branches, allometry]
    low = float(np.linalg.norm([*common, NOISE.low * blur, UNSHOWN.low * least / (sure + least)]))
    high = float(np.linalg.norm([*common, NOISE.high * blur, UNSHOWN.high * most / (sure + most)]))
    high = float(np.hypot(high, AMONG_LEAVES * leaves))
    return Sides(low - float(np.log(sure + least)), high + float(np.log(sure + most)))


def length_sides(axes: Axes, measured: Measured, noise: float, leaves: float) -> Sides:
    """Logarithms by which the length may be less and more.

    Parameters
    ----------
    axes : Axes
    measured : Measured
    noise : float
        Range noise, metres.
    leaves : float
        Share of the points that cleaning took for leaves.
    """
    step = _steps(axes)
    total = float(step.sum())
    per_metre = np.diff(measured.shared.first) / np.maximum(np.bincount(axes.branch, step), 1e-3)
    beyond = float((1.0 / np.maximum(per_metre, FEWEST_PER_M)).sum()) / total
    dubious = float((step * (1.0 - measured.windows.evidence)).sum()) / total
    leafy = LEAFY if measured.crown.leafy else Sides(0.0, 0.0)
    gone = -float(np.log1p(-min(leaves, 0.99)))  # as if leaves stood for as much length as wood does
    hidden = float(np.linalg.norm([BEYOND * beyond + BLURRED * noise, leafy.high, gone]))
    return Sides(KEPT + FALSE * dubious + leafy.low, hidden)


def _witnesses(fitted: Floats, pipe: Floats, shown: Floats) -> Sides:
    """Least and most wood that is not shown, as shares of all wood: the fit's and the pipe model's.

    The pipe model is scaled so that the shown wood has the fitted volume.
    """
    scale = float((shown * fitted).sum()) / max(float((shown * pipe).sum()), 1e-12)
    other = scale * pipe if scale > 0.0 else fitted
    rest = (1.0 - shown) / fitted.sum()
    return Sides(
        float((rest * np.minimum(fitted, other)).sum()), float((rest * np.maximum(fitted, other)).sum())
    )


def _steps(axes: Axes) -> Floats:
    """(M,) length of the segment that ends at each node, 0 at the foot of a branch."""
    step = np.linalg.norm(np.diff(axes.xyz, axis=0, prepend=axes.xyz[:1]), axis=1)
    step[axes.first[:-1]] = 0.0
    return np.asarray(step)


def _about(value: float, sides: Sides) -> tuple[float, float]:
    """Return the interval about a figure; neither side lies beyond it."""
    low, high = value * np.exp(-max(sides.low, 0.0)), value * np.exp(max(sides.high, 0.0))
    return round(float(low), MICRO), round(float(high), MICRO)
