"""Small airborne clouds of known trees, cut out as the segmentation does."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from pipeline.airborne.modelling import Stages
from pipeline.airborne.raster import Raster
from pipeline.airborne.tree import AirborneTree
from pipeline.config import read_config
from pipeline.model import PointCloud

ORIGIN = np.array([121_000.0, 487_000.0, 0.0])


def stages() -> Stages:
    """Options of the preset for airborne clouds."""
    config = read_config(preset="airborne")
    return Stages(config.clean, config.skeleton, config.cylinders)


def crown(points: int = 300, *, height: float = 15.0, width: float = 6.0, seed: int = 0) -> PointCloud:
    """A crown like an egg above the ground at 0, without a stem."""
    rng = np.random.default_rng(seed)
    off = rng.normal(size=(points, 3))
    off *= rng.random((points, 1)) ** (1 / 3) / np.linalg.norm(off, axis=1, keepdims=True)
    xyz = np.array([20.0, 30.0, 0.65 * height]) + off * [width / 2, width / 2, 0.33 * height]
    xyz[0] = 20.0, 30.0, height
    return PointCloud(np.round(xyz * 4096) / 4096, ORIGIN, "EPSG:7415")


def outlined(cloud: PointCloud, ground_z: float = 0.0) -> AirborneTree:
    """All points of a cloud as one tree."""
    xyz = cloud.xyz
    apex = xyz[np.argmax(xyz[:, 2])]
    ring, area = apex[:2] + [[0, 0], [1, 0], [0, 1]], 0.5
    if len(xyz) > 3:
        hull = ConvexHull(xyz[:, :2])
        ring, area = xyz[hull.vertices, :2], float(hull.volume)
    wide = float(2 * np.sqrt(area / np.pi))
    return AirborneTree(np.arange(len(xyz)), apex, ground_z, apex[:2], ring, area, wide, 4.0)


def level(cloud: PointCloud, ground_z: float = 0.0) -> Raster:
    """Flat terrain below a cloud."""
    low = np.floor(cloud.xyz[:, :2].min(axis=0)) - 10.0
    return Raster(np.full((200, 200), ground_z), low, 0.5)
