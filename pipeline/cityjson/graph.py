"""The skeleton and its radii as whole numbers: what makes a CityJSON file a tree again.

Nodes are rounded to a step first, and the steps from parent to child are taken between the rounded
positions. So every node comes back within half a step, however deep it stands.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.cityjson.options import CityjsonOptions
from pipeline.errors import InputFormatError, ModelError
from pipeline.model import MEASURED, Ints, Skeleton, TreeModel

KEYS = ("scale", "origin", "radiusScale", "parent", "dxyz", "radius")


def encode_graph(tree: TreeModel, options: CityjsonOptions) -> dict[str, Any]:
    """Write the nodes of a tree as integers.

    Parameters
    ----------
    tree : TreeModel
    options : CityjsonOptions
        `node_step_m` and `radius_step_m`.

    Returns
    -------
    dict
        ``scale`` and ``radiusScale`` (metres a step), ``origin`` (world coordinates of the local
        zero), ``parent`` (absolute indices, -1 at the root), ``dxyz`` (3 a node, steps from the
        parent; the root's from the origin), ``radius`` and ``radiusSource`` (0 measured,
        1 propagated, 2 allometric).
    """
    skeleton = tree.skeleton
    at = np.rint(skeleton.xyz / options.node_step_m).astype(np.int64)
    step = at.copy()
    step[1:] -= at[skeleton.parent[1:]]
    return {
        "scale": options.node_step_m,
        "origin": skeleton.origin.tolist(),
        "radiusScale": options.radius_step_m,
        "parent": skeleton.parent.tolist(),
        "dxyz": step.ravel().tolist(),
        "radius": np.rint(tree.radius / options.radius_step_m).astype(np.int64).tolist(),
        "radiusSource": tree.radius_source.tolist(),
    }


def decode_graph(graph: Mapping[str, Any], *, crs: str | None) -> TreeModel:
    """Rebuild a tree from the integers of `encode_graph`.

    Parameters
    ----------
    graph : mapping
        What `encode_graph` writes; without ``radiusSource`` all radii count as measured.
    crs : str or None
        Reference system of ``origin``.

    Returns
    -------
    TreeModel
        Without trunk and metadata.

    Raises
    ------
    InputFormatError
        If a member is missing, not numbers, of the wrong length, or the parents make no tree.
    """
    missing = [key for key in KEYS if key not in graph]
    if missing:
        msg = f"the skeleton lacks {', '.join(missing)}; write the file anew from its tree"
        raise InputFormatError(msg)
    parent = _whole(graph, "parent")
    step = _whole(graph, "dxyz")
    radius = _whole(graph, "radius")
    source = _whole(graph, "radiusSource") if "radiusSource" in graph else np.full(len(radius), MEASURED)
    if not len(step) == 3 * len(parent) == 3 * len(radius) == 3 * len(source):
        msg = (
            f"the skeleton has {len(parent)} parents, {len(step)} steps, {len(radius)} radii and "
            f"{len(source)} radius sources; it needs three steps a node, and one of everything else"
        )
        raise InputFormatError(msg)
    try:
        scale, thick = float(graph["scale"]), float(graph["radiusScale"])
        above = parent.clip(-1, len(parent)).astype(np.int32)  # a wrong index stays wrong in fewer bits
        xyz = _summed(step.reshape(-1, 3), above).astype(np.float64) * scale
        skeleton = Skeleton(xyz, above, np.array(graph["origin"], dtype=float), crs)
        thickness = radius.astype(np.float64) * thick
        return TreeModel(
            skeleton, thickness, source.clip(0, 255).astype(np.uint8), np.full(len(parent), np.nan)
        )
    except (ModelError, TypeError, ValueError) as error:
        msg = f"the skeleton makes no tree: {error}"
        raise InputFormatError(msg) from error


def _whole(graph: Mapping[str, Any], key: str) -> NDArray[np.int64]:
    values = graph[key]
    if not isinstance(values, list) or not all(type(v) is int and abs(v) < 2**53 for v in values):
        msg = f"the skeleton's {key} is not a list of whole numbers; write the file anew from its tree"
        raise InputFormatError(msg)
    return np.array(values, dtype=np.int64)


def _summed(step: NDArray[np.int64], parent: Ints) -> NDArray[np.int64]:
    """Add up the steps from the root to every node."""
    Skeleton(np.zeros((len(step), 3)), parent)  # parents stand before their children, or an error
    at = step.tolist()
    for i, p in enumerate(parent.tolist()[1:], 1):
        above, here = at[p], at[i]
        at[i] = [above[0] + here[0], above[1] + here[1], above[2] + here[2]]
    return np.array(at, dtype=np.int64)
