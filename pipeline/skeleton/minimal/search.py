"""Large-neighbourhood search: a bunch of leaves is freed and solved exactly, the rest stays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.skeleton.minimal.exact import solve
from pipeline.skeleton.minimal.histories import all_histories
from pipeline.skeleton.minimal.problem import Ints, System
from pipeline.skeleton.minimal.reattaching import reattach

BUNCH = 25  # leaves that are freed together; more of them take HiGHS disproportionately longer
CHOICES = 12  # places on branches that stay, for every freed leaf; 30 bring nothing more
MOST = 20_000  # histories of a bunch
NODES = 200  # of HiGHS' search tree for a bunch


@dataclass(frozen=True)
class Budget:
    """How long to search, in steps that do not depend on the machine.

    Parameters
    ----------
    per_leaf : int
        Rounds of the quick search for every leaf.
    bunches : int
        Bunches that integer programs solve after that.
    seed : int
        Of both.
    """

    per_leaf: int
    bunches: int
    seed: int = 0

    def halves(self) -> tuple[Budget, Budget]:
        """Split the bunches between a scaffold and the whole; the quick search goes with the leaves."""
        half = self.bunches // 2
        return Budget(self.per_leaf, half, self.seed), Budget(self.per_leaf, self.bunches - half, self.seed)


def search(system: System, budget: Budget) -> System:
    """Make a system shorter: quickly, then bunch by bunch as far as the budget goes.

    Parameters
    ----------
    system : System
        At the right angles alone.
    budget : Budget
    """
    quick = reattach(system, rounds=budget.per_leaf * len(system.problem), seed=budget.seed)
    return improve(quick, rounds=budget.bunches, seed=budget.seed)


def improve(system: System, *, rounds: int, seed: int) -> System:
    """Make a system shorter, bunch by bunch.

    Every round frees the leaves around another one, whole subtrees only, and puts back the best
    that the integer program finds for them. It ends early when every leaf has had its round and
    none brought anything.

    Parameters
    ----------
    system : System
    rounds : int
        Most bunches to solve.
    seed : int
        Of the order in which leaves have their rounds.

    Returns
    -------
    System
        Never worse than the one given.
    """
    rng = np.random.default_rng(seed)
    waiting: list[int] = []
    idle: set[tuple[int, ...]] = set()  # bunches that brought nothing since the last change
    since = 0
    while rounds > 0 and since <= len(system.problem):
        if not waiting:
            waiting = rng.permutation(len(system.problem)).tolist()
        bunch = _bunch(system, waiting.pop()) if waiting else ()
        since += 1
        if not bunch or bunch in idle:
            continue
        rounds -= 1
        better = _solved(system, np.array(bunch))
        if better is system:
            idle.add(bunch)
            continue
        system, since = better, 0
        idle.clear()
    return system


def _bunch(system: System, seed: int) -> tuple[int, ...]:
    """Leaves near one of them, with all that hangs on their branches; ascending."""
    leaves = system.problem.leaves
    near = np.argsort(((leaves - leaves[seed]) ** 2).sum(axis=1), kind="stable")
    held: set[int] = set()
    for leaf in near[: 4 * BUNCH].tolist():
        more = held.union(system.subtrees[leaf])
        if len(more) <= BUNCH:
            held = more
    return tuple(sorted(held))


def _solved(system: System, bunch: Ints) -> System:
    """Solve a bunch with the rest fixed; the same system where that brings nothing."""
    stays = ~system.free
    stays[bunch] = False
    outside = np.flatnonzero(stays)
    problem = system.problem.part(bunch, system.problem.roots.joined(system.axes(outside)))
    known = system.cut(bunch, problem)
    answer = solve(all_histories(problem, most=MOST, choices=CHOICES), known, nodes=NODES)
    return system if answer.system is known else system.with_part(bunch, outside, answer.system)
