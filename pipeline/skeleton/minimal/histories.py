"""All ways in which leaves can be reached: the trie of histories.

A history of a leaf names the leaf, its mother's leaf, and so on down to a root axis; it fixes where
every branch on the way stands. A set of histories is a branch system if it holds every mother's
history with the daughter's, and one history a leaf at most.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pipeline.geometry.compiled import compiled
from pipeline.skeleton.minimal.geometry import branch_on, direction, place_on, turn
from pipeline.skeleton.minimal.problem import Floats, Ints, Mask, Problem, System


@dataclass(frozen=True, eq=False)
class Histories:
    """The trie, mothers before daughters.

    Parameters
    ----------
    leaf : (H,) array of int
        The leaf that each history reaches.
    above : (H,) array of int
        The mother's history, -1 where the mother is a root axis.
    root : (H,) array of int
        The root axis at the end of each history.
    base : (H, 3) array
        Where the branch leaves its mother, metres.
    length, order : (H,) arrays
        Of the branch.
    whole : bool
        Whether these are all histories that there are.
    """

    leaf: Ints
    above: Ints
    root: Ints
    base: Floats
    length: Floats
    order: Ints
    whole: bool

    def __len__(self) -> int:
        return len(self.leaf)

    def system(self, problem: Problem, chosen: Ints) -> System:
        """Make a branch system of compatible histories."""
        empty, leaf = System.empty(problem), self.leaf[chosen]
        mother = np.where(
            self.above[chosen] < 0,
            self.root[chosen],
            len(problem.roots) + self.leaf[np.maximum(self.above[chosen], 0)],
        )
        empty.mother[leaf], empty.base[leaf] = mother, self.base[chosen]
        empty.length[leaf], empty.order[leaf] = self.length[chosen], self.order[chosen]
        return empty


def all_histories(problem: Problem, *, most: int, choices: int | None = None) -> Histories:
    """Enumerate the histories, level by level.

    Parameters
    ----------
    problem : Problem
    most : int
        The level that would bring more histories than that is left out, with all beyond it.
    choices : int, optional
        Most places on root axes where a leaf's branch may start, the cheapest ones; None for all.
    """
    roots = problem.roots
    leaf, root, base, length = _on_roots(
        problem.leaves, (roots.base, roots.tip, roots.beyond, roots.order), problem.insertion
    )
    kept = np.arange(len(leaf)) if choices is None else _cheapest(leaf, length, choices)
    kept, whole = kept[:most], len(kept) == len(leaf) <= most
    count, complete, columns = _on_each_other(
        problem.leaves,
        (leaf[kept], root[kept], base[kept], length[kept], roots.order[root[kept]] + 1),
        problem.insertion,
        max(most, len(kept)),
    )
    leaf, above, root, base, length, order = columns
    return Histories(
        leaf[:count],
        above[:count],
        root[:count],
        base[:count],
        length[:count],
        order[:count],
        whole and complete,
    )


def _cheapest(leaf: Ints, length: Floats, most: int) -> Ints:
    """Positions of the cheapest histories of every leaf, at most so many each."""
    order = np.lexsort((length, leaf))
    start = np.searchsorted(leaf[order], leaf[order], side="left")
    return np.sort(order[np.arange(len(leaf)) - start < most])


@compiled
def _on_roots(
    leaves: Floats, roots: tuple[Floats, Floats, Floats, Ints], insertion: Floats
) -> tuple[Ints, Ints, Floats, Floats]:
    """Histories of one step: leaf, root axis, base and length of each."""
    base, tip, beyond, order = roots
    room = len(leaves) * len(base)
    leaf, root = np.empty(room, dtype=np.int64), np.empty(room, dtype=np.int64)
    start, length = np.empty((room, 3)), np.empty(room)
    count = 0
    for i in range(len(leaves)):
        for r in range(len(base)):
            turned = turn(insertion[min(order[r], len(insertion) - 1)])
            s, c = branch_on(leaves[i], base[r], direction(base[r], tip[r]), beyond[r], turned, np.inf)
            if c < np.inf:
                leaf[count], root[count], length[count] = i, r, c
                start[count] = place_on(base[r], tip[r], s)
                count += 1
    return leaf[:count], root[:count], start[:count], length[:count]


@compiled
def _on_each_other(
    leaves: Floats, first: tuple[Ints, Ints, Floats, Floats, Ints], insertion: Floats, most: int
) -> tuple[int, bool, tuple[Ints, Ints, Ints, Floats, Floats, Ints]]:
    """Histories of all steps, given those of one: their number, whether that is all, and the columns."""
    leaf, above, root = np.empty(most, np.int64), np.full(most, -1, np.int64), np.empty(most, np.int64)
    base, length, order = np.empty((most, 3)), np.empty(most), np.empty(most, np.int64)
    begin, end = 0, len(first[0])
    leaf[:end], root[:end], base[:end], length[:end], order[:end] = first
    columns = (leaf, above, root, base, length, order)
    taken = np.zeros(len(leaves), dtype=np.bool_)
    while begin < end:
        count = end
        for h in range(begin, end):
            turned = turn(insertion[min(order[h], len(insertion) - 1)])
            way = direction(base[h], leaves[leaf[h]])
            _mark(h, leaf, above, taken, True)
            for i in range(len(leaves)):
                if taken[i]:
                    continue
                s, c = branch_on(leaves[i], base[h], way, 0.0, turned, np.inf)
                if c == np.inf:
                    continue
                if count == most:
                    return end, False, columns
                leaf[count], above[count], root[count] = i, h, root[h]
                base[count] = place_on(base[h], leaves[leaf[h]], s)
                length[count], order[count] = c, order[h] + 1
                count += 1
            _mark(h, leaf, above, taken, False)
        begin, end = end, count
    return end, True, columns


@compiled
def _mark(h: int, leaf: Ints, above: Ints, taken: Mask, value: bool) -> None:
    """Mark the leaves that a history names."""
    while h >= 0:
        taken[leaf[h]] = value
        h = above[h]
