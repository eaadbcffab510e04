"""Light by shadow: every metamer darkens a pyramid of voxels below itself, in whole numbers."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.growth.lattice import Lattice, Voxels, zeros
from pipeline.growth.markers import Markers
from pipeline.growth.options import GrowthOptions
from pipeline.growth.pyramid import FIXED, Pyramid, fixed, pyramid
from pipeline.growth.shade import Shade
from pipeline.growth.sight import BudLight, bud_light
from pipeline.growth.state import Mask, Metamers
from pipeline.model import Floats, Ints

REACH = 2
"""Radius, in voxels, of the sphere in which a bud feels shade."""


class Light(Protocol):
    """What a bud sees of the light; either model answers the same three questions."""

    def add(self, points: Floats) -> None:
        """Let metamers end at (P, 3) points."""

    def remove(self, points: Floats) -> None:
        """Take away what `add` did, to the bit."""

    def at_buds(self, tree: Metamers) -> BudLight:
        """Return the light of every bud."""

    def towards(self, tree: Metamers, metamer: Ints, is_lateral: Mask) -> Floats:
        """(K, 3) where there is more of it, for some buds: unit vectors, 0 where all sides are alike."""


def light_for(options: GrowthOptions, seed: int, foot: Floats, shade: Shade | None) -> Light:
    """Return the model of light that the options name."""
    if options.light == "space":
        return Markers(options, seed, foot, shade)
    return Shadow(options, shade)


class Around(NamedTuple):
    """The voxels in which a bud feels shade: offsets (M, 3) and the unit vectors to them."""

    offset: Voxels
    way: Floats


class Shadow:
    """A grid of shade.

    Parameters
    ----------
    options : GrowthOptions
    shade : Shade, optional
        What stands around and never changes.

    Attributes
    ----------
    grid : Lattice
        Shade times `FIXED`, whole numbers: adding and removing the same metamer leaves no trace.
    """

    def __init__(self, options: GrowthOptions, shade: Shade | None = None) -> None:
        self._options = options
        self._pyramid: Pyramid = pyramid(options)
        self._around = around(REACH)
        fill = partial(shade.block, options=options) if shade is not None else zeros
        self.grid: Lattice[np.int64] = Lattice(options.voxel_m, fill)

    def add(self, points: Floats) -> None:
        """Cast the shade of metamers that end at (P, 3) points."""
        self._cast(points, 1)

    def remove(self, points: Floats) -> None:
        """Take their shade away."""
        self._cast(points, -1)

    def at_buds(self, tree: Metamers) -> BudLight:
        """Return the light of every bud: both buds of a metamer are at its end and see the same."""
        grid, options = self.grid, self._options
        grid.cover(tree.end[: len(tree)], REACH)
        most = fixed(options.full_light) + fixed(options.shade)
        light = light_at(grid.values, grid.low, grid.voxel_m, tree.end[: len(tree)], most)
        return bud_light(tree, light / FIXED, light / FIXED)

    def towards(self, tree: Metamers, metamer: Ints, is_lateral: Mask) -> Floats:  # noqa: ARG002 (both alike)
        """(K, 3) away from the shade around the ends of metamers."""
        grid = self.grid
        points = tree.end[metamer]
        grid.cover(points, REACH)
        if self._options.direction == "discrete":
            near = around(1)
            return to_least(grid.values, grid.low, grid.voxel_m, points, near)
        return away_from_shade(grid.values, grid.low, grid.voxel_m, points, self._around)

    def _cast(self, points: Floats, sign: int) -> None:
        grid = self.grid
        grid.cover(points, self._pyramid.reach)
        cast(grid.values, grid.low, grid.voxel_m, points, self._pyramid.offset, sign * self._pyramid.amount)


def around(reach: int) -> Around:
    """Return the voxels within a sphere around one, itself not counted."""
    span = np.arange(-reach, reach + 1)
    offset = np.stack(np.meshgrid(span, span, span, indexing="ij"), axis=-1).reshape(-1, 3)
    if reach > 1:
        offset = offset[(offset**2).sum(axis=1) <= reach * reach]
    offset = offset[(offset != 0).any(axis=1)].astype(np.int64)
    return Around(offset, offset / np.linalg.norm(offset, axis=1, keepdims=True))


@compiled
def make_unit(way: Floats) -> None:
    """Make a vector a unit vector, or 0 where it is next to nothing."""
    size = np.sqrt((way * way).sum())
    if size > 1e-6:
        way /= size
    else:
        way[:] = 0.0


@compiled
def cast(
    values: Voxels, low: Voxels, voxel: float, points: Floats, offset: Voxels, amount: NDArray[np.int64]
) -> None:
    """Add a pyramid of amounts at every point; all of it lies within the grid."""
    for p in range(len(points)):
        i = int(np.floor(points[p, 0] / voxel)) - low[0]
        j = int(np.floor(points[p, 1] / voxel)) - low[1]
        k = int(np.floor(points[p, 2] / voxel)) - low[2]
        for m in range(len(amount)):
            values[i + offset[m, 0], j + offset[m, 1], k + offset[m, 2]] += amount[m]


@compiled
def light_at(values: Voxels, low: Voxels, voxel: float, points: Floats, most: int) -> NDArray[np.int64]:
    """(P,) what shade leaves of the most light at points, never below 0."""
    light = np.zeros(len(points), dtype=np.int64)
    for p in range(len(points)):
        i = int(np.floor(points[p, 0] / voxel)) - low[0]
        j = int(np.floor(points[p, 1] / voxel)) - low[1]
        k = int(np.floor(points[p, 2] / voxel)) - low[2]
        light[p] = max(most - values[i, j, k], 0)
    return light


@compiled
def away_from_shade(values: Voxels, low: Voxels, voxel: float, points: Floats, around: Around) -> Floats:
    """(P, 3) unit vectors against the sum of the ways to all voxels around, each weighed by its shade.

    The equation of the thesis (4.1) takes the way from the voxel to the bud and a minus sign besides, which
    would point into the shade.
    """
    out = np.zeros((len(points), 3))
    for p in range(len(points)):
        i = int(np.floor(points[p, 0] / voxel)) - low[0]
        j = int(np.floor(points[p, 1] / voxel)) - low[1]
        k = int(np.floor(points[p, 2] / voxel)) - low[2]
        for m in range(len(around.offset)):
            s = values[i + around.offset[m, 0], j + around.offset[m, 1], k + around.offset[m, 2]]
            for c in range(3):
                out[p, c] -= s * around.way[m, c]
        make_unit(out[p])
    return out


@compiled
def to_least(values: Voxels, low: Voxels, voxel: float, points: Floats, around: Around) -> Floats:
    """(P, 3) unit vectors to the neighbour voxels with the least shade: the mean way of equal ones."""
    out = np.zeros((len(points), 3))
    for p in range(len(points)):
        i = int(np.floor(points[p, 0] / voxel)) - low[0]
        j = int(np.floor(points[p, 1] / voxel)) - low[1]
        k = int(np.floor(points[p, 2] / voxel)) - low[2]
        least = np.iinfo(np.int64).max
        for m in range(len(around.offset)):
            s = values[i + around.offset[m, 0], j + around.offset[m, 1], k + around.offset[m, 2]]
            if s < least:
                least = s
                out[p] = 0.0
            if s == least:
                out[p] += around.way[m]
        make_unit(out[p])
    return out
