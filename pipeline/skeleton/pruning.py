"""Which chains of a raw tree are branches, and which are only the thickness of another branch."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.branching import longest_child
from pipeline.geometry.compiled import compiled
from pipeline.skeleton.rooted import Rooted

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def prune(tree: Rooted, *, protrusion_m: float, inside: float, min_support: int) -> Rooted:
    """Drop the chains that do not stand out from the wood that they hang on.

    The tree is split into chains, the longest first. A chain stays when one of its own nodes
    reaches farther than `protrusion_m` beyond `inside` times the thickness of the axis that it
    forks from, with at least `min_support` points beyond; and as far as it carries others that do.

    Parameters
    ----------
    tree : Rooted
    protrusion_m : float
        Least length that must show outside the parent axis' wood, in metres.
    inside : float
        How many thicknesses around an axis belong to it.
    min_support : int
        Least number of points outside.
    """
    step = np.linalg.norm(tree.xyz - tree.xyz[np.maximum(tree.parent, 0)], axis=1)
    ahead = longest_child(tree.parent, step)
    wood = inside * tree.thickness
    return tree.keep(
        _standing_out((tree.xyz, step), (tree.parent, ahead), (wood, tree.support), protrusion_m, min_support)
    )


@compiled
def _clearance(
    i: int, fork: int, geometry: tuple[Floats, Floats], links: tuple[Ints, Ints], wood: Floats
) -> float:
    """How far node `i` stands outside the wood of the axis through `fork`, in metres."""
    xyz, step = geometry
    parent, ahead = links
    away = np.sqrt(((xyz[i] - xyz[fork]) ** 2).sum())
    clear = away - wood[fork]
    j, gone = fork, 0.0
    while parent[j] >= 0 and gone <= away + wood[fork]:
        gone += step[j]
        j = parent[j]
        clear = min(clear, np.sqrt(((xyz[i] - xyz[j]) ** 2).sum()) - wood[j])
    j, gone = fork, 0.0
    while ahead[j] >= 0 and gone <= away + wood[fork]:
        j = ahead[j]
        gone += step[j]
        clear = min(clear, np.sqrt(((xyz[i] - xyz[j]) ** 2).sum()) - wood[j])
    return float(clear)


@compiled
def _standing_out(
    geometry: tuple[Floats, Floats],
    links: tuple[Ints, Ints],
    wood_support: tuple[Floats, Floats],
    protrusion: float,
    min_support: int,
) -> NDArray[np.bool_]:
    """(N,) which nodes belong to chains that stand out, or carry one that does."""
    parent, ahead = links
    wood, support = wood_support
    count = len(parent)
    keep = np.zeros(count, dtype=np.bool_)
    i = 0
    while i >= 0:
        keep[i] = True
        i = ahead[i]
    for start in range(1, count):
        fork = parent[start]
        if ahead[fork] == start:
            continue
        most, seen, i = -1.0, 0.0, start
        while i >= 0 and (most <= protrusion or seen < min_support):
            clear = _clearance(i, fork, geometry, links, wood)
            most = max(most, clear)
            if clear > 0.0:
                seen += support[i]
            i = ahead[i]
        if most > protrusion and seen >= min_support:
            i = start
            while i >= 0:
                keep[i] = True
                i = ahead[i]
    for i in range(count - 1, 0, -1):
        if keep[i]:
            keep[parent[i]] = True
    return keep
