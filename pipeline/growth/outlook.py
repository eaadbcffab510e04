"""What is known of a tree after it has grown: its diameter at breast height, and its metadata."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from pipeline.growth.log import Entry, Removal, YearReport
from pipeline.growth.simulation import Growth
from pipeline.model import Floats, Skeleton, TreeModel, Trunk

BREAST_M = 1.3
GROWN = "grown"
"""The flag of a tree that holds more than was scanned."""
STALE = ("volume_interval_l", "length_interval_m", "surface_mm")
"""Metadata that growth makes untrue."""


def trunk_of(before: TreeModel, after: TreeModel, gain: Floats, power: float) -> Trunk | None:
    """Return the diameter at breast height of a tree that has grown.

    It gains what the stem has gained there. The interval becomes wider by twice that upwards and not at all
    downwards: nobody knows how fast a tree grows, but it does not shrink. Where the diameter was not known it
    is read off the model, without an interval; a tree that has been cut lower has none.

    Parameters
    ----------
    before, after : TreeModel
    gain : (N,) array
        What each node of `before` has gained, as a power of its diameter.
    power : float
    """
    trunk = before.trunk
    if trunk is None or trunk.dbh_m is None:
        ground = trunk.ground_z if trunk else float(before.skeleton.xyz[0, 2])
        dbh = diameter_at(after, ground + BREAST_M)
        return trunk if dbh is None else Trunk(dbh, None, None, 0.0, "allometric", ground)
    if after.skeleton.xyz[:, 2].max() < trunk.ground_z + BREAST_M:
        return Trunk(None, None, None, 0.0, None, trunk.ground_z)
    stem = np.flatnonzero(before.skeleton.branch == 0)
    above = stem[before.skeleton.xyz[stem, 2] >= trunk.ground_z + BREAST_M]
    more = float(gain[above[0]]) if len(above) else 0.0
    if more == 0.0:
        return trunk
    dbh = (trunk.dbh_m**power + more) ** (1.0 / power)
    high = None if trunk.hi_m is None else trunk.hi_m + 2.0 * (dbh - trunk.dbh_m)
    return replace(trunk, dbh_m=dbh, hi_m=high, arc_deg=0.0, source="allometric")


def diameter_at(tree: TreeModel, height: float) -> float | None:
    """Diameter of the stem where it first reaches a height, metres; None where it does not."""
    graph = tree.skeleton
    stem = np.flatnonzero(graph.branch == 0)
    z = graph.xyz[stem, 2]
    above = np.flatnonzero(z >= height)
    if not len(above) or above[0] == 0:
        return None
    low, high = stem[above[0] - 1], stem[above[0]]
    share = (height - graph.xyz[low, 2]) / (graph.xyz[high, 2] - graph.xyz[low, 2])
    return float(2.0 * (tree.radius[low] + share * (tree.radius[high] - tree.radius[low])))


def described(
    before: TreeModel, graph: Skeleton, growth: Growth, known: Mapping[str, Any] | None
) -> dict[str, Any]:
    """Return the metadata of a tree that has grown: all that still holds, and how it grew.

    The top of the points rises, and their hull widens, as the model's.
    """
    cuts = events_of(growth.log)
    told = {
        "method": "organic",
        "years": growth.year,
        "seed": growth.seed,
        "metamers": len(growth.metamers) - 1,
        "events": tuple({"year": entry.year, "what": name_of(entry)} for entry in cuts),
        **(known or {}),
    }
    held = {**before.metadata, "growth": told}
    if not growth.year and not cuts:
        return held
    for key in STALE:
        held.pop(key, None)
    held["flags"] = tuple(sorted({*before.metadata.get("flags", ()), GROWN}))
    was, now = before.skeleton.xyz, graph.xyz
    if "top_z" in held:
        held["top_z"] = float(held["top_z"] + now[:, 2].max() - was[:, 2].max())
    if held.get("crown_area_m2") is not None:
        area = crown_area(was)
        held["crown_area_m2"] = crown_area(now) * (held["crown_area_m2"] / area if area else 1.0)
    return held


def events_of(log: Sequence[Entry]) -> list[Entry]:
    """Return what was done to a tree: operations, without the single removals that they are made of."""
    told: list[Entry] = []
    is_part = False
    for entry in reversed(log):
        if isinstance(entry, Removal) and is_part:
            continue
        is_part = not isinstance(entry, Removal | YearReport)
        if not isinstance(entry, YearReport):
            told.append(entry)
    return told[::-1]


def name_of(entry: Entry) -> str:
    """Return what an entry of the log calls itself."""
    return str(getattr(entry, "operation", type(entry).__name__.lower()))


def crown_area(xyz: Floats) -> float:
    """Area of the convex hull of points in plan, square metres; 0 where they are in line."""
    try:
        return float(ConvexHull(xyz[:, :2]).volume)
    except (QhullError, ValueError):
        return 0.0
