"""From a branch system to the nodes of a rooted graph."""

from __future__ import annotations

import numpy as np

from pipeline.skeleton.minimal.problem import FREE, Floats, Ints, Mask, System

SAME_M = 0.001  # a branch that starts this near to a node of its mother starts there
ROOM_M = 0.002  # so far from both ends of its mother a branch starts: it would be its sister otherwise


def nodes_of(system: System, least_m: float = 0.0) -> tuple[Floats, Ints, Ints]:
    """Lay nodes at all tips and branch points.

    Parameters
    ----------
    system : System
        Its root axes follow each other: the trunk, from its foot.
    least_m : float
        Branches without daughters that are shorter, metres, are left out, from the last order down.

    Returns
    -------
    xyz : (N, 3) array
        Metres; the trunk first, mothers before daughters.
    parent : (N,) array of int
        -1 at the foot.
    ahead : (N,) array of int
        The node that continues each node's branch; -1 at tips.
    """
    roots = system.problem.roots
    kept = _long_enough(system, least_m)
    starts: list[list[int]] = [[] for _ in range(len(roots) + len(kept))]
    for leaf in np.flatnonzero(kept).tolist():
        starts[system.mother[leaf]].append(leaf)
    xyz, parent, ahead = [roots.base[0]], [-1], [-1]
    waiting = [(axis, -1) for axis in range(len(roots))]
    at = 0
    for axis, foot in waiting:  # grows while it is walked: breadth first over branches
        here = at if foot < 0 else foot
        from_, to = (roots.base[axis], roots.tip[axis]) if foot < 0 else _ends(system, axis - len(roots))
        starting = foot >= 0
        ends = (from_, to, axis >= len(roots), axis >= len(roots) - 1)
        for s, leaf in [*sorted((_along(system.base[i], ends), i) for i in starts[axis]), (1.0, FREE)]:
            place = to if leaf == FREE else from_ + s * (to - from_)
            if float(np.linalg.norm(place - xyz[here])) > SAME_M:
                if not starting:
                    ahead[here] = len(xyz)
                xyz.append(place)
                parent.append(here)
                ahead.append(-1)
                here, starting = len(xyz) - 1, False
            if leaf != FREE:
                waiting.append((len(roots) + leaf, here))
        at = here if foot < 0 else at
    return np.array(xyz), np.array(parent, dtype=np.int64), np.array(ahead, dtype=np.int64)


def _along(place: Floats, axis: tuple[Floats, Floats, bool, bool]) -> float:
    """Where a branch starts, as a share of its mother, off those ends that are the mother's own."""
    from_, to, begins, stops = axis
    size = max(float(np.linalg.norm(to - from_)), SAME_M)
    room = min(ROOM_M, size / 2)
    s = float(np.linalg.norm(place - from_))
    return min(max(s, room if begins else 0.0), size - room if stops else size) / size


def _ends(system: System, leaf: int) -> tuple[Floats, Floats]:
    return system.base[leaf], system.problem.leaves[leaf]


def _long_enough(system: System, least_m: float) -> Mask:
    """(m,) branches that are there, carry others or are long."""
    first, kept = len(system.problem.roots), ~system.free
    carries = np.zeros(len(kept), dtype=np.int64)
    np.add.at(carries, system.mother[kept & (system.mother >= first)] - first, 1)
    for leaf in np.argsort(-system.order, kind="stable").tolist():
        if kept[leaf] and carries[leaf] == 0 and system.length[leaf] < least_m:
            kept[leaf] = False
            if system.mother[leaf] >= first:
                carries[system.mother[leaf] - first] -= 1
    return kept
