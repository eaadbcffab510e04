"""Where new shoots stand on a tree, and which way they go: the four rules A to D of 2021.

A shoot is the average tip of the tree. Tips are told apart by the signs of their rotation and of
their roll, as seen from the segment that carries them; the average of each kind is a rule, and a
node that sprouts takes the rule of the tip of its own branch.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.geometry.compiled import compiled
from pipeline.model import Floats, Ints

RULES = "ABCD"
"""A rotates and rolls to the positive, B rotates to the negative, C rolls to it, D does both."""
STRAIGHT = 1e-9
"""A turn by less, as a share of the step, is noise: it counts as none."""
AIMLESS = 1e-6
"""Tips whose unit vectors cancel out to less than this share have no average direction."""


class Rules(NamedTuple):
    """The average tips, in the order of `RULES`; NaN where no tip is of a kind.

    Parameters
    ----------
    move : (4, 3) array of float64
        Unit vectors in the frame of the segment that carries the tip: ahead, down, aside.
    length : (4,) array of float64
        Metres.
    """

    move: Floats
    length: Floats


@compiled
def positions(parent: Ints, onward: Ints) -> tuple[Ints, Ints]:
    """Count the nodes from every node to the tip of its branch.

    Parameters
    ----------
    parent, onward : (N,) array of int32
        `onward` is the child that continues the branch of each node, -1 at tips.

    Returns
    -------
    position : (N,) array of int32
        0 at tips; at a fork the largest of the branches that meet there.
    tip : (N,) array of int32
        The tip of the branch of each node.
    """
    count = len(parent)
    position, along = np.zeros(count, dtype=np.int32), np.zeros(count, dtype=np.int32)
    tip = np.arange(count).astype(np.int32)
    for i in range(count - 1, 0, -1):
        p = parent[i]
        position[p] = max(position[p], along[i] + 1)
        if onward[p] == i:
            along[p], tip[p] = along[i] + 1, tip[i]
    return position, tip


@compiled
def frames(xyz: Floats, parent: Ints) -> Floats:
    """Return the (N, 3, 3) unit vectors of every segment: ahead, down, aside.

    Ahead is where the turtle heads, down where ``+`` turns it, aside where ``>`` does. A segment
    without length has the frame of its parent, a vertical one its parent's side; the root looks
    along +X, as the turtle does.
    """
    frame = np.zeros((len(xyz), 3, 3))
    frame[0] = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
    for i in range(1, len(xyz)):
        before, step = frame[parent[i]], xyz[i] - xyz[parent[i]]
        length = np.sqrt((step * step).sum())
        if length == 0:
            frame[i] = before
            continue
        x, y, z = step / length
        level = np.sqrt(x * x + y * y)
        east, north = before[2, 1], -before[2, 0]
        if level > STRAIGHT:
            east, north = x / level, y / level
        frame[i, 0] = x, y, z
        frame[i, 1] = z * east, z * north, -level
        frame[i, 2] = -north, east, 0.0
    return frame


def shoots(xyz: Floats, parent: Ints, onward: Ints, sprout_position: int) -> tuple[Ints, Floats]:
    """Let a tree sprout.

    Parameters
    ----------
    xyz : (N, 3) array of float64
        Metres.
    parent, onward : (N,) array of int32
        As in `positions`.
    sprout_position : int
        Nodes so far from the tip of their branch sprout, unless they fork already. The root never does.

    Returns
    -------
    foot : (S,) array of int32
        The nodes that sprout.
    step : (S, 3) array of float64
        From each foot to the end of its shoot, in metres.
    """
    position, tip = positions(parent, onward)
    children = np.bincount(parent[1:], minlength=len(parent))
    foot = np.flatnonzero((position == sprout_position) & (children == 1) & (parent >= 0))
    frame = frames(xyz, parent)
    kind, rules = _rules(xyz, parent, frame)
    rule = kind[tip[foot]]
    foot, rule = foot[(known := rules.length[rule] > 0)], rule[known]
    step = np.einsum("sk,skj->sj", rules.move[rule], frame[foot]) * rules.length[rule][:, None]
    return foot.astype(np.int32), step


def _rules(xyz: Floats, parent: Ints, frame: Floats) -> tuple[Ints, Rules]:
    """Return the rule of each node as if it were a tip, and the rules.

    Directions are averaged as unit vectors in the frame of the parent: there is no angle that wraps,
    and a turn means the same on an upright twig as on a level one. Tips on the root turn from
    nothing, those without length to nowhere: neither counts.
    """
    above = np.maximum(parent, 0)
    length = np.linalg.norm(xyz - xyz[above], axis=1)
    move = np.einsum("nkj,nj->nk", frame[above], frame[:, 0])
    kind = (move[:, 1] < -STRAIGHT) + 2 * (move[:, 2] < -STRAIGHT)
    leaf = np.bincount(above[1:], minlength=len(parent)) == 0
    counts = leaf & (above > 0) & (length > 0)
    members = [np.flatnonzero(counts & (kind == k)) for k in range(len(RULES))]
    averages = [_average(move[m], length[m]) for m in members]
    return kind, Rules(np.array([a[0] for a in averages]), np.array([a[1] for a in averages]))


def _average(move: Floats, length: Floats) -> tuple[Floats, float]:
    """Return the mean direction and the mean length of some tips, NaN where there is none."""
    total = move.sum(axis=0)
    size = float(np.linalg.norm(total))
    if size <= AIMLESS * len(move):
        return np.full(3, np.nan), np.nan
    return total / size, float(length.mean())
