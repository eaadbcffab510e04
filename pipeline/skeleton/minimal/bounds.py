"""How short a branch system can be at all, where the integer program is too large to say."""

from __future__ import annotations

import numpy as np
from scipy.spatial.distance import cdist

from pipeline.geometry.compiled import compiled
from pipeline.skeleton.minimal.problem import Axes, Floats, Problem, System

STEINER = 0.615  # least length of a Steiner tree in units of the minimum spanning tree, in any dimension
TINY_M = 1e-12  # of a squared length that is divided by


def spanning_bound(problem: Problem, reached: System) -> float:
    """Least length of any tree that joins the reached leaves and the root axes.

    The larger of two bounds: 0.615 of the spanning tree of leaves and the axes' ends, less the axes;
    and half of the spanning tree in which the axes are one place. Weak (the optimum is 1.5 to 2 times as
    long), for it knows neither angles nor apical dominance.

    Parameters
    ----------
    problem : Problem
    reached : System
        Says which leaves count.

    Returns
    -------
    float
        Length of branches, the root axes not included, metres.

    References
    ----------
    Du (1991), "On Steiner ratio conjectures", Annals of Operations Research 33, 437-449.
    """
    leaves, roots = problem.leaves[~reached.free], problem.roots
    if not len(leaves):
        return 0.0
    ends = np.vstack([roots.base[:1], roots.tip])
    both = np.vstack([ends, leaves])
    free = _spanning(cdist(both, both))
    gap = np.zeros((len(leaves) + 1, len(leaves) + 1))
    gap[1:, 1:] = cdist(leaves, leaves)
    gap[0, 1:] = gap[1:, 0] = _off_roots(leaves, roots)
    return max(STEINER * free - float(roots.length.sum()), 0.5 * _spanning(gap), 0.0)


def _off_roots(leaves: Floats, roots: Axes) -> Floats:
    """(m,) distance of every leaf from the nearest root axis, metres."""
    along = roots.tip - roots.base
    off = leaves[:, None] - roots.base
    share = np.clip((off * along).sum(axis=2) / np.maximum(roots.length**2, TINY_M), 0.0, 1.0)
    return np.asarray(np.linalg.norm(off - share[..., None] * along, axis=2).min(axis=1))


@compiled
def _spanning(gap: Floats) -> float:
    """Length of the minimum spanning tree of a matrix of distances, by Prim's way."""
    waiting, away, total = np.ones(len(gap), dtype=np.bool_), gap[0].copy(), 0.0
    waiting[0] = False
    for _ in range(1, len(gap)):
        near, least = -1, np.inf
        for i in range(len(gap)):
            if waiting[i] and away[i] < least:
                near, least = i, away[i]
        waiting[near] = False
        total += least
        away = np.minimum(away, gap[near])
    return total
