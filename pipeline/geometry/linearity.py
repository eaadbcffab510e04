"""What a cloud shows: surfaces where it is dense, lines where it is leafless."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.voxels import ball_moments, first_in_cell

Floats = NDArray[np.float64]

DENSE_M = 0.07  # median distance of neighbouring points up to which they show the surface of the wood
LEAFY = 0.27  # share of linear neighbourhoods below which leaves hide the wood

BALLS_M = (0.1, 0.2)
THINNED_M = 0.02
LINE = 0.7  # (largest - middle) / largest eigenvalue of the points in a ball, from which it is a line
LEAST_POINTS, LEAST_BALLS = 5, 200
CROWN = 0.4  # the crown is what lies above this share of the height


def linear_share(xyz: Floats) -> float | None:
    """Share of the crown's neighbourhoods that are lines, at the scale where it is largest.

    Of eleven terrestrial and mobile scans, the eight leafless ones have 0.35 to 0.7, the three in leaf
    0.11 to 0.18.

    Parameters
    ----------
    xyz : (P, 3) array
        A cleaned tree, metres.

    Returns
    -------
    float or None
        None where there are too few neighbourhoods to tell.

    References
    ----------
    Demantke et al. (2011) for the eigenvalue features.
    """
    thin = xyz[first_in_cell(xyz, THINNED_M)]
    foot, top = thin[:, 2].min(), thin[:, 2].max()
    crown = thin[thin[:, 2] > foot + CROWN * (top - foot)]
    shares = []
    for radius in BALLS_M:
        support = crown[first_in_cell(crown, radius / 8)]
        count, _, covariance = ball_moments(support, radius)
        full = count >= LEAST_POINTS
        if np.count_nonzero(full) < LEAST_BALLS:
            continue
        spread = np.linalg.eigvalsh(covariance[full])
        line = (spread[:, 2] - spread[:, 1]) / np.maximum(spread[:, 2], 1e-12)
        shares.append(float(np.mean(line > LINE)))
    return max(shares, default=None)


def is_leafy(xyz: Floats) -> bool:
    """Whether leaves hide the wood; a cloud too small to tell counts as leafless.

    Parameters
    ----------
    xyz : (P, 3) array
        A cleaned tree, metres.
    """
    share = linear_share(xyz)
    return share is not None and share < LEAFY
