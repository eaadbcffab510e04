"""From light to resource: gathered towards the root, shared out towards the buds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.growth.options import AllocationOptions
from pipeline.growth.sight import BudLight
from pipeline.growth.state import DAMAGED, DORMANT, GROWN, Bytes, Mask, Metamers
from pipeline.model import Floats, Ints


class Gathered(NamedTuple):
    """Light gathered on the way to the root.

    Attributes
    ----------
    terminal, lateral : (N,) arrays
        Light of each bud of a metamer, or of all that it has become.
    buds : (N,) array
        Buds that gather light on each metamer and above.
    internodes : (N,) array
        Metamers from each one on.
    total : float
        Light of the tree.
    """

    terminal: Floats
    lateral: Floats
    buds: Ints
    internodes: Ints
    total: float


class Resource(NamedTuple):
    """What each bud, or all that it has become, gets.

    Attributes
    ----------
    terminal, lateral : (N,) arrays
        By metamer.
    root : float
        What there is to share; the dormant buds have exactly this together.
    """

    terminal: Floats
    lateral: Floats
    root: float

    def for_more(self, count: int) -> Resource:
        """Add metamers that have got nothing yet."""
        more = (0, count - len(self.terminal))
        return Resource(np.pad(self.terminal, more), np.pad(self.lateral, more), self.root)

    def of(self, kept: Mask) -> Resource:
        """Keep the metamers that stay."""
        return Resource(self.terminal[kept], self.lateral[kept], self.root)


Topology = tuple[Ints, Mask, Ints, Ints, Bytes, Bytes]
Sides = tuple[Floats, Floats]  # of the terminal and the lateral bud of every metamer
Ranks = tuple[float, float, float, int]  # weights: most, least, fall; and most sides


def topology(tree: Metamers) -> Topology:
    """Return parent, is lateral, children and buds of every metamer, as compiled loops take them."""
    rows = slice(0, len(tree))
    return (
        tree.parent[rows],
        tree.is_lateral[rows],
        tree.terminal_child[rows],
        tree.lateral_child[rows],
        tree.terminal_bud[rows],
        tree.lateral_bud[rows],
    )


def gather(tree: Metamers, light: BudLight) -> Gathered:
    """Add up light towards the root.

    A damaged terminal bud counts where its axis has a living side branch or bud to hand its share to.
    """
    terminal, lateral, buds, internodes = basipetal(topology(tree), light)
    return Gathered(terminal, lateral, buds, internodes, float(terminal[0] + lateral[0]))


def by_borchert_honda(tree: Metamers, light: Gathered, options: AllocationOptions) -> Resource:
    """Split the resource at every fork by the light of its two sides, in favour of the main axis.

    References
    ----------
    Eq. 4.2 and 4.3 of the thesis: v_m = v l Q_m / (l Q_m + (1 - l) Q_l), v_l = v - v_m, l being `dominance`.
    """
    root = options.alpha * light.total
    terminal, lateral = split_by_fork(
        topology(tree), (light.terminal, light.lateral), root, options.dominance, options.damaged_share
    )
    return Resource(terminal, lateral, root)


def by_priority(tree: Metamers, light: Gathered, options: AllocationOptions) -> Resource:
    """Rank all branches of an axis by their mean light, the terminal one first, and favour the first.

    References
    ----------
    Eq. 4.4 and 4.5 of the thesis: v_i = v Q_i w_i / sum Q_j w_j; the weight w falls linearly from
    `priority_most` to `priority_least` over the first `priority_fall` of the list.
    """
    root = options.alpha * light.total
    weights = (options.priority_most, options.priority_least, options.priority_fall, options.priority_sides)
    shares = (options.dominance, options.damaged_share)
    terminal, lateral = split_by_rank(
        topology(tree), (light.terminal, light.lateral), light.buds, root, weights, shares
    )
    return Resource(terminal, lateral, root)


@compiled
def basipetal(tree: Topology, light: BudLight) -> tuple[Floats, Floats, Ints, Ints]:
    """Sum light, buds and internodes from the tips down."""
    parent, is_lateral, terminal_child, lateral_child, terminal_bud, lateral_bud = tree
    count = len(parent)
    alive, heard = np.zeros(count, dtype=np.bool_), np.zeros(count, dtype=np.bool_)
    for i in range(count - 1, -1, -1):
        t, s = terminal_child[i], lateral_child[i]
        alive[i] = terminal_bud[i] == DORMANT or lateral_bud[i] == DORMANT
        alive[i] |= (t >= 0 and alive[t]) or (s >= 0 and alive[s])
    for i in range(count):
        s = lateral_child[i]
        heard[i] = lateral_bud[i] == DORMANT or (s >= 0 and alive[s])
        if i > 0 and not is_lateral[i]:
            heard[i] |= heard[parent[i]]
    terminal, lateral = light.terminal.copy(), light.lateral.copy()
    buds, internodes = np.zeros(count, dtype=np.int32), np.ones(count, dtype=np.int32)
    for i in range(count - 1, -1, -1):
        t, s = terminal_child[i], lateral_child[i]
        if terminal_bud[i] == DAMAGED and not heard[i]:
            terminal[i] = 0.0
        if t >= 0:
            terminal[i] = terminal[t] + lateral[t]
            buds[i] += buds[t]
            internodes[i] += internodes[t]
        elif terminal_bud[i] == DORMANT or heard[i]:
            buds[i] += 1
        if s >= 0:
            lateral[i] = terminal[s] + lateral[s]
            buds[i] += buds[s]
            internodes[i] += internodes[s]
        elif lateral_bud[i] == DORMANT:
            buds[i] += 1
    return terminal, lateral, buds, internodes


@compiled
def hand_down(tip: int, tree: Topology, terminal: Floats, lateral: Floats, share: float) -> None:
    """Walk down an axis from its damaged end: living sides take shares, the lowest all that is left."""
    parent, is_lateral, _, _, _, lateral_bud = tree
    left = terminal[tip]
    terminal[tip] = 0.0
    lowest = -1
    i = tip
    while True:
        if lateral_bud[i] == DORMANT or (lateral_bud[i] == GROWN and lateral[i] > 0.0):
            lateral[i] += share * left
            left -= share * left
            lowest = i
        if i == 0 or is_lateral[i]:
            break
        i = parent[i]
    if lowest >= 0:
        lateral[lowest] += left


@compiled
def split_by_fork(
    tree: Topology, light: tuple[Floats, Floats], root: float, dominance: float, share: float
) -> tuple[Floats, Floats]:
    """Share the resource axis by axis, an axis before those that it bears, fork by fork."""
    parent, is_lateral = tree[0], tree[1]
    terminal, lateral = np.zeros(len(parent)), np.zeros(len(parent))
    for start in range(len(parent)):
        if start > 0 and not is_lateral[start]:
            continue
        v = root if start == 0 else lateral[parent[start]]
        i = down_the_forks(start, v, tree, light, dominance, (terminal, lateral))
        if tree[4][i] == DAMAGED and terminal[i] > 0.0:
            hand_down(i, tree, terminal, lateral, share)
    return terminal, lateral


@compiled
def down_the_forks(start: int, v: float, tree: Topology, light: Sides, dominance: float, gets: Sides) -> int:
    """Share the resource of an axis fork by fork; the metamer at its end."""
    terminal_child, (terminal, lateral) = tree[2], gets
    i = start
    while True:
        main, side = dominance * light[0][i], (1.0 - dominance) * light[1][i]
        if main + side > 0.0:
            terminal[i] = v * main / (main + side)
            lateral[i] = v - terminal[i]
        if terminal_child[i] < 0:
            return i
        v = terminal[i]
        i = terminal_child[i]


@compiled
def split_by_rank(
    tree: Topology, light: Sides, buds: Ints, root: float, ranks: Ranks, shares: tuple[float, float]
) -> tuple[Floats, Floats]:
    """Share the resource axis by axis, an axis before those that it bears, by the rank of its branches.

    An axis with more sides than `ranks` says is shared out fork by fork, by the first of the shares; the
    second is what sides take from a damaged end.
    """
    parent, is_lateral, terminal_child, lateral_child, terminal_bud, _ = tree
    terminal, lateral = np.zeros(len(parent)), np.zeros(len(parent))
    place, mean = np.zeros(len(parent), dtype=np.int64), np.zeros(len(parent))
    for start in range(len(parent)):
        if start > 0 and not is_lateral[start]:
            continue
        v = root if start == 0 else lateral[parent[start]]
        sides = 0
        i = start
        while True:
            if light[1][i] > 0.0:
                s = lateral_child[i]
                place[sides] = i
                mean[sides] = -light[1][i] / (buds[s] if s >= 0 else 1)
                sides += 1
            if terminal_child[i] < 0:
                break
            i = terminal_child[i]
        if sides > ranks[3]:
            down_the_forks(start, v, tree, light, shares[0], (terminal, lateral))
        else:
            rank = np.argsort(mean[:sides], kind="mergesort")
            by_weight((start, i, v), parent, light, place[:sides][rank], ranks, (terminal, lateral))
        if terminal_bud[i] == DAMAGED and terminal[i] > 0.0:
            hand_down(i, tree, terminal, lateral, shares[1])
    return terminal, lateral


@compiled
def by_weight(
    axis: tuple[int, int, float],
    parent: Ints,
    light: Sides,
    place: NDArray[np.int64],
    ranks: Ranks,
    gets: Sides,
) -> None:
    """Share the resource of an axis among its end and its sides, which are in the order of their ranks.

    The axis is its first and its last metamer, and what it has to share.
    """
    (start, tip, v), (most, least, fall, _), (terminal, lateral) = axis, ranks, gets
    total = most * light[0][tip]
    for r in range(len(place)):
        x = (r + 1) / len(place)
        weight = max(most - (most - least) * min(x / fall, 1.0), least)
        lateral[place[r]] = light[1][place[r]] * weight
        total += lateral[place[r]]
    if total <= 0.0:
        lateral[place] = 0.0
        return
    terminal[tip] = v * most * light[0][tip] / total
    for r in range(len(place)):
        lateral[place[r]] = v * lateral[place[r]] / total
    j = tip
    while j != start:
        terminal[parent[j]] = terminal[j] + lateral[j]
        j = parent[j]
