"""Which chains of slices are branches: the longest first, if it stands out of all that is kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.branching import longest_child
from pipeline.geometry.compiled import compiled
from pipeline.geometry.voxels import cell_keys
from pipeline.skeleton.rooted import Rooted

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

INSIDE = 1.25  # radii around a limb's axis that are its own wood
AROUND = 2.2  # the same for slices, whose half rings look thinner than the branch is
NEIGHBOURS = 4  # slices before and after that vote on a thickness
THICK_M = 0.10  # slices are not believed to be thicker than that; limbs are known apart


def keep_chains(
    tree: Rooted, limb: NDArray[np.bool_], clear_of_limbs: Floats, margin_m: float, least: tuple[float, int]
) -> Rooted:
    """Keep the limbs, and the chains of slices that reach out of the wood kept so far.

    Parameters
    ----------
    tree : Rooted
        Limb nodes and slices.
    limb : (N,) array of bool
        Nodes of limbs, which stay in any case.
    clear_of_limbs : (N,) array
        Distance of every node from 1.25 radii around the nearest limb, metres.
    margin_m : float
        How far a chain must reach out.
    least : tuple of float and int
        Least length (metres) and number of points of a chain.
    """
    step = np.linalg.norm(tree.xyz - tree.xyz[np.maximum(tree.parent, 0)], axis=1)
    ahead = longest_child(tree.parent, step)
    usual = _usual_thickness(tree.thickness, tree.parent, ahead)
    wood = AROUND * np.minimum(usual, THICK_M)
    size = float(wood[~limb].max(initial=0.0)) + margin_m
    keys = cell_keys(tree.xyz, size)
    order = np.argsort(keys, kind="stable")
    keep = _keep(
        (tree.xyz, step, wood, tree.support),
        (tree.parent, ahead),
        limb,
        clear_of_limbs,
        (keys, order, keys[order]),
        (margin_m, least[0], float(least[1])),
    )
    return tree.keep(keep)


@compiled
def _usual_thickness(thickness: Floats, parent: Ints, ahead: Ints) -> Floats:
    """Median thickness over the neighbours along the branch: a slice across a fork is outvoted."""
    out = thickness.copy()
    held = np.empty(2 * NEIGHBOURS + 1)
    for i in range(len(thickness)):
        held[0], count = thickness[i], 1
        for way in (ahead, parent):
            j = way[i]
            for _ in range(NEIGHBOURS):
                if j < 0:
                    break
                held[count] = thickness[j]
                count += 1
                j = way[j]
        out[i] = np.median(held[:count])
    return out


@compiled
def _reach_of_chains(parent: Ints, step: Floats, limb: NDArray[np.bool_], ahead: Ints) -> Floats:
    """Length of the chain that starts at each node; -1 where none starts."""
    reach = np.zeros(len(parent))
    for i in range(len(parent) - 1, 0, -1):
        if ahead[i] >= 0:
            reach[i] = reach[ahead[i]] + step[ahead[i]]
    out = np.full(len(parent), -1.0)
    for i in range(len(parent)):
        if not limb[i] and (parent[i] < 0 or limb[parent[i]] or ahead[parent[i]] != i):
            out[i] = reach[i] + step[i]
    return out


@compiled
def _keep(
    nodes: tuple[Floats, Floats, Floats, Floats],
    links: tuple[Ints, Ints],
    limb: NDArray[np.bool_],
    clear_of_limbs: Floats,
    grid: tuple[Ints, Ints, Ints],
    limits: tuple[float, float, float],
) -> NDArray[np.bool_]:
    _, step, _, support = nodes
    margin, least_length, least_points = limits
    parent, ahead = links
    reach = _reach_of_chains(parent, step, limb, ahead)
    keep = limb.copy()
    kept = limb.copy()
    for start in np.argsort(-reach, kind="mergesort"):
        if reach[start] < 0.0:
            break
        seen, length, out, i = 0.0, 0.0, False, start
        while i >= 0:
            if clear_of_limbs[i] > margin and not _covered(i, nodes, kept, grid, margin):
                out = True
                seen += support[i]
            length += step[i]
            i = ahead[i]
        if parent[start] < 0 or (out and seen >= least_points and length >= least_length):
            i = start
            while i >= 0:
                keep[i] = kept[i] = True
                i = ahead[i]
    for i in range(len(parent) - 1, 0, -1):
        if keep[i] and parent[i] >= 0:
            keep[parent[i]] = True
    return keep


@compiled
def _covered(
    i: int,
    nodes: tuple[Floats, Floats, Floats, Floats],
    kept: NDArray[np.bool_],
    grid: tuple[Ints, Ints, Ints],
    margin: float,
) -> bool:
    """Whether a kept axis holds node `i` within its wood and the margin."""
    xyz, _, wood, _ = nodes
    keys, order, ordered = grid
    for dx in range(-1, 2):
        for dy in range(-1, 2):
            low = keys[i] + (dx << 42) + (dy << 21) - 1
            at = np.searchsorted(ordered, low)
            while at < len(ordered) and ordered[at] <= low + 2:
                j = order[at]
                if kept[j] and np.sqrt(((xyz[i] - xyz[j]) ** 2).sum()) < wood[j] + margin:
                    return True
                at += 1
    return False
