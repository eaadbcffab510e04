"""Choosing a skeleton method by name, and saying why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Literal

import numpy as np
from pydantic import Field
from scipy.spatial import cKDTree

from pipeline.geometry.azimuth import Frame
from pipeline.geometry.linearity import DENSE_M
from pipeline.model import PointCloud, Skeleton
from pipeline.skeleton.geodesic import GeodesicOptions, by_geodesic
from pipeline.skeleton.greedy import GreedyOptions, by_greedy
from pipeline.skeleton.minimal_length import MinimalOptions, by_minimal_length
from pipeline.skeleton.mst import MstOptions, by_mst
from pipeline.skeleton.space_colonization import SpaceColonizationOptions, by_space_colonization


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
    """
    options = options or SkeletonOptions()
    name: str = options.method
    reason = "asked for"
    if name == "auto":
        name, reason = _choose(cloud)
    frame = Frame.of(cloud.xyz, cloud.metadata)
    skeleton = frame.skeleton_back(METHODS[name](frame.cloud(cloud), options))
    known = {**skeleton.metadata, "method": name, "method_reason": reason}
    return replace(skeleton, metadata=known)


def _choose(cloud: PointCloud) -> tuple[str, str]:
    """Geodesic where the points lie close enough to show surfaces, else growth from point to point."""
    spacing = cloud.metadata.get("spacing_m")
    if spacing is None:
        spacing = np.median(cKDTree(cloud.xyz).query(cloud.xyz, k=2)[0][:, 1])
    if spacing <= DENSE_M:
        return "geodesic", f"dense: points every {1000 * spacing:.0f} mm"
    return "greedy", f"sparse: points every {1000 * spacing:.0f} mm, too few to show surfaces"
