"""Quick search: a few neighbouring leaves are taken off and put back in another order."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from pipeline.geometry.compiled import compiled
from pipeline.skeleton.minimal.attaching import Offers, Tree, offer_all, take, tree_of
from pipeline.skeleton.minimal.problem import Floats, Ints, System

NEAR = 40  # neighbours among which the leaves of a bunch are
BUNCH = (3, 16)  # least and largest bunch
SPREAD = 0.5  # of the logarithm of the weights by which the order differs from the greedy one
SAME = 1e-9  # metres within which two lengths are the same


def reattach(system: System, *, rounds: int, seed: int) -> System:
    """Make a system shorter by taking bunches off and putting them back.

    Every round takes off leaves around another one, with all that hangs on their branches, and
    attaches them again as the greedy way does, but in an order that chance changes. What reaches
    fewer leaves or is longer is undone.

    Parameters
    ----------
    system : System
        At the right angles alone.
    rounds : int
    seed : int

    Returns
    -------
    System
        Never worse than the one given.

    References
    ----------
    Schrimpf, Schneider, Stamm-Wilbrandt & Dueck (2000), "Record breaking optimization results using
    the ruin and recreate principle", Journal of Computational Physics 159, 139-171.
    """
    problem, first = system.problem, len(system.problem.roots)
    if len(problem) < 2 or rounds <= 0:
        return system
    rng = np.random.default_rng(seed)
    near = cKDTree(problem.leaves).query(problem.leaves, k=min(NEAR, len(problem)))[1]
    draws = (
        rng.integers(len(problem), size=rounds),
        rng.integers(BUNCH[0], BUNCH[1] + 1, size=rounds),
        np.exp(SPREAD * rng.standard_normal((rounds, BUNCH[1]))),
    )
    tree, mother, length = tree_of(system, problem.insertion), system.mother.copy(), system.length.copy()
    _reattach(tree, near.reshape(len(problem), -1).astype(np.int64), draws, (mother, length))
    return System(problem, mother, tree[0][first:], length, tree[3][first:], np.zeros(len(problem)))


@compiled
def _reattach(tree: Tree, near: Ints, draws: tuple[Ints, Ints, Floats], held: tuple[Ints, Floats]) -> None:
    base, _, _, order, _ = tree
    mother, length = held
    first = len(base) - len(mother)
    free = mother < 0
    best, place, via = np.empty(len(mother)), np.zeros(len(mother)), np.full(len(mother), -1, dtype=np.int64)
    offers = (free, best, place, via)
    old_base = np.empty((draws[2].shape[1], 3))
    for r in range(len(draws[0])):
        bunch = _bunch(near[draws[0][r]], draws[1][r], first, mother)
        old_mother, old_length, old_order = mother[bunch], length[bunch], order[first + bunch]
        for k in range(len(bunch)):
            old_base[k] = base[first + bunch[k]]
        free[bunch], mother[bunch], length[bunch] = True, -1, 0.0
        _put_back(bunch, draws[2][r], tree, offers, held)
        lost = np.sum(mother[bunch] < 0) - np.sum(old_mother < 0)
        if lost > 0 or (lost == 0 and length[bunch].sum() > old_length.sum() + SAME):
            mother[bunch], length[bunch], order[first + bunch] = old_mother, old_length, old_order
            free[bunch] = old_mother < 0
            for k in range(len(bunch)):
                base[first + bunch[k]] = old_base[k]


@compiled
def _bunch(near: Ints, most: int, first: int, mother: Ints) -> Ints:
    """Return neighbours of a leaf with all that hangs on their branches, whole subtrees only."""
    held = np.empty(most, dtype=np.int64)
    count = 0
    for leaf in near:
        known = False
        for k in range(count):
            known |= held[k] == leaf
        if known:
            continue
        end, at, fits = count, count, count < most
        if fits:
            held[end] = leaf
            end += 1
        while fits and at < end:
            for i in range(len(mother)):
                if mother[i] == first + held[at]:
                    known = False
                    for k in range(count):
                        known |= held[k] == i
                    if known:
                        continue
                    if end == most:
                        fits = False
                        break
                    held[end] = i
                    end += 1
            at += 1
        if fits:
            count = end
        if count == most:
            break
    return held[:count]


@compiled
def _put_back(bunch: Ints, weight: Floats, tree: Tree, offers: Offers, held: tuple[Ints, Floats]) -> None:
    """Attach the leaves of a bunch, the weightiest costs first."""
    free, best, _, _ = offers
    best[bunch] = np.inf
    offer_all(bunch, tree, offers)
    for _ in range(len(bunch)):
        chosen, most = -1, -1.0
        for k in range(len(bunch)):
            i = bunch[k]
            if free[i] and best[i] < np.inf and best[i] * weight[k] > most:
                chosen, most = i, best[i] * weight[k]
        if chosen < 0:
            break
        take(chosen, bunch, tree, offers, held)
