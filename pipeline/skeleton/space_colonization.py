"""Growth into the cloud: the stem by circles, then nodes that the points attract and that use them up."""

from __future__ import annotations

from typing import Self

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator
from scipy.spatial import cKDTree

from pipeline.errors import NotATreeError
from pipeline.geometry.azimuth import STEM
from pipeline.geometry.colonization import Colony, Rules, colonize
from pipeline.geometry.voxels import cell_means
from pipeline.model import PointCloud, Skeleton
from pipeline.options import Options
from pipeline.skeleton.greedy import airborne_flags, stem_of
from pipeline.skeleton.rooted import LEAST_THICKNESS_M, Rooted, skeleton_of
from pipeline.skeleton.simplification import simplify
from pipeline.skeleton.stem import Stem

Floats = NDArray[np.float64]

STEM_THICKNESS_M = 0.1  # of the stem's nodes beside the others', so that the stem goes on as the stem
MOST_ITERATIONS = 2000  # in one go; a tip comes a step further in each
WIDER = 1.5  # by so much tips see farther where growth ends before the points do
FARTHEST_SHARE = 0.5  # of the cloud's height, the farthest that they ever see


class SpaceColonizationOptions(Options):
    """Options of the space colonization skeleton; lengths follow the spacing of the points."""

    range_noise_m: float = Field(0.02, gt=0, le=0.2, description="range noise to expect on bark, metres")
    colony_spacing_m: float = Field(
        0.05, gt=0, le=1, description="least spacing that points are gathered to, metres"
    )
    colony_step: float = Field(0.5, gt=0, le=10, description="length of a new segment, in spacings")
    colony_influence: float = Field(
        2.5, gt=0, le=100, description="how far a tip sees points at first, in spacings; then ever farther"
    )
    colony_kill: float = Field(0.5, gt=0, le=50, description="how near a node uses points up, in spacings")
    colony_perception_deg: float = Field(
        360.0, gt=0, le=360, description="full angle of the cone in which a node sees points, degrees"
    )
    direction_window_m: float = Field(
        0.2, gt=0, le=5, description="length over which a branch's direction is taken at a fork, metres"
    )

    @model_validator(mode="after")
    def _sees_before_it_kills(self) -> Self:
        if self.colony_kill >= self.colony_influence:
            msg = (
                f"colony_kill {self.colony_kill:g} is not below colony_influence {self.colony_influence:g}: "
                "points would vanish before they attract a node; lower the one or raise the other"
            )
            raise ValueError(msg)
        return self


def by_space_colonization(cloud: PointCloud, options: SpaceColonizationOptions) -> Skeleton:
    """Extract a skeleton by letting a tree grow into the points.

    The stem comes from circles of bark, or straight from the ground where none show. Tips see little more
    than the next point at first, so that growth follows the branches; where it ends before the points do,
    they see farther and it goes on.

    Parameters
    ----------
    cloud : PointCloud
        A cleaned cloud of one tree, in canonical order.
    options : SpaceColonizationOptions

    Returns
    -------
    Skeleton
        Numbered path by path. Its metadata hold `stem_circles` and `noise_m` as of the greedy method,
        `stop_reason` and the share of points `unused`.

    Raises
    ------
    NotATreeError
        If fewer than two points are left after thinning.

    References
    ----------
    Runions, Lane & Prusinkiewicz (2007), "Modeling trees with a space colonization algorithm". Changed: the
    attraction points are those of a scan, and the influence distance widens where they lie apart.
    """
    points, spacing = _gathered(cloud.xyz, options.colony_spacing_m)
    stem = stem_of(cloud, cloud.xyz, points, options.range_noise_m)
    colony = _grown(points[~stem.claims(points)], stem, spacing, options)
    tree = simplify(_rooted(colony, len(stem.xyz)), share=0.0, floor_m=0.2 * spacing)
    skeleton = skeleton_of(tree, cloud, max(options.direction_window_m, 2.0 * spacing))
    unused = float(colony.left.mean()) if len(colony.left) else 0.0
    known = {
        **{key: value for key, value in skeleton.metadata.items() if key != STEM},
        "flags": airborne_flags(cloud, stem, points),
        "stem_circles": stem.circles,
        "noise_m": options.range_noise_m,
        "stop_reason": colony.reason,
        "unused": round(unused, 6),
    }
    return Skeleton(skeleton.xyz, skeleton.parent, skeleton.origin, skeleton.crs, known)


def _gathered(xyz: Floats, least_m: float) -> tuple[Floats, float]:
    """Gather the points to their least spacing; their median distance from each other then."""
    points = cell_means(xyz, least_m)
    if len(points) < 2:
        msg = f"the points fall on {len(points)} node at a spacing of {least_m:g} m; is the unit metres?"
        raise NotATreeError(msg)
    return points, max(float(np.median(cKDTree(points).query(points, k=2)[0][:, 1])), least_m)


def _grown(points: Floats, stem: Stem, spacing: float, options: SpaceColonizationOptions) -> Colony:
    """Grow until no point is left, or those left are too far from everything."""
    kill = np.full(MOST_ITERATIONS, options.colony_kill * spacing)
    height = float(np.ptp(np.concatenate([points[:, 2], stem.xyz[:, 2]])))
    farthest = max(FARTHEST_SHARE * height, options.colony_influence * spacing)
    reach = options.colony_influence * spacing
    xyz, parent = stem.xyz, np.arange(len(stem.xyz)) - 1
    left = np.ones(len(points), dtype=bool)
    while True:
        rules = Rules(options.colony_step * spacing, reach, options.colony_perception_deg)
        colony = colonize(points[left], (xyz, parent), rules=rules, kill_m=kill)
        xyz, parent = colony.xyz, colony.parent
        left[left] = colony.left
        if colony.reason in {"exhausted", "max_iter"} or reach >= farthest:
            return colony._replace(left=left)
        reach = min(WIDER * reach, farthest)


def _rooted(colony: Colony, stem: int) -> Rooted:
    thickness = np.full(len(colony.xyz), LEAST_THICKNESS_M)
    thickness[:stem] = STEM_THICKNESS_M
    return Rooted(colony.xyz, colony.parent, thickness, np.ones(len(colony.xyz)))
