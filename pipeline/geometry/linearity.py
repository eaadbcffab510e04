"""What a cloud shows: surfaces where it is dense, lines where it is leafless."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.voxels import ball_moments, first_in_cell

Floats = NDArray[np.float64]

DENSE_M = 0.07  # median distance of neighbouring points up to which they show the surface of the wood
LEAFY = 0.27  # share of linear neighbourhoods below which leaves hide the wood
FILLED = 0.57  # share of filled neighbourhoods above which they do

BALLS_M = (0.1, 0.2)
THINNED_M = 0.02
LINE = 0.7  # (largest - middle) / largest eigenvalue of the points in a ball, from which it is a line
THICK = 0.1  # smallest / largest eigenvalue, the noise taken off, from which points fill a ball
LEAST_POINTS, LEAST_BALLS = 5, 200
CROWN = 0.4  # the crown is what lies above this share of the height
STEM, LEAST_STEM = 0.1, 50  # below this share bark shows the noise, if it has so many balls
BARK = 0.25  # the thinnest quarter of these balls are bark, even where leaves hang to the ground


def is_leafy(xyz: Floats) -> bool:
    """Whether leaves hide the wood; a cloud too small to tell counts as leafless.

    Leaves that wrap whole limbs leave few neighbourhoods of the crown that are lines; leaves along
    bare twigs leave lines to see from afar, but fill what surrounds them more than noise does.

    Parameters
    ----------
    xyz : (P, 3) array
        A cleaned tree, metres.
    """
    near, wide = neighbourhoods(xyz)
    lines = [share.line for share in (near, wide) if share is not None]
    return bool(lines) and (max(lines) < LEAFY or (near is not None and near.filled > FILLED))


class Share(NamedTuple):
    """Shares of the crown's neighbourhoods.

    Attributes
    ----------
    line : float
        Those that are lines.
    filled : float
        Those that are not, and that points fill in all three directions beyond the noise.
    """

    line: float
    filled: float


def neighbourhoods(xyz: Floats) -> tuple[Share | None, Share | None]:
    """Shares of lines and of filled balls in the crown, at 10 and at 20 cm.

    Of terrestrial and mobile scans, leafless ones have 0.35 to 0.7 lines at the better of the two
    scales, and at 10 cm up to 0.35 filled balls (0.45 where twigs hang in curtains). Of those in
    leaf, the lines are 0.11 to 0.18 or the filled balls 0.7 to 0.88.

    Parameters
    ----------
    xyz : (P, 3) array
        A cleaned tree, metres.

    Returns
    -------
    near, wide : Share or None
        None where there are too few neighbourhoods to tell.

    References
    ----------
    Demantke et al. (2011) for the eigenvalue features. Changed: the square of the noise, as the
    bark near the foot shows it, is taken off the smallest.
    """
    thin = xyz[first_in_cell(xyz, THINNED_M)]
    near, wide = (_share(thin, radius) for radius in BALLS_M)
    return near, wide


def _share(thin: Floats, radius: float) -> Share | None:
    support = thin[first_in_cell(thin, radius / 8)]
    count, _, covariance = ball_moments(support, radius)
    full = count >= LEAST_POINTS
    foot, top = thin[:, 2].min(), thin[:, 2].max()
    height = (support[full, 2] - foot) / max(top - foot, 1e-9)
    crown = height > CROWN
    if np.count_nonzero(crown) < LEAST_BALLS:
        return None
    spread = np.maximum(np.linalg.eigvalsh(covariance[full]), 1e-12)
    bark = spread[height < STEM, 0]
    noise = np.quantile(bark, BARK) if len(bark) >= LEAST_STEM else 0.0
    small, middle, large = spread[crown].T
    line = (large - middle) / large > LINE
    filled = ~line & ((small - noise) / large > THICK)
    return Share(float(np.mean(line)), float(np.mean(filled)))
