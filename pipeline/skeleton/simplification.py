"""Fewer nodes for the same tree: Douglas-Peucker between forks, near-parallel siblings joined."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.polyline import douglas_peucker
from pipeline.skeleton.rooted import Rooted

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


def simplify(tree: Rooted, *, share: float, floor_m: float) -> Rooted:
    """Douglas-Peucker on every unbranched path; forks, tips and the root stay.

    Parameters
    ----------
    tree : Rooted
    share : float
        Tolerance as a share of the local thickness.
    floor_m : float
        Least tolerance in metres (not below the sensor's noise).
    """
    count = np.bincount(tree.parent[1:], minlength=len(tree.parent))
    keep = count != 1
    keep[0] = True
    tolerance = np.maximum(share * tree.thickness, floor_m)
    for end in np.flatnonzero(keep)[1:]:
        run = [int(end)]
        while not keep[tree.parent[run[-1]]]:
            run.append(int(tree.parent[run[-1]]))
        run.append(int(tree.parent[run[-1]]))
        chain = np.array(run[::-1])
        keep[chain] |= douglas_peucker(tree.xyz[chain], tolerance[chain])
    return _skip(tree, keep)


def _skip(tree: Rooted, keep: NDArray[np.bool_]) -> Rooted:
    """Drop single-child nodes outside `keep`; their support goes to the next node down the chain."""
    parent, support = tree.parent.copy(), tree.support.copy()
    for i in range(1, len(parent)):
        if not keep[parent[i]]:
            support[i] += support[parent[i]]
            parent[i] = parent[parent[i]]
    return Rooted(tree.xyz, parent, tree.thickness, support).keep(keep)


def merge_siblings(tree: Rooted, *, min_cosine: float, max_ratio: float) -> Rooted:
    """Join the two most alike children of a fork into one, again and again, until none are alike.

    Children i and j are alike when they leave at nearly the same angle, have lengths within
    `max_ratio` of each other, and end nearer to each other than the thickness there. The joined
    node stands at their mean, weighted by the points that each carries.

    Parameters
    ----------
    tree : Rooted
    min_cosine : float
        Cosine of the largest angle between the two.
    max_ratio : float
        Largest ratio of their lengths.

    References
    ----------
    Du et al. (2019), "AdTree", section 2.3: value = length sin(angle) / radius, joined below 1.
    """
    xyz, support = tree.xyz.copy(), tree.support.copy()
    parent = tree.parent.copy()
    carried = support.copy()
    for i in range(len(parent) - 1, 0, -1):
        carried[parent[i]] += carried[i]
    below: list[list[int]] = [[] for _ in parent]
    for i, p in enumerate(parent.tolist()[1:], 1):
        below[p].append(i)
    gone = np.zeros(len(parent), dtype=bool)
    waiting = [0]
    for fork in waiting:
        pair = _most_alike(fork, below[fork], xyz, tree.thickness, (min_cosine, max_ratio))
        while pair is not None:
            stay, go = pair
            share = carried[stay] / (carried[stay] + carried[go])
            xyz[stay] = share * xyz[stay] + (1.0 - share) * xyz[go]
            carried[stay] += carried[go]
            support[stay] += support[go]
            parent[below[go]] = stay
            below[stay] = sorted(below[stay] + below[go])
            below[fork].remove(go)
            gone[go] = True
            pair = _most_alike(fork, below[fork], xyz, tree.thickness, (min_cosine, max_ratio))
        waiting.extend(below[fork])
    return _reorder(Rooted(xyz, parent, tree.thickness, support), np.array(waiting))


def _most_alike(
    fork: int, children: list[int], xyz: Floats, thickness: Floats, limits: tuple[float, float]
) -> tuple[int, int] | None:
    """Return the pair of children with the smallest value below 1, or None."""
    best, pair = 1.0, None
    for n, i in enumerate(children):
        for j in children[n + 1 :]:
            a, b = xyz[i] - xyz[fork], xyz[j] - xyz[fork]
            la, lb = float(np.sqrt(a @ a)), float(np.sqrt(b @ b))
            if min(la, lb) <= 0.0 or max(la, lb) > limits[1] * min(la, lb):
                continue
            cosine = min(1.0, float(a @ b) / (la * lb))
            value = min(la, lb) * np.sqrt(1.0 - cosine * cosine) / max(thickness[i], thickness[j])
            if cosine > limits[0] and value < best:
                best, pair = float(value), (i, j)
    return pair


def _reorder(tree: Rooted, order: Ints) -> Rooted:
    """Number the nodes in `order`, which holds parents before children and may leave some out."""
    number = np.full(len(tree.parent), -1, dtype=np.int64)
    number[order] = np.arange(len(order))
    parent = tree.parent[order]
    parent = np.where(parent >= 0, number[np.maximum(parent, 0)], -1)
    return Rooted(tree.xyz[order], parent, tree.thickness[order], tree.support[order])
