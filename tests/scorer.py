"""Recall, precision, volumes and diameter of a model against known truth, as the benchmarks use them."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

STEP_M, NEAR_M = 0.02, 0.05


def axis_points(start, end):
    """Points every 2 cm along axes, and the axis that each belongs to."""
    count = np.maximum(1, np.ceil(np.linalg.norm(end - start, axis=1) / STEP_M)).astype(int)
    owner = np.repeat(np.arange(len(start)), count)
    number = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return start[owner] + (end - start)[owner] * ((number + 0.5) / count[owner])[:, None], owner


def score(tree, truth):
    """Compare a TreeModel with truth arrays s, e, r, order (world coordinates)."""
    graph = tree.skeleton
    start, end = graph.world[graph.parent[1:]], graph.world[1:]
    known, which = axis_points(truth["s"], truth["e"])
    model, mine = axis_points(start, end)
    gap, at = cKDTree(model).query(known)
    found = gap < NEAR_M
    true_length = np.linalg.norm(truth["e"] - truth["s"], axis=1)
    volume, true_volume = tree.volume, np.pi * truth["r"] ** 2 * true_length
    side, true_side = graph.order > 0, truth["order"] > 0
    return {
        "recall": found.mean(),
        "precision": (cKDTree(known).query(model)[0] < NEAR_M).mean(),
        "order": (graph.order[1:][mine][at][found] == truth["order"][which][found]).mean(),
        "volume": volume.sum() / true_volume.sum() - 1,
        "branches": volume[side].sum() / true_volume[true_side].sum() - 1,
        "length": graph.length.sum() / true_length.sum() - 1,
        "dbh": tree.trunk.dbh_m / true_diameter(truth) - 1,
    }


def true_diameter(truth):
    """Diameter 1.3 m above the foot of the true stem, metres."""
    stem = truth["order"] == 0
    height = truth["s"][stem, 2].min() + 1.3
    low, high = truth["s"][stem, 2], truth["e"][stem, 2]
    hit = (np.minimum(low, high) <= height) & (np.maximum(low, high) > height)
    return 2 * truth["r"][stem][hit].mean()
