"""Whether the points can be one tree at all; if not, one sentence that says why and what helps."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pipeline.cloud.local import usable
from pipeline.cloud.units import require_metres
from pipeline.errors import NotATreeError
from pipeline.model import PointCloud

MIN_POINTS = 10
DEGREES_OF_A_TREE = 0.005  # no crown is half a kilometre wide
FLAT = 1e-3  # thinnest direction of the cloud over its longest: a real tree is never that flat


def require_tree(cloud: PointCloud) -> None:
    """Raise `NotATreeError` if the points, not cleaned here, are too few, not finite, or without volume."""
    require_metres(cloud)
    lost = int((~usable(cloud.xyz)).sum())
    if lost:
        msg = (
            f"{_where(cloud)}: {_points(lost)} of {len(cloud)} without plausible coordinates; "
            "drop them with `treepipe clean` first"
        )
        raise NotATreeError(msg)
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
            remedy = "give a scan of a whole tree with x, y and z"
            if _could_be_degrees(cloud):
                remedy = "where x and y are degrees, reproject the points to a system in metres first"
            msg = f"{_where(cloud)}: all {len(cloud)} points lie {shape}; {remedy}"
            raise NotATreeError(msg)


def _could_be_degrees(cloud: PointCloud) -> bool:
    """Whether x and y are longitudes and latitudes by their size, and vary as little as those of a tree."""
    world = cloud.world[:, :2]
    small = (np.ptp(world, axis=0) < DEGREES_OF_A_TREE).all() and np.ptp(world, axis=0).any()
    return bool(small and (np.abs(world) <= (180, 90)).all())


def _where(cloud: PointCloud) -> str:
    source = cloud.metadata.get("source", {})
    return str(source.get("path", "the cloud"))


def _points(count: int) -> str:
    return "1 point" if count == 1 else f"{count} points"
