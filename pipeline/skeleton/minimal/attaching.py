"""One branch after the other: the leaf that is hardest to reach first."""

from __future__ import annotations

import numpy as np

from pipeline.geometry.compiled import compiled
from pipeline.skeleton.minimal.geometry import branch_point, nearest_place, place_on
from pipeline.skeleton.minimal.problem import Floats, Ints, Mask, Problem, System

RELAXED_DEG = (5.0, -5.0, 10.0, -10.0, 15.0, -15.0, 20.0, -20.0)  # added to the insertion angle, in turn
SQUARE = np.radians(90.0)  # an insertion angle is relaxed up to here
LEAST = np.radians(1.0)

Tree = tuple[Floats, Floats, Floats, Ints]  # base, tip, beyond, order of all axes, the roots first


def attach_all(problem: Problem) -> System:
    """Reach the leaves greedily: again and again the one whose cheapest branch is the longest.

    Scaffolds so come before the twigs that they carry. Quadratic in the number of leaves. Leaves
    that no branch can reach at the right angle stay free.

    Parameters
    ----------
    problem : Problem
    """
    return attach_more(System.empty(problem))


def attach_more(system: System, off_angle_deg: float = 0.0) -> System:
    """Reach the free leaves of a system, at angles that are relaxed by `off_angle_deg`.

    Parameters
    ----------
    system : System
    off_angle_deg : float
        Added to every insertion angle, degrees; NaN leads every leaf to the nearest place of any axis
        whatever the angle, the nearest leaf first.
    """
    problem, first = system.problem, len(system.problem.roots)
    roots, anyhow = problem.roots, bool(np.isnan(off_angle_deg))
    tree = (
        np.vstack([roots.base, system.base]),
        np.vstack([roots.tip, problem.leaves]),
        np.concatenate([roots.beyond, np.zeros(len(problem))]),
        np.concatenate([roots.order, system.order]),
    )
    change = 0.0 if anyhow else np.radians(off_angle_deg)
    insertion = np.clip(problem.insertion + change, LEAST, max(SQUARE, problem.insertion.max()))
    mother, length = system.mother.copy(), system.length.copy()
    off = np.where(system.free, off_angle_deg, system.off_angle)
    _attach(tree, first, insertion, anyhow, (mother, length))
    off[mother < 0] = 0.0
    return System(problem, mother, tree[0][first:], length, tree[3][first:], off)


def relax(system: System) -> System:
    """Reach the leaves that are left: at angles up to 20 degrees off, the rest wherever is nearest."""
    for change in (*RELAXED_DEG, np.nan):
        if not system.free.any():
            break
        system = attach_more(system, change)
    return system


@compiled
def _attach(tree: Tree, first: int, insertion: Floats, anyhow: bool, held: tuple[Ints, Floats]) -> None:
    mother, length = held
    free = mother < 0
    best = np.full(len(mother), np.inf)
    place = np.zeros(len(mother))
    via = np.full(len(mother), -1, dtype=np.int64)
    for axis in range(first + len(mother)):
        if axis < first or not free[axis - first]:
            _offer(axis, tree, first, insertion, anyhow, (free, best, place, via))
    while True:
        chosen = -1
        for i in range(len(mother)):
            if not free[i] or best[i] == np.inf:
                continue
            if chosen < 0 or (best[i] < best[chosen] if anyhow else best[i] > best[chosen]):
                chosen = i
        if chosen < 0:
            break
        base, tip, _, order = tree
        axis = via[chosen]
        base[first + chosen] = place_on(base[axis], tip[axis], place[chosen])
        order[first + chosen] = order[axis] + 1
        mother[chosen], length[chosen], free[chosen] = axis, best[chosen], False
        _offer(first + chosen, tree, first, insertion, anyhow, (free, best, place, via))


@compiled
def _offer(
    axis: int,
    tree: Tree,
    first: int,
    insertion: Floats,
    anyhow: bool,
    offers: tuple[Mask, Floats, Floats, Ints],
) -> None:
    """Let an axis offer itself to every free leaf."""
    base, tip, beyond, order = tree
    free, best, place, via = offers
    angle = insertion[min(order[axis], len(insertion) - 1)]
    for i in range(len(free)):
        if free[i]:
            if anyhow:
                s, c = nearest_place(tip[first + i], base[axis], tip[axis])
            else:
                s, c = branch_point(tip[first + i], base[axis], tip[axis], beyond[axis], angle)
            if c < best[i]:
                best[i], place[i], via[i] = c, s, axis
