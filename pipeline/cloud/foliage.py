"""Whether points that no line of wood explains stand among others, as leaves do, or by themselves."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.cloud.leaves import NEIGHBOURS, LeafOptions, smoothed_scores, thinned_for_lines
from pipeline.geometry.linearity import CROWN, LEAST_BALLS, STEM
from pipeline.geometry.voxels import ball_moments, first_in_cell

Floats = NDArray[np.float64]

FOLIAGE = 0.27  # share of the crown's points from which foliage hides wood; bare crowns have up to 0.16
NOT_LOOSE = 3.0  # times as many as stand by themselves; thinly scanned twigs have up to 2, leaves 4 and more
LONE = 0.3  # evidence for and against a line, in nats a cell, between which a point lies in foliage
FINE_CELLS = 2.0  # cells of leaf_cell_m; where points lie farther apart, twigs have gaps as foliage has
BARK_BALL_M = 0.04  # bark is flat to within its noise in a ball so small
LEAST_IN_BALL, LEAST_BARK = 10, 50
BARK = 0.05  # the flattest twentieth of these balls is bark, even where leaves hang to the ground
MOST_NOISE_M = 0.006  # they show less than ranges have; with 15 mm in these, bare twigs look like foliage


def stands_in_foliage(xyz: Floats, *, options: LeafOptions | None = None) -> bool:
    """Whether much of the crown lies in foliage, as lines show it.

    Wood fills a line and leaves its surroundings empty. A point that no such line passes either
    stands by itself, where twigs are thinly scanned, or among others all around: in foliage. That
    tells leaves that hang in sleeves along twigs, whose neighbourhoods look flat or long from near.

    Parameters
    ----------
    xyz : (P, 3) array
        A cleaned tree without ground, in canonical order, metres.
    options : LeafOptions, optional

    Returns
    -------
    bool
        False where the points are too few, too far apart or too noisy to tell.
    """
    options = options or LeafOptions()
    if len(xyz) <= NEIGHBOURS:
        return False
    cell, few, _ = thinned_for_lines(xyz, options.leaf_cell_m)
    height = (few[:, 2] - few[:, 2].min()) / max(float(np.ptp(few[:, 2])), 1e-9)
    crown = height > CROWN
    if cell > FINE_CELLS * options.leaf_cell_m or np.count_nonzero(crown) < LEAST_BALLS:
        return False
    if bark_noise(xyz) > MOST_NOISE_M:
        return False
    near = cKDTree(few).query(few, k=NEIGHBOURS + 1)[1][:, 1:]
    score = smoothed_scores(few, near, cell)[crown]
    foliage, loose = float(np.mean(np.abs(score) < LONE)), float(np.mean(score <= -LONE))
    return foliage > max(FOLIAGE, NOT_LOOSE * loose)


def bark_noise(xyz: Floats) -> float:
    """Return how rough the bark near the foot is, metres; infinite where too few points show it.

    Parameters
    ----------
    xyz : (P, 3) array
        A cleaned tree without ground, metres.
    """
    low = xyz[xyz[:, 2] < xyz[:, 2].min() + STEM * np.ptp(xyz[:, 2])]
    support = low[first_in_cell(low, BARK_BALL_M / 4)]
    count, _, covariance = ball_moments(support, BARK_BALL_M)
    full = count >= LEAST_IN_BALL
    if np.count_nonzero(full) < LEAST_BARK:
        return float("inf")
    flat = np.quantile(np.linalg.eigvalsh(covariance[full])[:, 0], BARK)
    return float(np.sqrt(max(flat, 0.0)))
