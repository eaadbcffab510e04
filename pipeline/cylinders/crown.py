"""What kind of crown is fitted: its width, and whether its points can be taken for bark."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, cKDTree

from pipeline.geometry.linearity import DENSE_M, is_leafy
from pipeline.model import PointCloud

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Crown:
    """A tree's crown as a whole.

    Parameters
    ----------
    diameter_m : float
        Of the circle with the area of the points' convex hull in plan, metres.
    spacing_m : float
        Median distance of neighbouring points, metres.
    leafy : bool
        Whether leaves keep the bark from showing.
    in_leaf : bool
        Whether leaves were dropped, so that some are left around the twigs.
    """

    diameter_m: float
    spacing_m: float
    leafy: bool
    in_leaf: bool = False

    @property
    def sparse(self) -> bool:
        """Whether the points are too few for bark to show."""
        return self.spacing_m > DENSE_M

    @property
    def shows_bark(self) -> bool:
        """Whether a radius may be believed where the points do not look like a shell."""
        return not (self.leafy or self.sparse)


def crown_of(cloud: PointCloud, xyz: Floats) -> Crown:
    """Width of the crown, and whether its points show bark.

    Parameters
    ----------
    cloud : PointCloud
        Whose metadata tell the area and the spacing, where it was cleaned.
    xyz : (P, 3) array
        Its points, metres.
    """
    area, spacing = cloud.metadata.get("crown_area_m2"), cloud.metadata.get("spacing_m")
    if area is None:
        area = ConvexHull(xyz[:, :2]).volume
    if spacing is None:
        spacing = np.median(cKDTree(xyz).query(xyz, k=2)[0][:, 1])
    leafy = cloud.metadata.get("leafy_points")
    if leafy is None:
        leafy = is_leafy(xyz)
    return Crown(float(2.0 * np.sqrt(area / np.pi)), float(spacing), bool(leafy), _leaves_dropped(cloud))


def _leaves_dropped(cloud: PointCloud) -> bool:
    return bool(dict(cloud.metadata.get("dropped") or {}).get("leaf"))
