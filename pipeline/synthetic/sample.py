"""Points on the bark of a known tree: what a scanner with an even eye would see."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field
from scipy.spatial import cKDTree

from pipeline.model import Floats, Ints, PointCloud, TreeModel
from pipeline.options import Options

BURIED_M = 0.0005
"""A point this deep inside another tube is not on the surface of the tree."""
WOOD, GROUND = 1, 2
"""Classes of the LAS specification: unclassified and ground."""


class SampleOptions(Options):
    """How the points are taken."""

    seed: int = Field(default=1, ge=0, description="the same seed gives the same points")
    density_per_m2: float = Field(default=5000.0, gt=0, description="points on a square metre of bark")
    noise_m: float = Field(
        default=0.002, ge=0, le=0.2, description="standard deviation of each coordinate in metres"
    )
    one_sided: bool = Field(default=False, description="keep only the bark that faces one scanner position")
    scanner_azimuth_deg: float = Field(
        default=0.0,
        ge=0,
        lt=360,
        description="direction from the tree to the scanner, from +x towards +y, in degrees",
    )
    scanner_distance_m: float = Field(default=12.0, gt=0, description="distance of the scanner in metres")
    ground_radius_m: float = Field(
        default=0.0, ge=0, description="radius of a flat disc of ground points (class 2) in metres; 0: none"
    )
    ground_density_per_m2: float = Field(
        default=100.0, ge=0, description="points on a square metre of ground"
    )


class _Bark:
    """The tapered tubes of a tree, as arrays over its segments."""

    def __init__(self, tree: TreeModel) -> None:
        parent = tree.skeleton.parent[1:]
        self.start = tree.skeleton.xyz[parent]
        self.along = tree.skeleton.xyz[1:] - self.start
        self.start_radius, self.end_radius = tree.start_radius[1:], tree.radius[1:]
        self.length = tree.skeleton.length[1:]
        self.area = np.pi * (self.start_radius + self.end_radius) * self.length

    def radius_at(self, segment: Ints, share: Floats) -> Floats:
        """Return the radius a share along each segment."""
        a, b = self.start_radius[segment], self.end_radius[segment]
        return np.asarray(a + (b - a) * share)


def sample(tree: TreeModel, *, options: SampleOptions | None = None) -> PointCloud:
    """Sample the bark evenly by area, where it is not inside another tube.

    Occlusion is not simulated: `one_sided` keeps what faces the scanner, hidden or not.

    Parameters
    ----------
    tree : TreeModel
    options : SampleOptions, optional

    Returns
    -------
    PointCloud
        In the tree's own coordinates and CRS, with the attribute ``classification``.
    """
    options = options or SampleOptions()
    rng = np.random.default_rng(options.seed)
    bark = _Bark(tree)
    xyz, normal, segment = _on_tubes(bark, options.density_per_m2, rng)
    kept = ~_buried(xyz, segment, bark)
    if options.one_sided:
        kept &= _faces(xyz, normal, tree.skeleton.xyz[0], options)
    xyz = xyz[kept]
    ground = _disc(tree.skeleton.xyz[0], options, rng)
    classes = np.repeat(np.array([WOOD, GROUND], dtype=np.uint8), [len(xyz), len(ground)])
    xyz = np.vstack([xyz, ground])
    xyz = xyz + rng.normal(0, options.noise_m, xyz.shape)
    skeleton = tree.skeleton
    return PointCloud(xyz, skeleton.origin, skeleton.crs, {"classification": classes})


def _on_tubes(bark: _Bark, density: float, rng: Generator) -> tuple[Floats, Floats, Ints]:
    """Return points on all tubes, their normals and the segment of each."""
    counts = rng.poisson(bark.area * density)
    segment = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
    share, angle = rng.random(len(segment)), rng.uniform(0, 2 * np.pi, len(segment))
    axis = bark.along / np.where(bark.length > 0, bark.length, 1)[:, None]
    helper = np.where(np.abs(axis[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    across = np.cross(axis, helper)
    across /= np.linalg.norm(across, axis=1)[:, None]
    other = np.cross(axis, across)
    normal = np.cos(angle)[:, None] * across[segment] + np.sin(angle)[:, None] * other[segment]
    foot = bark.start[segment] + share[:, None] * bark.along[segment]
    return foot + bark.radius_at(segment, share)[:, None] * normal, normal, segment


def _buried(xyz: Floats, segment: Ints, bark: _Bark) -> NDArray[np.bool_]:
    """Return which points lie inside a tube other than their own."""
    reach = bark.length / 2 + np.maximum(bark.start_radius, bark.end_radius)
    near = cKDTree(xyz).query_ball_point(bark.start + bark.along / 2, reach)
    inside = np.zeros(len(xyz), dtype=bool)
    for tube, found in enumerate(near):
        points = np.array(found, dtype=np.int64)
        offset = xyz[points] - bark.start[tube]
        share = offset @ bark.along[tube] / max(bark.length[tube] ** 2, 1e-12)
        away = np.linalg.norm(offset - share[:, None] * bark.along[tube], axis=1)
        radius = bark.radius_at(np.full(len(points), tube), share)
        within = (share > 0) & (share < 1) & (away < radius - BURIED_M) & (segment[points] != tube)
        inside[points[within]] = True
    return inside


def _faces(xyz: Floats, normal: Floats, foot: Floats, options: SampleOptions) -> NDArray[np.bool_]:
    """Return which points face a scanner at eye height."""
    azimuth = np.radians(options.scanner_azimuth_deg)
    away = options.scanner_distance_m * np.array([np.cos(azimuth), np.sin(azimuth), 0])
    scanner = foot + away + np.array([0, 0, 1.6])
    return np.asarray(((scanner - xyz) * normal).sum(axis=1) > 0)


def _disc(foot: Floats, options: SampleOptions, rng: Generator) -> Floats:
    """Return points on flat ground around the foot, outside the flare of the stem."""
    area = np.pi * options.ground_radius_m**2
    count = rng.poisson(area * options.ground_density_per_m2)
    away = options.ground_radius_m * np.sqrt(rng.uniform(0.03, 1, count))
    angle = rng.uniform(0, 2 * np.pi, count)
    return np.asarray(foot + np.column_stack([away * np.cos(angle), away * np.sin(angle), np.zeros(count)]))
