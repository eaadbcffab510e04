"""A frame of the cloud's own, so that a tree is measured the same whichever way north is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.model import PointCloud, Skeleton, TreeModel

Floats = NDArray[np.float64]

FRAME = "frame"
"""Key of the metadata that holds a cleaned cloud's frame: its azimuth (radians), and x and y (metres)."""
STEM = "stem"
"""Key of the metadata that holds a stem which is known beforehand: its foot and its top, metres."""
DECIMALS = 5  # of coordinates in the frame: 0.01 mm
STORED = 7  # of the same points where the cloud was: enough to find them in the frame again
MICROMETRE = 6  # decimals that a tree's nodes are kept to, so that a file gives back the same numbers


def middle_of(xyz: Floats) -> Floats:
    """Mean x and y, summed from the corner of the cloud: large coordinates cost no digits."""
    low = xyz[:, :2].min(axis=0)
    return np.asarray(low + (xyz[:, :2] - low).mean(axis=0))


def azimuth_of(xyz: Floats) -> float:
    """Direction of the cloud about its middle, from +x towards +y, in radians.

    That of the sum of ``|v| v`` over the horizontal offsets v from the mean, which turns with the cloud.

    Parameters
    ----------
    xyz : (P, 3) array
    """
    off = xyz[:, :2] - middle_of(xyz)
    x, y = (np.linalg.norm(off, axis=1, keepdims=True) * off).sum(axis=0)
    return float(np.arctan2(y, x))


@dataclass(frozen=True)
class Frame:
    """A turn about a vertical line.

    Parameters
    ----------
    azimuth : float
        Direction that becomes +x, radians.
    about : tuple of float
        Where the line stands, metres.
    """

    azimuth: float
    about: tuple[float, float]

    @classmethod
    def of(cls, xyz: Floats, known: Mapping[str, Any]) -> Frame:
        """Frame of a cloud: the one that cleaning has chosen, else that of its points.

        Parameters
        ----------
        xyz : (P, 3) array
            Metres.
        known : mapping
            Metadata of the cloud.
        """
        azimuth, x, y = known.get(FRAME) or (azimuth_of(xyz), *middle_of(xyz))
        return cls(float(azimuth), (float(x), float(y)))

    @property
    def as_plain(self) -> tuple[float, float, float]:
        """Three numbers that say it all, for the metadata."""
        return self.azimuth, *self.about

    @property
    def _axes(self) -> Floats:
        c, s = np.cos(self.azimuth), np.sin(self.azimuth)
        return np.array([[c, -s], [s, c]])

    def turn(self, xyz: Floats) -> Floats:
        """(P, 3) coordinates in the frame, from its vertical line."""
        flat = (xyz[:, :2] - self.about) @ self._axes
        return np.asarray(np.round(np.column_stack([flat, xyz[:, 2]]), DECIMALS) + 0.0)

    def back(self, xyz: Floats, decimals: int) -> Floats:
        """(P, 3) coordinates in the frame, where its cloud was."""
        flat = xyz[:, :2] @ self._axes.T + self.about
        return np.asarray(np.round(np.column_stack([flat, xyz[:, 2]]), decimals) + 0.0)

    def snapped(self, cloud: PointCloud) -> PointCloud:
        """The cloud on the 0.01 mm raster of this frame, which is written into its metadata."""
        xyz = self.back(self.turn(cloud.xyz), STORED)
        known = {**cloud.metadata, FRAME: self.as_plain}
        return PointCloud(xyz, cloud.origin, cloud.crs, cloud.attributes, known)

    def order(self, turned: Floats) -> NDArray[np.int64]:
        """(P,) order of turned points by z, then y, then x."""
        return np.lexsort((turned[:, 0], turned[:, 1], turned[:, 2]))

    def cloud(self, cloud: PointCloud) -> PointCloud:
        """The cloud in this frame, in the frame's own order."""
        xyz = self.turn(cloud.xyz)
        order = self.order(xyz)
        known = dict(cloud.metadata)
        if STEM in known:
            known[STEM] = self.turn(np.array(known[STEM], dtype=np.float64))
        return PointCloud(xyz[order], cloud.origin, cloud.crs, {}, known)

    def skeleton(self, skeleton: Skeleton, origin: Floats) -> Skeleton:
        """The skeleton in the frame of a cloud with this `origin`."""
        xyz = self.turn(skeleton.xyz + (skeleton.origin - origin))
        return Skeleton(xyz, skeleton.parent, origin, skeleton.crs, skeleton.metadata)

    def skeleton_back(self, skeleton: Skeleton) -> Skeleton:
        """A skeleton of this frame where its cloud was."""
        return replace(skeleton, xyz=self.back(np.round(skeleton.xyz, DECIMALS), STORED))

    def tree_back(self, tree: TreeModel) -> TreeModel:
        """A tree of this frame where its cloud was."""
        graph = replace(tree.skeleton, xyz=self.back(tree.skeleton.xyz, MICROMETRE))
        return replace(tree, skeleton=graph)
