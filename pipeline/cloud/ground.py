"""The ground at the tree: its surface, and where on it the tree stands."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.geometry.voxels import cell_keys

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

CELL_M = 0.2  # side of the plan cells whose median height makes the surface
NEAREST = 12  # cells that say how high the ground is at one place
MAX_LAYER_M = 0.1  # a rougher surface does not make the stem's lowest decimetre ground
STEEPEST = 1.0  # rise over run; steeper comes of points that do not span a plane
REACH_M = 1.5  # a place further from every ground cell has no ground below it
FOOT_RADIUS_M = 0.4  # points that belong to one foot
SUPPORT = 3  # points that must lie together for a height to count as the tree's lowest
FAST_ENOUGH = 5_000  # points of the lowest slab that suffice to find the foot
ROBUST = 1.4826  # median absolute deviation of a normal distribution -> its standard deviation
TUKEY = 4.685  # biweight constant for 95 % efficiency


@dataclass(frozen=True, eq=False)
class Ground:
    """A ground surface: a robust plane, and what the median heights of small cells differ from it.

    Parameters
    ----------
    corner : (3,) array
        Lowest corner of the ground points in metres; the plane's zero.
    plane : (3,) array
        Coefficients (a, b, c) of z = a x + b y + c from `corner`.
    cells : (M, 3) array
        Mean x, mean y (from `corner`) and median height above the plane of every cell.
    layer_m : float
        Height above the surface below which a point still is ground, in metres.
    """

    corner: Floats
    plane: Floats
    cells: Floats
    layer_m: float = 0.0

    @classmethod
    def through(cls, points: Floats, *, least_layer_m: float) -> Ground:
        """Make the surface through (G, 3) ground points in metres, at least one.

        Its layer is three robust deviations of the points thick, but no less than `least_layer_m`
        and no more than `MAX_LAYER_M` (unless the former asks for it).
        """
        corner = points.min(axis=0)
        local = np.round(points - corner, 5)
        local = local[np.lexsort(local.T)]
        cells = cell_medians(local)
        plane = robust_plane(cells)
        if np.hypot(*plane[:2]) > STEEPEST:
            plane = np.array([0.0, 0.0, float(np.median(cells[:, 2]))])
        cells[:, 2] -= on_plane(plane, cells)
        surface = cls(corner, plane, cells)
        off = np.median(np.abs(local[:, 2] + corner[2] - surface.height(local[:, :2] + corner[:2])))
        layer = np.clip(3 * ROBUST * off, least_layer_m, max(least_layer_m, MAX_LAYER_M))
        return replace(surface, layer_m=float(layer))

    @cached_property
    def _tree(self) -> cKDTree:
        return cKDTree(self.cells[:, :2])

    def height(self, xy: Floats) -> Floats:
        """(P,) height of the ground at (P, 2) places, in metres."""
        return self._below(np.asarray(xy, dtype=np.float64))[0]

    def layer(self, xyz: Floats) -> Mask:
        """(P,) mask of the points in the ground layer or below it, where there is ground below them."""
        mask = np.zeros(len(xyz), dtype=bool)
        rough = xyz[:, 2] - self.corner[2] - on_plane(self.plane, xyz - self.corner)
        low = np.flatnonzero(rough <= self.layer_m + self.cells[:, 2].max())
        if len(low):
            height, away = self._below(xyz[low, :2])
            mask[low] = (xyz[low, 2] - height <= self.layer_m) & (away <= REACH_M)
        return mask

    def distance(self, place: Floats) -> float:
        """Horizontal distance from a place to the nearest ground cell, in metres."""
        return float(self._below(place[None])[1][0])

    def _below(self, xy: Floats) -> tuple[Floats, Floats]:
        """Height of the ground below each place, and how far aside the nearest cell is."""
        local = xy - self.corner[:2]
        count = np.arange(1, min(NEAREST, len(self.cells)) + 1)
        away, near = self._tree.query(local, k=count)
        weight = 1.0 / (away**2 + (CELL_M / 2) ** 2)
        over = (weight * self.cells[near, 2]).sum(axis=1) / weight.sum(axis=1)
        return self.corner[2] + on_plane(self.plane, local) + over, away[:, 0]


def foot(xyz: Floats, slab_m: float = 0.5) -> Floats:
    """Where the tree stands: x and y of the densest spot among its lowest points.

    Parameters
    ----------
    xyz : (P, 3) array
        Points of the tree without the ground, in metres, in canonical order; at least one.
    slab_m : float
        Thickness of the lowest slab.
    """
    low = xyz[xyz[:, 2] <= lowest(xyz) + slab_m, :2]
    low = low[:: 1 + len(low) // FAST_ENOUGH]
    count = cKDTree(low).query_ball_point(low, FOOT_RADIUS_M, return_length=True)
    spot = low[int(np.argmax(count))]
    return np.asarray(np.median(low[np.hypot(*(low - spot).T) <= FOOT_RADIUS_M], axis=0))


def lowest(xyz: Floats, within_m: float = 0.25) -> float:
    """Lowest height that several points share: a lone point below the tree does not count.

    Parameters
    ----------
    xyz : (P, 3) array
        At least one point.
    within_m : float
        From the answer upwards, `SUPPORT` points lie within this height.
    """
    heights = np.sort(xyz[:, 2])
    spread = heights[SUPPORT - 1 :] - heights[: len(heights) - SUPPORT + 1]
    held = np.flatnonzero(spread <= within_m)
    return float(heights[held[0]] if len(held) else heights[0])


def below(xyz: Floats, within_m: float) -> Mask:
    """(P,) mask of the one or two lone points below the tree; more than two are its own sparse stem."""
    under = xyz[:, 2] < lowest(xyz, within_m)
    return under if under.sum() < SUPPORT else np.zeros(len(xyz), dtype=bool)


def cell_medians(local: Floats) -> Floats:
    """(M, 3) mean x, mean y and median z of the points in every plan cell of `CELL_M`."""
    keys = plan_keys(local)
    order = np.lexsort((local[:, 2], keys))
    _, first, count = np.unique(keys[order], return_index=True, return_counts=True)
    held = local[order]
    mean = np.add.reduceat(held[:, :2], first, axis=0) / count[:, None]
    median = (held[first + (count - 1) // 2, 2] + held[first + count // 2, 2]) / 2
    return np.column_stack([mean, median])


def plan_keys(local: Floats) -> Ints:
    """(P,) one integer per plan cell of `CELL_M`."""
    flat = local.copy()
    flat[:, 2] = 0.0
    return cell_keys(flat, CELL_M)


def on_plane(plane: Floats, local: Floats) -> Floats:
    """(P,) height of a plane at the x and y of `local`."""
    return np.asarray(local[:, :2] @ plane[:2] + plane[2])


def robust_plane(local: Floats, rounds: int = 15) -> Floats:
    """Coefficients (a, b, c) of z = a x + b y + c, with Tukey's biweight against what stands out."""
    design = np.column_stack([local[:, :2], np.ones(len(local))])
    if len(local) < 3:
        return np.array([0.0, 0.0, float(np.median(local[:, 2]))])
    weight = np.ones(len(local))
    plane = np.zeros(3)
    for _ in range(rounds):
        root = np.sqrt(weight)
        plane = np.linalg.lstsq(design * root[:, None], local[:, 2] * root, rcond=None)[0]
        off = np.abs(local[:, 2] - design @ plane)
        scale = max(TUKEY * ROBUST * float(np.median(off)), 1e-3)
        weight = np.clip(1 - (off / scale) ** 2, 0, None) ** 2
    return plane
