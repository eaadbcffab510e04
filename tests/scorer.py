"""Recall, precision, volumes and diameter of a model against known truth, as the benchmarks use them."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from pipeline.geometry.surface import Tubes, nearest_tube

STEP_M, NEAR_M = 0.02, 0.05


def axis_points(start, end):
    """Points every 2 cm along axes, and the axis that each belongs to."""
    count = np.maximum(1, np.ceil(np.linalg.norm(end - start, axis=1) / STEP_M)).astype(int)
    owner = np.repeat(np.arange(len(start)), count)
    number = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return start[owner] + (end - start)[owner] * ((number + 0.5) / count[owner])[:, None], owner


def score(tree, truth, points=None):
    """Compare a TreeModel with truth arrays s, e, r, order, branch (world coordinates).

    Where points of the scan are given, `above` is their mean distance from the model's surface less that
    from the true one, in millimetres.
    """
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
        "ratio": stout(graph.branch[1:], np.maximum(tree.start_radius, tree.radius)[1:], graph.length[1:])
        / stout(truth["branch"], truth["r"], true_length),
    } | ({} if points is None else {"above": above(tree, truth, points)})


def stout(branch, radius, length):
    """Number of branches of at least 1 cm of radius and 10 cm of length."""
    thickest, total = np.zeros(branch.max() + 1), np.bincount(branch, length)
    np.maximum.at(thickest, branch, radius)
    return int(((thickest >= 0.01) & (total >= 0.10)).sum())


def above(tree, truth, points):
    """Mean distance of points from the model's surface less that from the true one, millimetres."""
    graph = tree.skeleton
    mine = Tubes(graph.world[graph.parent[1:]], graph.world[1:], tree.start_radius[1:], tree.radius[1:])
    true = Tubes(truth["s"], truth["e"], truth["r"], truth["r"])
    gaps = [np.abs(nearest_tube(points, tubes).surface).mean() for tubes in (mine, true)]
    return 1000.0 * (gaps[0] - gaps[1])


def true_diameter(truth):
    """Diameter 1.3 m above the foot of the true stem, metres; not of an end that hangs down to there."""
    stem = truth["order"] == 0
    height = truth["s"][stem, 2].min() + 1.3
    low, high = truth["s"][stem, 2], truth["e"][stem, 2]
    hit = (np.minimum(low, high) <= height) & (np.maximum(low, high) > height)
    return 2 * truth["r"][stem][hit].max()
