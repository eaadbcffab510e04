"""Many leaves: first one leaf of every cluster, then all the others on the axes that stand by then."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from pipeline.geometry.voxels import cell_means
from pipeline.skeleton.minimal.attaching import attach_all, attach_more
from pipeline.skeleton.minimal.problem import Floats, Ints, Problem, System
from pipeline.skeleton.minimal.search import Budget, search

CLUSTERS = 400  # at most
WIDER = 1.15  # step of the cells' sides


def by_clusters(problem: Problem, budget: Budget) -> System:
    """Solve a large problem from coarse to fine.

    The leaves in the middle of grid cells make the scaffold, which the search shortens while it is
    small. Then the other leaves join greedily, and the search goes on: each bunch is solved with all
    other branches as mothers that stand.

    Parameters
    ----------
    problem : Problem
    budget : Budget
        Of the search; half of its bunches go to the scaffold.

    Returns
    -------
    System
        Never worse than the greedy one.
    """
    middle = middles(problem.leaves)
    few = problem.part(middle, problem.roots)
    first, then = budget.halves()
    scaffold = search(attach_all(few), first)
    system = attach_more(System.empty(problem).with_part(middle, middle[:0], scaffold))
    greedy = attach_all(problem)
    best = system if system.better_than(greedy) else greedy
    return search(best, then)


def middles(leaves: Floats) -> Ints:
    """Leaves nearest to the means of grid cells, ascending; the cells grow until they are few.

    Parameters
    ----------
    leaves : (m, 3) array
    """
    side = float(np.ptp(leaves, axis=0).max()) / CLUSTERS
    mean = cell_means(leaves, side)
    while len(mean) > CLUSTERS:
        side *= WIDER
        mean = cell_means(leaves, side)
    return np.unique(cKDTree(leaves).query(mean)[1])
