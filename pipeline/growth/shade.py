"""What stands around a growing tree and never changes: neighbours (points) and buildings (boxes)."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import UsageError
from pipeline.geometry.compiled import compiled
from pipeline.growth.lattice import Voxels
from pipeline.growth.options import GrowthOptions
from pipeline.growth.pyramid import FIXED, fixed, pyramid
from pipeline.growth.state import Mask
from pipeline.model import Floats

COARSE = 5
"""Voxels along the edge of a cell that sees one share of the sky."""
SKY_WAYS = 64
GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


@dataclass(frozen=True, eq=False)
class Shade:
    """Neighbours and buildings.

    Parameters
    ----------
    points : (P, 3) array of float64
        Points of neighbouring trees, metres; every voxel that holds one shades like a metamer.
    boxes : (B, 2, 3) array of float64
        Lowest and highest corner of buildings, metres. Nothing grows within, and around them the share of
        the sky that they hide is lost.

    Raises
    ------
    UsageError
        If the arrays have other shapes or hold what is not finite, or a box has no inside.
    """

    points: Floats = field(default_factory=lambda: np.zeros((0, 3)))
    boxes: Floats = field(default_factory=lambda: np.zeros((0, 2, 3)))

    def __post_init__(self) -> None:
        points = np.asarray(self.points, dtype=np.float64)
        boxes = np.asarray(self.boxes, dtype=np.float64)
        if points.ndim != 2 or points.shape[1:] != (3,) or boxes.ndim != 3 or boxes.shape[1:] != (2, 3):
            msg = (
                f"shade has points of shape {points.shape} and boxes of shape {boxes.shape}; give (P, 3) "
                "points and (B, 2, 3) boxes, lowest corner first"
            )
            raise UsageError(msg)
        if not (np.isfinite(points).all() and np.isfinite(boxes).all() and (boxes[:, 0] < boxes[:, 1]).all()):
            msg = "shade holds a value that is not finite, or a box whose first corner is not its lowest"
            raise UsageError(msg)
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "boxes", boxes)

    def block(self, low: Voxels, shape: Voxels, *, options: GrowthOptions) -> Voxels:
        """Return the shade in a box of voxels, times `FIXED`.

        Parameters
        ----------
        low, shape : (3,) arrays of int64
            The lowest voxel and how many there are.
        options : GrowthOptions
        """
        block = self._by_neighbours(low, shape, options)
        if len(self.boxes):
            block += self._by_buildings(low, shape, options)
        return block

    def inside(self, points: Floats) -> Mask:
        """(P,) which points lie in a building."""
        hit = (points[:, None] >= self.boxes[None, :, 0]) & (points[:, None] <= self.boxes[None, :, 1])
        return np.asarray(np.any(np.all(hit, axis=2), axis=1))

    def _by_neighbours(self, low: Voxels, shape: Voxels, options: GrowthOptions) -> Voxels:
        form = pyramid(options)
        voxel = np.unique(np.floor(self.points / options.voxel_m).astype(np.int64), axis=0) - low
        near = ((voxel >= -form.reach) & (voxel < shape + form.reach)).all(axis=1)
        block = np.zeros(tuple(shape.tolist()), dtype=np.int64)
        at = (voxel[near][:, None] + form.offset).reshape(-1, 3)
        amount = np.tile(form.amount, int(near.sum()))
        held = ((at >= 0) & (at < shape)).all(axis=1)
        np.add.at(block, tuple(at[held].T), amount[held])
        return block

    def _by_buildings(self, low: Voxels, shape: Voxels, options: GrowthOptions) -> Voxels:
        """Share of the sky that is hidden, cell by cell; all light is lost within."""
        first, last = low // COARSE, (low + shape - 1) // COARSE
        cells = last - first + 1
        index = np.stack(np.meshgrid(*map(np.arange, cells.tolist()), indexing="ij"), axis=-1).reshape(-1, 3)
        edge = COARSE * options.voxel_m
        middle = np.asarray((first + index + 0.5) * edge, dtype=np.float64)
        hidden = sky_hidden(middle, self.boxes, sky())
        coarse = np.rint(hidden * fixed(options.full_light)).astype(np.int64).reshape(cells)
        for axis in range(3):
            coarse = coarse.repeat(COARSE, axis=axis)
        at = low - first * COARSE
        block = coarse[
            tuple(slice(a, a + n) for a, n in zip(at.tolist(), shape.tolist(), strict=True))
        ].copy()
        for box in self.boxes:
            begin = np.clip(np.floor(box[0] / options.voxel_m).astype(np.int64) - low, 0, shape)
            end = np.clip(np.floor(box[1] / options.voxel_m).astype(np.int64) - low + 1, 0, shape)
            dark = fixed(options.full_light) + FIXED * int(np.ceil(options.shade))
            block[tuple(slice(a, b) for a, b in zip(begin.tolist(), end.tolist(), strict=True))] += dark
        return np.asarray(block, dtype=np.int64)


def sky() -> Floats:
    """(64, 3) unit vectors that share the sky, denser near the zenith, whose light counts more."""
    k = np.arange(SKY_WAYS)
    flat = np.sqrt((k + 0.5) / SKY_WAYS)
    turn = GOLDEN * k
    return np.column_stack([flat * np.cos(turn), flat * np.sin(turn), np.sqrt(1.0 - flat * flat)])


@compiled
def sky_hidden(points: Floats, boxes: Floats, ways: Floats) -> NDArray[np.float64]:
    """(P,) share of the ways from each point that meet a box."""
    out = np.zeros(len(points))
    for p in range(len(points)):
        hits = 0
        for w in range(len(ways)):
            for b in range(len(boxes)):
                near, far = 0.0, np.inf
                for c in range(3):
                    at, way = points[p, c], ways[w, c]
                    if abs(way) < 1e-12:
                        if at < boxes[b, 0, c] or at > boxes[b, 1, c]:
                            far = -1.0
                        continue
                    one, two = (boxes[b, 0, c] - at) / way, (boxes[b, 1, c] - at) / way
                    near, far = max(near, min(one, two)), min(far, max(one, two))
                if near <= far:
                    hits += 1
                    break
        out[p] = hits / len(ways)
    return out
