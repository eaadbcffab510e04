"""The wood of one year as one picks it: metamers, and the branches that they make up."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from pipeline.geometry.compiled import compiled
from pipeline.growth.pruning.selecting import axis_of
from pipeline.growth.state import Mask, Metamers
from pipeline.model import RADIUS_SOURCES, Floats, Ints, TreeModel


class Limbs(NamedTuple):
    """What is kept of the metamers of a year; the foot is the first.

    Attributes
    ----------
    begin, end : (N, 3) arrays
        Metres, relative to the origin of the tree.
    width : (N,) array
        Diameters, metres.
    parent, order, birth_year : (N,) arrays of int32
    axis : (N,) array of int32
        The first metamer of each one's axis.
    """

    begin: Floats
    end: Floats
    width: Floats
    parent: Ints
    order: Ints
    birth_year: Ints
    axis: Ints

    @property
    def length(self) -> Floats:
        """(N,) metres."""
        return np.asarray(np.linalg.norm(self.end - self.begin, axis=1))

    def above(self, metamer: int) -> Mask:
        """(N,) which metamers are this one, or stand above it."""
        inside = np.zeros(len(self.parent), dtype=bool)
        inside[metamer] = True
        spread(self.parent, inside)
        return inside


class Branch(NamedTuple):
    """A branch that somebody has picked, and where on it.

    Attributes
    ----------
    metamer, start : int
        What was picked, and the first metamer of its axis.
    place : (3,) array
        On the axis, metres, relative to the origin of the tree.
    order : int
        0 is the stem.
    length_m, bears_m : float
        Of the axis, and of all wood from the picked place on, what it bears included.
    base_cm, here_cm : float
        Diameters where the axis begins, and at the place.
    birth_year : int
        When the picked wood grew; below 0 where it was there before.
    known : str
        How the radii of the axis are known.
    """

    metamer: int
    start: int
    place: Floats
    order: int
    length_m: float
    bears_m: float
    base_cm: float
    here_cm: float
    birth_year: int
    known: str


def limbs_of(metamers: Metamers) -> Limbs:
    """Return what is kept of metamers, as arrays of their own."""
    held = metamers.held()
    kept = {name: held[name].copy() for name in Limbs._fields if name in held}
    return Limbs(**kept, axis=axis_of(metamers))


def branch_at(limbs: Limbs, metamer: int, place: Floats, tree: TreeModel) -> Branch:
    """Tell what is known of the branch of a metamer.

    Parameters
    ----------
    limbs : Limbs
    metamer : int
    place : (3,) array
        On its axis.
    tree : TreeModel
        The same year's, which knows where radii are from.
    """
    start = int(limbs.axis[metamer])
    on = np.flatnonzero(limbs.axis == start)
    on = on[on > 0]
    length = limbs.length
    base = int(on[0]) if len(on) else start
    return Branch(
        metamer,
        start,
        place,
        int(limbs.order[metamer]),
        float(length[on].sum()),
        float(length[limbs.above(metamer)].sum()),
        100.0 * float(limbs.width[base]),
        100.0 * float(limbs.width[metamer]),
        int(limbs.birth_year[metamer]),
        known_by(tree, limbs.end[on], length[on]),
    )


def known_by(tree: TreeModel, points: Floats, length: Floats) -> str:
    """Say how the radii beside some points are known, with the share of the length where it is mixed."""
    if not len(points) or not length.sum():
        return "unknown"
    _, node = cKDTree(tree.skeleton.xyz).query(points)
    share = np.bincount(tree.radius_source[node], length, minlength=len(RADIUS_SOURCES)) / length.sum()
    if share.max() > 0.995:
        return RADIUS_SOURCES[int(share.argmax())]
    told = [f"{RADIUS_SOURCES[i]} {100 * share[i]:.0f} %" for i in np.argsort(-share) if share[i] >= 0.005]
    return ", ".join(told)


@compiled
def spread(parent: Ints, inside: Mask) -> None:
    """Mark all that stands on what is marked."""
    for i in range(1, len(parent)):
        if inside[parent[i]]:
            inside[i] = True
