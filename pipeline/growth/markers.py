"""Light by space colonization: a jittered grid of markers, claimed by the buds that see them nearest."""

from __future__ import annotations

import numpy as np

from pipeline.geometry.compiled import compiled
from pipeline.growth.bound import KINDS, Limits, is_within
from pipeline.growth.chance import scramble
from pipeline.growth.claims import claim
from pipeline.growth.jitter import Grid, marker
from pipeline.growth.lattice import Lattice, Voxels
from pipeline.growth.options import GrowthOptions
from pipeline.growth.shade import Shade
from pipeline.growth.sight import BudLight, bud_light
from pipeline.growth.state import DORMANT, GROWN, Mask, Metamers
from pipeline.model import Floats, Ints

BLOCKED = 1 << 40
"""Occupancy of a marker that can never be free."""


class Markers:
    """Free space, one marker in every cell of a grid.

    Parameters
    ----------
    options : GrowthOptions
    seed : int
        Decides where in their cells the markers are.
    foot : (3,) array
        The ground is here, metres.
    shade : Shade, optional
        Markers in buildings and near neighbours are never free.

    Attributes
    ----------
    grid : Lattice
        How many metamers occupy each marker: adding and removing the same one leaves no trace.
    """

    def __init__(self, options: GrowthOptions, seed: int, foot: Floats, shade: Shade | None = None) -> None:
        self._options = options
        # compiled functions return plain integers, whose type would depend on the seed
        self._seed = np.uint64(scramble(np.uint64(seed & 0xFFFFFFFFFFFFFFFF)))
        self._occupancy = options.occupancy * options.metamer_m
        self._sight = options.perception * options.metamer_m
        self._half = float(np.cos(np.radians(options.perception_deg / 2.0)))
        half = (options.bound_width_m / 2.0, options.bound_depth_m / 2.0, options.bound_height_m / 2.0)
        self._limits = Limits(KINDS.index(options.bound), foot, half, options.bound_base_m)
        self._shade = shade
        self._way: tuple[Floats, Floats] = (np.zeros((0, 3)), np.zeros((0, 3)))
        self.grid = Lattice(options.marker_spacing * options.metamer_m, self._blocked)

    def add(self, points: Floats) -> None:
        """Occupy the markers around metamers that end at (P, 3) points."""
        self._occupy(points, 1)

    def remove(self, points: Floats) -> None:
        """Give them free."""
        self._occupy(points, -1)

    def at_buds(self, tree: Metamers) -> BudLight:
        """Let buds claim the free markers in their cones; light is their share of those of an open cone."""
        grid, count = self.grid, len(tree)
        grid.cover(tree.end[:count], self._margin(self._sight))
        number, way = claim(
            (grid.values, grid.low, grid.voxel_m, self._seed),
            (tree.end[:count], tree.direction[:count], tree.lateral_bud_direction[:count]),
            (tree.terminal_bud[:count] != GROWN, tree.lateral_bud[:count] == DORMANT),
            (self._sight, self._half),
        )
        self._way = (way[::2], way[1::2])
        light: Floats = np.asarray(number * (self._options.full_light / self._open()), dtype=np.float64)
        return bud_light(tree, light[::2], light[1::2])

    def towards(self, tree: Metamers, metamer: Ints, is_lateral: Mask) -> Floats:  # noqa: ARG002 (asked before)
        """(K, 3) to the middle of the markers that buds have claimed when their light was asked for."""
        return np.where(is_lateral[:, None], self._way[1][metamer], self._way[0][metamer])

    def _open(self) -> float:
        """Markers that a bud sees ahead of the space its own metamer occupies."""
        cone = 2.0 * np.pi / 3.0 * (1.0 - self._half)
        return float(cone * (self._sight**3 - min(self._occupancy, self._sight) ** 3) / self.grid.voxel_m**3)

    def _margin(self, radius: float) -> int:
        return int(np.ceil(radius / self.grid.voxel_m)) + 1

    def _occupy(self, points: Floats, sign: int) -> None:
        grid = self.grid
        grid.cover(points, self._margin(self._occupancy))
        occupy((grid.values, grid.low, grid.voxel_m, self._seed), points, self._occupancy, sign)

    def _blocked(self, low: Voxels, shape: Voxels) -> Voxels:
        """Return which markers are underground, out of bounds, in a building or near neighbours."""
        values = np.zeros(tuple(shape.tolist()), dtype=np.int64)
        grid = (values, low, self._options.marker_spacing * self._options.metamer_m, self._seed)
        block(grid, self._limits, BLOCKED)
        if self._shade is not None:
            for box in self._shade.boxes:
                begin = np.clip(np.floor(box[0] / grid[2]).astype(np.int64) - low, 0, shape)
                end = np.clip(np.floor(box[1] / grid[2]).astype(np.int64) - low + 1, 0, shape)
                values[tuple(slice(a, b) for a, b in zip(begin.tolist(), end.tolist(), strict=True))] = (
                    BLOCKED
                )
            values += self._near_neighbours(low, shape)
        return values

    def _near_neighbours(self, low: Voxels, shape: Voxels) -> Voxels:
        """Block what neighbours occupy, also those that stand just outside of the cells."""
        margin = self._margin(self._occupancy)
        wide = np.zeros(tuple((shape + 4 * margin).tolist()), dtype=np.int64)
        grid = (wide, low - 2 * margin, self._options.marker_spacing * self._options.metamer_m, self._seed)
        points = np.zeros((0, 3)) if self._shade is None else self._shade.points
        cell = np.floor(points / grid[2]).astype(np.int64) - low
        near = ((cell >= -margin) & (cell < shape + margin)).all(axis=1)
        occupy(grid, points[near], self._occupancy, BLOCKED)
        inner = slice(2 * margin, -2 * margin)
        return wide[inner, inner, inner]


@compiled
def cells_around(
    x: float, y: float, z: float, radius: float, size: float
) -> tuple[int, int, int, int, int, int]:
    """Return the first and last cells along each axis that a sphere can touch."""
    return (
        int(np.floor((x - radius) / size)),
        int(np.floor((x + radius) / size)),
        int(np.floor((y - radius) / size)),
        int(np.floor((y + radius) / size)),
        int(np.floor((z - radius) / size)),
        int(np.floor((z + radius) / size)),
    )


@compiled
def occupy(grid: Grid, points: Floats, radius: float, amount: int) -> None:
    """Add an amount to all markers within a radius of points."""
    values, low, size, seed = grid
    for p in range(len(points)):
        x, y, z = points[p]
        i0, i1, j0, j1, k0, k1 = cells_around(x, y, z, radius, size)
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                for k in range(k0, k1 + 1):
                    u, v, w = marker(i, j, k, size, seed)
                    if (u - x) ** 2 + (v - y) ** 2 + (w - z) ** 2 < radius * radius:
                        values[i - low[0], j - low[1], k - low[2]] += amount


@compiled
def block(grid: Grid, limits: Limits, amount: int) -> None:
    """Set the markers where no tree may grow; without a shape only cells that the ground cuts need a look."""
    values, low, size, seed = grid
    point = np.zeros(3)
    for k in range(values.shape[2]):
        bottom = (k + low[2]) * size - limits.foot[2]
        if limits.kind == 0 and bottom > 0.0:
            break
        if bottom + size < 0.0:
            values[:, :, k] = amount
            continue
        for i in range(values.shape[0]):
            for j in range(values.shape[1]):
                point[0], point[1], point[2] = marker(i + low[0], j + low[1], k + low[2], size, seed)
                if not is_within(point, limits):
                    values[i, j, k] = amount
