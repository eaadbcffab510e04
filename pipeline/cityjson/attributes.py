"""What a city object says of its tree: size, diameters, species."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from pipeline.model import TreeModel

BREAST_HEIGHT_M = 1.3


def describe(tree: TreeModel) -> dict[str, Any]:
    """Return what the city object says of the tree: metres, three or four decimals.

    Parameters
    ----------
    tree : TreeModel

    Returns
    -------
    dict
        ``species``, ``height``, ``trunkDiameter`` and ``crownDiameter`` as CityGML names them, and
        ``dbh`` with its interval, arc, source and the height of the ground. What is unknown is absent.
    """
    known, trunk, z = tree.metadata, tree.trunk, tree.skeleton.xyz[:, 2]
    ground = float(_first(trunk.ground_z if trunk else None, known.get("ground_z"), z.min()))
    top = float(_first(known.get("top_z"), z.max()))
    breast = trunk.dbh_m if trunk and trunk.dbh_m else _diameter_at(tree, ground + BREAST_HEIGHT_M)
    found: dict[str, Any] = {
        "species": known.get("species"),
        "height": _rounded(top - ground, 3),
        "trunkDiameter": _rounded(breast, 4),
        "crownDiameter": _rounded(_crown_diameter(tree), 3),
    }
    if trunk:
        found |= {
            "dbh": _rounded(trunk.dbh_m, 4),
            "dbhLow": _rounded(trunk.lo_m, 4),
            "dbhHigh": _rounded(trunk.hi_m, 4),
            "dbhArc": _rounded(trunk.arc_deg, 1),
            "dbhSource": trunk.source,
            "groundHeight": _rounded(trunk.ground_z + float(tree.skeleton.origin[2]), 4),
        }
    return {key: value for key, value in found.items() if value is not None}


def _first(*values: Any) -> Any:
    """Return the first value that is known."""
    return next(value for value in values if value is not None)


def _rounded(value: float | None, decimals: int) -> float | None:
    return None if value is None or not np.isfinite(value) else round(float(value), decimals)


def _diameter_at(tree: TreeModel, height: float) -> float | None:
    """Return the diameter of the stem where it first passes `height`."""
    stem = tree.skeleton.paths[0]
    z, radius = tree.skeleton.xyz[stem, 2], tree.radius[stem]
    for k in np.flatnonzero((z[:-1] <= height) & (z[1:] > height))[:1]:
        share = (height - z[k]) / (z[k + 1] - z[k])
        return float(2 * (radius[k] + share * (radius[k + 1] - radius[k])))
    return None


def _crown_diameter(tree: TreeModel) -> float | None:
    """Return the diameter of the circle with the crown's area in plan."""
    area = tree.metadata.get("crown_area_m2")
    if area is None:
        try:
            area = ConvexHull(tree.skeleton.xyz[:, :2]).volume
        except (QhullError, ValueError):  # too few nodes, or all on one line
            return None
    return float(2 * np.sqrt(float(area) / np.pi))
