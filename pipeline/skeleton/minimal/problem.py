"""What is asked (leaves, axes that stand, angles) and an answer to it (a mother for every leaf)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

FREE = -1  # the mother of a leaf that no branch reaches


@dataclass(frozen=True, eq=False)
class Axes:
    """Straight pieces that branches may leave.

    Parameters
    ----------
    base, tip : (R, 3) arrays
        Metres.
    order : (R,) array of int
        Branch order, 0 on the trunk.
    beyond : (R,) array
        Length by which the branch goes on past the piece's tip, metres.
    """

    base: Floats
    tip: Floats
    order: Ints
    beyond: Floats

    def __len__(self) -> int:
        return len(self.base)

    @cached_property
    def length(self) -> Floats:
        """(R,) length of every piece, metres."""
        return np.asarray(np.linalg.norm(self.tip - self.base, axis=1))

    @classmethod
    def trunk(cls, line: Floats) -> Axes:
        """Make the trunk of a (M, 3) line from its foot to the tree's top."""
        size = np.linalg.norm(np.diff(line, axis=0), axis=1)
        beyond = np.append(np.cumsum(size[:0:-1])[::-1], 0.0)
        return cls(line[:-1], line[1:], np.zeros(len(size), dtype=np.int64), beyond)

    def joined(self, other: Axes) -> Axes:
        """These axes and then the others."""
        return Axes(
            np.vstack([self.base, other.base]),
            np.vstack([self.tip, other.tip]),
            np.concatenate([self.order, other.order]),
            np.concatenate([self.beyond, other.beyond]),
        )


@dataclass(frozen=True, eq=False)
class Problem:
    """Leaves to reach from axes that stand.

    Parameters
    ----------
    leaves : (m, 3) array
        Metres.
    roots : Axes
        The trunk; in a part of a larger problem also the branches that stay.
    insertion : (K,) array
        Insertion angle of branches of order 1, 2, ..., K and beyond, radians.
    """

    leaves: Floats
    roots: Axes
    insertion: Floats

    def __len__(self) -> int:
        return len(self.leaves)

    def part(self, leaves: Ints, roots: Axes) -> Problem:
        """Ask the same of some of the leaves and other axes."""
        return Problem(self.leaves[leaves], roots, self.insertion)


@dataclass(frozen=True, eq=False)
class System:
    """A branch system: one straight branch to every leaf that is reached.

    Parameters
    ----------
    problem : Problem
    mother : (m,) array of int
        Root axis r as r, the branch of leaf j as R + j, `FREE` where the leaf is not reached.
    base : (m, 3) array
        Where every branch leaves its mother, metres.
    length : (m,) array
        Of every branch, metres; 0 where there is none.
    order : (m,) array of int
        Of every branch; 0 where there is none.
    off_angle : (m,) array
        By how much the insertion angle is relaxed, degrees; NaN where the leaf was led to the
        nearest place whatever the angle.
    """

    problem: Problem
    mother: Ints
    base: Floats
    length: Floats
    order: Ints
    off_angle: Floats

    @classmethod
    def empty(cls, problem: Problem) -> System:
        """No leaf reached yet."""
        m = len(problem)
        return cls(
            problem,
            np.full(m, FREE, dtype=np.int64),
            problem.leaves.copy(),
            np.zeros(m),
            np.zeros(m, dtype=np.int64),
            np.zeros(m),
        )

    @cached_property
    def free(self) -> Mask:
        """(m,) leaves that no branch reaches."""
        return np.asarray(self.mother == FREE)

    @cached_property
    def total(self) -> float:
        """Length of all branches, the root axes not included, metres."""
        return float(self.length.sum())

    @cached_property
    def worth(self) -> tuple[int, float]:
        """What is to be made least: first the leaves that are not reached, then the length."""
        return int(self.free.sum()), self.total

    def better_than(self, other: System, margin_m: float = 1e-7) -> bool:
        """Whether more leaves are reached, or as many by at least `margin_m` less length."""
        mine, theirs = self.worth, other.worth
        return mine[0] < theirs[0] or (mine[0] == theirs[0] and mine[1] < theirs[1] - margin_m)

    def axes(self, leaves: Ints) -> Axes:
        """The branches of some leaves, as axes that others may leave."""
        tips = self.problem.leaves[leaves]
        return Axes(self.base[leaves], tips, self.order[leaves], np.zeros(len(leaves)))

    @cached_property
    def subtrees(self) -> tuple[tuple[int, ...], ...]:
        """For every leaf: itself and all leaves whose branches hang on its branch."""
        first, mother = len(self.problem.roots), self.mother.tolist()
        below: list[list[int]] = [[] for _ in mother]
        for i, j in enumerate(mother):
            if j >= first:
                below[j - first].append(i)
        out: list[tuple[int, ...]] = []
        for i in range(len(mother)):
            held = [i]
            for j in held:  # grows while it is walked
                held.extend(below[j])
            out.append(tuple(held))
        return tuple(out)

    def cut(self, leaves: Ints, problem: Problem) -> System:
        """The branches of some leaves by themselves.

        Their mothers are not named: all that counts is whether they are reached, and the lengths.

        Parameters
        ----------
        leaves : (k,) array of int
        problem : Problem
            The same leaves with all other branches as root axes.
        """
        mother = np.where(self.free[leaves], FREE, 0)
        held = (self.base[leaves], self.length[leaves], self.order[leaves], self.off_angle[leaves])
        return System(problem, mother, *held)

    def with_part(self, leaves: Ints, outside: Ints, part: System) -> System:
        """Put in the branches of some leaves.

        Parameters
        ----------
        leaves : (k,) array of int
            Leaves of this system that `part` holds.
        outside : (q,) array of int
            Leaves whose branches are the root axes of `part` after this system's own root axes.
        part : System
        """
        first = len(self.problem.roots)
        names = np.concatenate([np.arange(first), first + outside, first + leaves, [FREE]])
        mother, base, length = self.mother.copy(), self.base.copy(), self.length.copy()
        order, off = self.order.copy(), self.off_angle.copy()
        mother[leaves] = names[part.mother]  # the last name answers for FREE
        base[leaves], length[leaves] = part.base, part.length
        order[leaves], off[leaves] = part.order, part.off_angle
        return System(self.problem, mother, base, length, order, off)
