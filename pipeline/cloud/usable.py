"""Whether the points can be one tree at all; if not, one sentence that says why and what helps."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pipeline.errors import NotATreeError
from pipeline.model import PointCloud

MIN_POINTS = 10
FLAT = 1e-3  # thinnest direction of the cloud over its longest: a real tree is never that flat


def require_tree(cloud: PointCloud) -> None:
    """Raise `NotATreeError` if the points, not cleaned here, are too few or without volume."""
    apart = cloud.take(np.sort(np.unique(cloud.xyz, axis=0, return_index=True)[1]))
    require_points(apart, len(cloud), {"duplicate": len(cloud) - len(apart)})
    require_volume(apart)


def require_points(cloud: PointCloud, points_in: int, dropped: Mapping[str, int]) -> None:
    """Raise `NotATreeError` if fewer than `MIN_POINTS` of the `points_in` points are left."""
    left = len(cloud)
    if left >= MIN_POINTS:
        return
    if left + dropped["duplicate"] == points_in and left == 1 < points_in:
        msg = (
            f"{_where(cloud)}: its {points_in} points come down to one place; "
            "give a scan of a whole tree with x, y and z"
        )
        raise NotATreeError(msg)
    gone = ", ".join(f"{count} {kind}" for kind, count in dropped.items() if count)
    why = f" ({gone})" if gone else ""
    msg = (
        f"{_where(cloud)}: {_points(left)} usable of {points_in}{why}, "
        f"and a tree needs at least {MIN_POINTS}; give a denser cloud or check its classes"
    )
    raise NotATreeError(msg)


def require_one_tree(cloud: PointCloud, max_extent_m: float) -> None:
    """Raise `NotATreeError` if the cloud is too large for one tree."""
    extent = np.ptp(cloud.xyz, axis=0)
    if extent.max() > max_extent_m:
        size = " x ".join(f"{side:.0f}" for side in extent)
        msg = (
            f"{_where(cloud)}: measures {size} m, more than the {max_extent_m:g} m of one tree; "
            "use `treepipe batch` to find and reconstruct the trees in it"
        )
        raise NotATreeError(msg)


def require_volume(cloud: PointCloud) -> None:
    """Raise `NotATreeError` if all points lie on one place, line or plane."""
    off = cloud.xyz - cloud.xyz.mean(axis=0)
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(off.T @ off)[::-1], 0.0))
    for rank, shape in ((1, "on one line"), (2, "in one plane")):
        if spread[rank] <= FLAT * spread[0]:
            msg = (
                f"{_where(cloud)}: all {len(cloud)} points lie {shape}; "
                "give a scan of a whole tree with x, y and z"
            )
            raise NotATreeError(msg)


def _where(cloud: PointCloud) -> str:
    source = cloud.metadata.get("source", {})
    return str(source.get("path", "the cloud"))


def _points(count: int) -> str:
    return "1 point" if count == 1 else f"{count} points"
