"""Choosing a skeleton method by name, and saying why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field
from scipy.spatial import cKDTree

from pipeline.errors import NotATreeError
from pipeline.geometry.azimuth import Frame
from pipeline.geometry.linearity import DENSE_M
from pipeline.model import PointCloud, Skeleton
from pipeline.skeleton.geodesic import GeodesicOptions, by_geodesic
from pipeline.skeleton.greedy import HANGING, GreedyOptions, by_greedy
from pipeline.skeleton.minimal_length import MinimalOptions, by_minimal_length
from pipeline.skeleton.mst import MstOptions, by_mst
from pipeline.skeleton.space_colonization import SpaceColonizationOptions, by_space_colonization

CLOSE_M = 0.045  # greedy finds more, and more exactly, beyond; docs/skeleton-methods.md
SEVERAL, REACH = 6, 3.0  # points strewn over a surface have six others within three times their distance
FEW = 20  # points that may not be enough to see the trunk


class SkeletonOptions(MstOptions, GeodesicOptions, GreedyOptions, SpaceColonizationOptions, MinimalOptions):
    """Options of the skeleton stage."""

    method: Literal["auto", "mst", "geodesic", "greedy", "space-colonization", "minimal-length"] = Field(
        "auto", description="skeleton method; auto chooses and says why"
    )


METHODS: dict[str, Callable[[PointCloud, SkeletonOptions], Skeleton]] = {
    "mst": by_mst,
    "geodesic": by_geodesic,
    "greedy": by_greedy,
    "space-colonization": by_space_colonization,
    "minimal-length": by_minimal_length,
}


def extract(cloud: PointCloud, *, options: SkeletonOptions | None = None) -> Skeleton:
    """Extract the skeleton of one cleaned tree.

    Parameters
    ----------
    cloud : PointCloud
        A cleaned cloud, in canonical order.
    options : SkeletonOptions, optional

    Returns
    -------
    Skeleton
        Numbered path by path; its metadata tells the method and the reason for it.

    Raises
    ------
    NotATreeError
        If the points make no tree, as where there are none.
    """
    options = options or SkeletonOptions()
    if not len(cloud):
        msg = "the cloud has no points, a skeleton takes two; is it the right file, did cleaning keep any?"
        raise NotATreeError(msg)
    if not np.ptp(cloud.xyz, axis=0).any():
        msg = f"all points ({len(cloud)}) come down to one place; give a scan of a whole tree with x, y and z"
        raise NotATreeError(msg)
    name: str = options.method
    reason = "asked for"
    if name == "auto":
        name, reason = _choose(cloud)
    frame = Frame.of(cloud.xyz, cloud.metadata)
    skeleton = frame.skeleton_back(METHODS[name](frame.cloud(cloud), options))
    known = dict(skeleton.metadata)
    words = (reason, known.pop("method_note", None))  # what a method says of itself, for the report
    known |= {"method": name, "method_reason": "; ".join(word for word in words if word)}
    return replace(skeleton, metadata=known)


def _choose(cloud: PointCloud) -> tuple[str, str]:
    """Geodesic where the points lie close enough to show surfaces, else growth from point to point.

    docs/skeleton-methods.md has the figures. Leaves and a hidden trunk do not change the choice; they are
    told because they say how far to trust the skeleton.
    """
    spacing = cloud.metadata.get("spacing_m")
    if spacing is None:
        spacing = _apart(cloud, 1)
    told = f"points every {1000 * spacing:.0f} mm"
    if spacing <= CLOSE_M:
        return "geodesic", f"dense: {told} show surfaces{_circumstances(cloud)}"
    if spacing <= DENSE_M and _apart(cloud, SEVERAL) / REACH <= CLOSE_M:
        return "geodesic", f"dense: {told}, evenly thinned, show surfaces{_circumstances(cloud)}"
    return "greedy", f"sparse: {told}, too few to show surfaces{_circumstances(cloud)}"


def _apart(cloud: PointCloud, count: int) -> float:
    """Median distance within which a point has so many others, metres."""
    count = min(count, len(cloud) - 1)
    return float(
        np.median(cKDTree(cloud.xyz).query(cloud.xyz, k=count + 1)[0].reshape(len(cloud), -1)[:, -1])
    )


def _circumstances(cloud: PointCloud) -> str:
    """Say what share of the points were leaves, and whether anything supports the trunk."""
    leaf = int(cloud.metadata.get("dropped", {}).get("leaf", 0))
    z = cloud.xyz[:, 2]
    foot = min(float(cloud.metadata.get("ground_z", z.min())), float(z.min()))
    low = np.count_nonzero(z - foot <= HANGING * (z.max() - foot))
    words = [f"{leaf / (leaf + len(cloud)):.0%} of the points were leaves"] if leaf else []
    words += [f"points on the lower trunk: {low}"] if low < FEW else []
    return "".join(f"; {word}" for word in words)
