"""From a problem to its best known branch system: the way that fits the number of leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.skeleton.minimal.attaching import attach_all, relax
from pipeline.skeleton.minimal.bounds import spanning_bound
from pipeline.skeleton.minimal.clusters import by_clusters
from pipeline.skeleton.minimal.exact import solve
from pipeline.skeleton.minimal.histories import all_histories
from pipeline.skeleton.minimal.problem import Problem, System
from pipeline.skeleton.minimal.search import Budget, search

MANY = 500  # leaves beyond which a problem is solved from coarse to fine
MOST_HISTORIES = 20_000  # of an integer program over all leaves; more of them take minutes


@dataclass(frozen=True, eq=False)
class Outcome:
    """A branch system to all leaves, and how good it is.

    Parameters
    ----------
    system : System
        Every leaf is reached, some of them at relaxed angles.
    strict : System
        The branches at the right angles alone, of which the other figures speak.
    bound_m : float
        No system that reaches these leaves at the right angles is shorter (metres, without the trunk).
    proven : bool
        Whether `strict` is known to be the best there is.
    """

    system: System
    strict: System
    bound_m: float
    proven: bool

    @property
    def length_over_bound(self) -> float:
        """Length over its bound, the trunk included: 1 for a system that is as short as can be."""
        trunk = float(self.system.problem.roots.length.sum())
        return (trunk + self.strict.total) / (trunk + self.bound_m)

    def __str__(self) -> str:
        """Say in a line how long it is, beside the least that it can be."""
        proven = "proven least" if self.proven else f"the least is {self.bound_m:.1f} m or more"
        relaxed = int((self.system.off_angle != 0.0).sum())
        return (
            f"{len(self.system.problem)} leaves, {relaxed} at relaxed angles; "
            f"{self.strict.total:.1f} m of branches, {proven}; length over bound {self.length_over_bound:.2f}"
        )

    def as_plain(self) -> dict[str, float | int | bool]:
        """Figures for the metadata: numbers of leaves, and lengths in metres."""
        off = self.system.off_angle
        return {
            "leaves": len(off),
            "relaxed": int((off != 0.0).sum()),
            "led_to_nearest": int(np.isnan(off).sum()),
            "trunk_m": float(self.system.problem.roots.length.sum()),
            "branches_m": self.strict.total,
            "relaxed_branches_m": self.system.total - self.strict.total,
            "bound_m": self.bound_m,
            "length_over_bound": self.length_over_bound,
            "proven": self.proven,
        }


def shortest(problem: Problem, budget: Budget, *, exact_leaves: int) -> Outcome:
    """Find a short branch system to all leaves, and the shortest where they are few.

    Parameters
    ----------
    problem : Problem
    budget : Budget
        Of the search.
    exact_leaves : int
        Most leaves for which the integer program over all histories is solved.
    """
    many = len(problem) > MANY
    system = by_clusters(problem, budget) if many else search(attach_all(problem), budget)
    bound, proven = spanning_bound(problem, system), False
    if len(problem) <= exact_leaves:
        histories = all_histories(problem, most=MOST_HISTORIES)
        if histories.whole:
            answer = solve(histories, system)
            system, proven = answer.system, answer.proven
            bound = max(answer.bound_m, bound) if not proven else system.total
    return Outcome(relax(system), system, min(bound, system.total), proven)
