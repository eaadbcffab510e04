"""The least total length by an integer program over all histories."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, linprog, milp
from scipy.sparse import csr_array

from pipeline.skeleton.minimal.histories import Histories
from pipeline.skeleton.minimal.problem import Floats, Ints, Mask, System

SLACK_M = 1e-6  # a system that is not better by more than that is as good
NODES = 2000  # of HiGHS' search tree; a limit of time would make results differ


@dataclass(frozen=True, eq=False)
class Answer:
    """What the integer program found.

    Parameters
    ----------
    system : System
        The best system, never worse than the one that was known before.
    bound_m : float
        No system that reaches as many leaves is shorter, metres.
    proven : bool
        Whether `system` is as good as it gets.
    """

    system: System
    bound_m: float
    proven: bool


def solve(histories: Histories, known: System, *, nodes: int = NODES) -> Answer:
    """Choose compatible histories that reach the most leaves by the least length.

    One binary per history. The chosen histories of a leaf, and a slack at a prohibitive price, add
    up to one. Those of one leaf that run through one mother's history are at most as many as that
    is chosen: tighter than daughter by daughter. The relaxed program's reduced costs then show which
    histories no system has that beats the known one; they go before whole numbers are asked for.

    Parameters
    ----------
    histories : Histories
    known : System
        Any system of the same problem.
    nodes : int
        Limit of HiGHS' search tree.

    Returns
    -------
    Answer
        Proven and bounded with regard to the given histories only.

    References
    ----------
    HiGHS: Huangfu & Hall (2018), "Parallelizing the dual revised simplex method", Mathematical
    Programming Computation 10, 119-142.
    """
    if not len(known.problem):
        return Answer(known, 0.0, True)
    program = _Program(histories, known)
    relaxed = linprog(
        program.cost,
        A_ub=program.below if program.below.shape[0] else None,
        b_ub=np.zeros(program.below.shape[0]) if program.below.shape[0] else None,
        A_eq=program.once,
        b_eq=np.ones(program.once.shape[0]),
        bounds=(0.0, 1.0),
        method="highs-ds",
    )
    if relaxed.status != 0:
        return Answer(known, 0.0, False)
    if relaxed.fun > program.known - SLACK_M:
        return Answer(known, known.total, True)
    if _is_whole(relaxed.x):
        return program.answer(relaxed.x, relaxed.fun, True)
    useful = relaxed.lower.marginals <= program.known - relaxed.fun + SLACK_M
    useful[len(histories) :] = True
    done = milp(
        program.cost,
        integrality=np.ones(len(program.cost)),
        bounds=Bounds(0.0, useful.astype(np.float64)),
        constraints=[
            LinearConstraint(program.once, 1.0, 1.0),
            LinearConstraint(program.below, -np.inf, 0.0),
        ],
        options={"node_limit": nodes, "mip_rel_gap": 0.0},
    )
    bound = max(relaxed.fun, done.mip_dual_bound if done.mip_dual_bound is not None else -np.inf)
    if done.x is None:
        return Answer(known, program.length_bound(bound), False)
    return program.answer(done.x, bound, done.status == 0)


class _Program:
    """Costs and constraints; histories first, then a slack for every leaf."""

    def __init__(self, histories: Histories, known: System) -> None:
        self.histories, self.system = histories, known
        count, leaves = len(histories), len(known.problem)
        longest = float(histories.length.max(initial=0.0))
        self.price = 1.0 + max(leaves * longest, known.total)
        self.cost = np.concatenate([histories.length, np.full(leaves, self.price)])
        self.known = known.worth[0] * self.price + known.total
        rows = np.concatenate([histories.leaf, np.arange(leaves)])
        columns = np.arange(count + leaves)
        self.once = csr_array((np.ones(len(rows)), (rows, columns)), shape=(leaves, count + leaves))
        self.below = self._below()

    def _below(self) -> csr_array:
        """Rows of (mother's history, leaf): the leaf's histories through it less it itself."""
        daughter, mother = _lines(self.histories.above)
        leaves = len(self.system.problem)
        pairs, row = np.unique(mother * leaves + self.histories.leaf[daughter], return_inverse=True)
        row = row.ravel()
        rows = np.concatenate([row, np.arange(len(pairs))])
        columns = np.concatenate([daughter, pairs // leaves])
        values = np.concatenate([np.ones(len(row)), -np.ones(len(pairs))])
        return csr_array((values, (rows, columns)), shape=(len(pairs), len(self.cost)))

    def length_bound(self, bound: float) -> float:
        """Least length of systems that reach as many leaves as the known one."""
        return max(bound - self.system.worth[0] * self.price, 0.0)

    def answer(self, x: Floats, bound: float, proven: bool) -> Answer:
        """Read the program's solution."""
        chosen = np.flatnonzero(x[: len(self.histories)] > 0.5)
        system = self.histories.system(self.system.problem, chosen)
        best = system if system.better_than(self.system, SLACK_M) else self.system
        least = bound - best.worth[0] * self.price
        return Answer(best, best.total if proven else min(max(least, 0.0), best.total), proven)


def _is_whole(x: Floats) -> bool:
    return bool(np.abs(x - np.round(x)).max(initial=0.0) < 1e-6)


def _lines(above: Ints) -> tuple[Ints, Ints]:
    """Every pair of a history and one that it runs through."""
    daughter = np.arange(len(above))
    mother = above
    found: list[tuple[Ints, Ints]] = []
    while len(daughter):
        inside: Mask = mother >= 0
        daughter, mother = daughter[inside], mother[inside]
        found.append((daughter, mother))
        mother = above[mother]
    both = [np.concatenate(columns) for columns in zip(*found, strict=True)] or [above[:0], above[:0]]
    return both[0], both[1]
