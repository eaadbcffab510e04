"""Averages of moves: k-means of sub-trees without forks, by how far a rule would draw their nodes off.

Headings are averaged on the sphere. Angles could not be: 350 and 10 degrees lie around 0, and a turtle
past the vertical has other angles for the same heading.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.lsystem.transforms.moves import Moves, drawing, seeing, squared_distances, steps_drawn
from pipeline.model import Floats

Nodes = NDArray[np.int64]

ROUNDS = 8
"""Rounds of k-means; later ones change little."""
SAME_M2 = 1e-12
"""Mean square distance below which no more averages are needed."""
_ROLLS = np.deg2rad(np.array(sorted(range(-179, 181), key=lambda degree: (abs(degree), -degree))))
"""Where the search for a roll begins: every degree, the smallest turns first."""


class Average(NamedTuple):
    """Averages of R clusters of tails with K steps.

    Parameters
    ----------
    draw : (R, K, 6) array of float64
        As in `Moves`.
    angle : (R, K, 2) array of float64
        Rotation and roll, summed since the foot, in radians.
    length : (R, K) array of float64
        Metres.
    """

    draw: Floats
    angle: Floats
    length: Floats


def clustered(seen: Moves, length: Floats, rules: int, seed: int) -> tuple[Nodes, Average]:
    """Part tails of one length by k-means: every tail goes to the rule that draws its nodes the closest."""
    theirs = seeing(seen).reshape(-1, len(length))
    cluster = _first_guess(seen.draw, theirs, rules, seed)
    fit = fitted(seen, length, cluster)
    for _ in range(ROUNDS if cluster.any() else 0):
        nearest = _errors(fit.draw, theirs).argmin(axis=0)
        nearest = np.unique(nearest, return_inverse=True)[1]
        if np.array_equal(nearest, cluster):
            break
        cluster = nearest
        fit = fitted(seen, length, cluster)
    return cluster, fit


def _errors(draw: Floats, theirs: Floats) -> Floats:
    """Return the (R, M) sums of squares of all nodes of M tails under R rules."""
    ours = np.moveaxis(drawing(draw), 0, 1)
    return squared_distances(ours.reshape(len(ours), -1), theirs)


def _first_guess(draw: Floats, theirs: Floats, rules: int, seed: int) -> Nodes:
    """Choose members as first averages, those far from all before more likely (k-means++)."""
    random = np.random.default_rng(seed)
    cluster = np.zeros(len(draw), dtype=np.int64)
    error = np.full(len(draw), np.inf)
    pick = int(random.integers(len(draw)))
    for k in range(min(rules, len(draw)) if rules > 1 else 0):
        mine = _errors(draw[pick : pick + 1], theirs)[0]
        cluster[mine < error] = k
        error = np.minimum(mine, error)
        total = np.cumsum(error)
        if total[-1] <= SAME_M2 * len(draw):
            break
        pick = min(int(np.searchsorted(total, random.random() * total[-1], side="right")), len(draw) - 1)
    return np.unique(cluster, return_inverse=True)[1]


def fitted(seen: Moves, length: Floats, cluster: Nodes) -> Average:
    """Fit the average move of every cluster: step by step the heading, and the mean length."""
    groups = int(cluster.max()) + 1
    members = np.bincount(cluster)
    c, s = np.cos(seen.rot), np.sin(seen.rot)
    draw, angle = np.zeros((groups, length.shape[1], 6)), np.zeros((groups, length.shape[1], 2))
    mean = np.stack([np.bincount(cluster, column) / members for column in length.T], axis=1)
    at, drawn = np.zeros((len(cluster), 3)), np.zeros((groups, 6))
    for step in range(length.shape[1]):
        x, y, z = (seen.place[:, step] - at).T
        wish = (c * x, c * y, -s * x, -s * y, -s * z, -c * z)
        angle[:, step] = best_turns(np.array([np.bincount(cluster, part) for part in wish]))
        drawn = drawn + steps_drawn(angle[:, step, 0], angle[:, step, 1], mean[:, step])
        draw[:, step] = drawn
        at = seen.place[:, step]
    return Average(draw, angle, mean)


def best_turns(wish: Floats) -> Floats:
    """Find the rotation and the roll whose headings come closest to what is wanted, in all clusters.

    The sum over a cluster of heading times step is ``p cos(rotation) + q sin(rotation)``, where p and q
    are ``x cos(roll) + y sin(roll) + z`` with the cluster's own sums for x, y, z. So the rotation
    follows from the roll, and the roll is where ``p^2 + q^2`` is largest: the best whole degree (of
    equals the smallest), then Newton's method.

    Parameters
    ----------
    wish : (6, R) array of float64
        The sums x, y of p, x, y of q, z of p, z of q.

    Returns
    -------
    (R, 2) array of float64
        Rotation and roll in radians.
    """
    level, up = wish[:4].reshape(2, 2, -1), wish[4:]
    grid = np.einsum("pdr,dg->prg", level, np.stack([np.cos(_ROLLS), np.sin(_ROLLS)])) + up[..., None]
    fit = (grid**2).sum(axis=0)
    best = fit.max(axis=1)
    roll = _ROLLS[(fit >= best[:, None] * (1 - 1e-9)).argmax(axis=1)]
    for _ in range(5):
        ahead, aside = level[:, 0] * np.cos(roll), level[:, 1] * np.sin(roll)
        across = level[:, 1] * np.cos(roll) - level[:, 0] * np.sin(roll)
        slope = ((ahead + aside + up) * across).sum(axis=0)
        bend = (across**2 - (ahead + aside + up) * (ahead + aside)).sum(axis=0)
        step = np.divide(slope, bend, out=np.zeros_like(roll), where=bend < -1e-9 * best)
        roll = roll - np.clip(step, -np.pi / 360, np.pi / 360)
    p, q = level[:, 0] * np.cos(roll) + level[:, 1] * np.sin(roll) + up
    return np.stack([np.arctan2(q, p), roll], axis=1)
