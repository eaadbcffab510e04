"""One branch after the other: the leaf that is hardest to reach first."""

from __future__ import annotations

import numpy as np

from pipeline.geometry.compiled import compiled
from pipeline.skeleton.minimal.geometry import branch_on, direction, nearest_place, place_on
from pipeline.skeleton.minimal.problem import Floats, Ints, Mask, Problem, System

RELAXED_DEG = (5.0, -5.0, 10.0, -10.0, 15.0, -15.0, 20.0, -20.0)  # added to the insertion angle, in turn
SQUARE = np.radians(90.0)  # an insertion angle is relaxed up to here
LEAST = np.radians(1.0)

Tree = tuple[Floats, Floats, Floats, Ints, Floats]  # base, tip, beyond, order of all axes, roots first; turns
Offers = tuple[Mask, Floats, Floats, Ints]  # of every leaf: free, least length, place on the axis, the axis


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
    problem = system.problem
    change = np.radians(np.nan_to_num(off_angle_deg))
    insertion = np.clip(problem.insertion + change, LEAST, max(SQUARE, problem.insertion.max()))
    tree = tree_of(system, insertion[: 0 if np.isnan(off_angle_deg) else None])
    mother, length = system.mother.copy(), system.length.copy()
    off = np.where(system.free, off_angle_deg, system.off_angle)
    _attach(tree, (mother, length))
    off[mother < 0] = 0.0
    first = len(problem.roots)
    return System(problem, mother, tree[0][first:], length, tree[3][first:], off)


def relax(system: System) -> System:
    """Reach the leaves that are left: at angles up to 20 degrees off, the rest wherever is nearest."""
    for change in (*RELAXED_DEG, np.nan):
        if not system.free.any():
            break
        system = attach_more(system, change)
    return system


def tree_of(system: System, insertion: Floats) -> Tree:
    """All axes of a system, the roots and then a branch per leaf, as new arrays; what insertion angles mean.

    Without angles leaves are led to the nearest place.
    """
    roots, leaves = system.problem.roots, system.problem.leaves
    return (
        np.vstack([roots.base, system.base]),
        np.vstack([roots.tip, leaves]),
        np.concatenate([roots.beyond, np.zeros(len(leaves))]),
        np.concatenate([roots.order, system.order]),
        np.column_stack([np.cos(insertion), np.sin(insertion)]),
    )


@compiled
def _attach(tree: Tree, held: tuple[Ints, Floats]) -> None:
    mother, anyhow = held[0], len(tree[4]) == 0
    free, best = mother < 0, np.full(len(mother), np.inf)
    offers = (free, best, np.zeros(len(mother)), np.full(len(mother), -1, dtype=np.int64))
    everyone = np.arange(len(mother))
    offer_all(everyone, tree, offers)
    while True:
        chosen = -1
        for i in range(len(mother)):
            if not free[i] or best[i] == np.inf:
                continue
            if chosen < 0 or (best[i] < best[chosen] if anyhow else best[i] > best[chosen]):
                chosen = i
        if chosen < 0:
            break
        take(chosen, everyone, tree, offers, held)


@compiled
def take(leaf: int, leaves: Ints, tree: Tree, offers: Offers, held: tuple[Ints, Floats]) -> None:
    """Lead a branch to a leaf from the best place that it was offered, and offer it to some leaves."""
    base, tip, _, order, _ = tree
    free, best, place, via = offers
    mother, length = held
    axis, mine = via[leaf], len(base) - len(free) + leaf
    base[mine] = place_on(base[axis], tip[axis], place[leaf])
    order[mine] = order[axis] + 1
    mother[leaf], length[leaf], free[leaf] = axis, best[leaf], False
    _offer(mine, leaves, tree, offers)


@compiled
def offer_all(leaves: Ints, tree: Tree, offers: Offers) -> None:
    """Let all axes that stand offer themselves to those of some leaves that are free."""
    free, first = offers[0], len(tree[0]) - len(offers[0])
    for axis in range(len(tree[0])):
        if axis < first or not free[axis - first]:
            _offer(axis, leaves, tree, offers)


@compiled
def _offer(axis: int, leaves: Ints, tree: Tree, offers: Offers) -> None:
    base, tip, beyond, order, turns = tree
    free, best, place, via = offers
    first = len(base) - len(free)
    way, turned = direction(base[axis], tip[axis]), (0.0, 1.0)
    if len(turns):
        row = turns[min(order[axis], len(turns) - 1)]
        turned = (row[0], row[1])
    for i in leaves:
        if not free[i]:
            continue
        if len(turns):
            s, c = branch_on(tip[first + i], base[axis], way, beyond[axis], turned, best[i])
        else:
            s, c = nearest_place(tip[first + i], base[axis], tip[axis])
        if c < best[i]:
            best[i], place[i], via[i] = c, s, axis
