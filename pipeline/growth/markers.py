"""Light by space colonization: a jittered grid of markers, claimed by the buds that see them nearest."""

from __future__ import annotations

import numpy as np

from pipeline.geometry.compiled import compiled
from pipeline.growth.bound import KINDS, Limits, is_within
from pipeline.growth.chance import scramble
from pipeline.growth.claims import claim, middles
from pipeline.growth.jitter import BLOCKED, FARTHEST, ROUNDING, Grid, column, marker, marker_in
from pipeline.growth.lattice import Counts, Lattice, Voxels, corners, no_counts
from pipeline.growth.options import GrowthOptions
from pipeline.growth.shade import Shade
from pipeline.growth.sight import BudLight, bud_light
from pipeline.growth.state import DORMANT, GROWN, Mask, Metamers
from pipeline.growth.views import FREE, TAKEN, BudPlaces, Met, Space, kept, none_met, none_seen
from pipeline.model import Floats, Ints

NOWHERE = (np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3)))


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
        self._spacing = options.marker_spacing * options.metamer_m
        self.grid, self._numbers = Lattice(self._spacing, self._blocked), Lattice(self._spacing, no_counts)
        self._views, self._met, self._places = none_seen(), none_met(self._numbers.values), NOWHERE
        self._first = 1

    def add(self, points: Floats) -> None:
        """Occupy the markers around metamers that end at (P, 3) points."""
        self._occupy(points, 1)

    def remove(self, points: Floats) -> None:
        """Give them free."""
        self._occupy(points, -1)

    def at_buds(self, tree: Metamers) -> BudLight:
        """Let buds claim the free markers in their cones; light is their share of those of an open cone."""
        self._cover(tree.end[: len(tree)], self._sight)
        self._first += 2 * len(self._places[0])
        rows, places = slice(0, len(tree)), _places(tree)
        waits = (tree.terminal_bud[rows] != GROWN, tree.lateral_bud[rows] == DORMANT)
        views = kept(self._views, self._places, places, waits)
        number, self._views, self._met = claim(self._space(), places, waits, self._first, views, self._met)
        self._places = (places[0].copy(), places[1].copy(), places[2].copy())
        light: Floats = np.asarray(number * (self._options.full_light / self._open()), dtype=np.float64)
        return bud_light(tree, light[::2], light[1::2])

    def towards(self, tree: Metamers, metamer: Ints, is_lateral: Mask) -> Floats:
        """(K, 3) to the middle of the markers that buds have claimed when their light was asked for."""
        which = (metamer, is_lateral)
        return middles(which, _places(tree), self._space(), self._first, self._views, self._met)

    def _cover(self, points: Floats, radius: float) -> None:
        """Let the box hold all within a radius of points."""
        if len(points):
            margin, (low, high) = int(np.ceil(radius / self._spacing)) + 1, corners(points)
            self.grid.hold(low, high, margin)
            self._numbers.hold(low, high, margin)
        self._met = self._met._replace(number=self._numbers.values)

    def _cells(self) -> Grid:
        return self.grid.values, self.grid.low, self._spacing, self._seed

    def _space(self) -> Space:
        return self._cells(), (self._sight, self._half)

    def _open(self) -> float:
        """Markers that a bud sees ahead of the space its own metamer occupies."""
        cone = 2.0 * np.pi / 3.0 * (1.0 - self._half)
        return float(cone * (self._sight**3 - min(self._occupancy, self._sight) ** 3) / self._spacing**3)

    def _occupy(self, points: Floats, sign: int) -> None:
        self._cover(points, self._occupancy)
        occupy(self._cells(), points, self._occupancy, sign, self._met)

    def _blocked(self, low: Voxels, shape: Voxels) -> Counts:
        """Return which markers are underground, out of bounds, in a building or near neighbours."""
        values = no_counts(low, shape)
        grid = (values, low, self._spacing, self._seed)
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

    def _near_neighbours(self, low: Voxels, shape: Voxels) -> Counts:
        """Block what neighbours occupy, also those that stand just outside of the cells."""
        margin = int(np.ceil(self._occupancy / self._spacing)) + 1
        wide = no_counts(low, shape + 4 * margin)
        grid = (wide, low - 2 * margin, self._spacing, self._seed)
        points = np.zeros((0, 3)) if self._shade is None else self._shade.points
        cell = np.floor(points / grid[2]).astype(np.int64) - low
        near = ((cell >= -margin) & (cell < shape + margin)).all(axis=1)
        occupy(grid, points[near], self._occupancy, 1, none_met(no_counts(low, 0 * low)))
        inner = slice(2 * margin, -2 * margin)
        return np.where(wide[inner, inner, inner] > 0, np.int32(BLOCKED), np.int32(0))


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
def occupy(grid: Grid, points: Floats, radius: float, amount: int, met: Met) -> None:
    """Add an amount to all markers within a radius of points; those met before are taken then, or free."""
    values, low, size, seed = grid
    counts, number, held = values.reshape(-1), met.number.reshape(-1), met.held
    reach = (radius + (FARTHEST + ROUNDING) * size) ** 2
    near = np.empty((2 * int(radius / size) + 4) ** 3, dtype=np.int64)
    for p in range(len(points)):
        x, y, z = points[p]
        i0, i1, j0, j1, k0, k1 = cells_around(x, y, z, radius, size)
        found = 0
        for i in range(i0, i1 + 1):
            for j in range(j0, j1 + 1):
                if ((i + 0.5) * size - x) ** 2 + ((j + 0.5) * size - y) ** 2 > reach:
                    continue
                chances = column(i, j, seed)
                start = ((i - low[0]) * values.shape[1] + j - low[1]) * values.shape[2] - low[2]
                for k in range(k0, k1 + 1):
                    u, v, w = marker_in(chances, i, j, k, size)
                    near[found] = start + k
                    found += int((u - x) ** 2 + (v - y) ** 2 + (w - z) ** 2 < radius * radius)
        for cell in near[:found]:
            counts[cell] += amount
            if len(number) and number[cell]:
                m = number[cell]
                held[m, 0], held[m, 1] = TAKEN if counts[cell] else FREE


@compiled
def block(grid: Grid, limits: Limits, amount: int) -> None:
    """Set the markers where no tree may grow; without a shape only cells that the ground cuts need a look."""
    values, low, size, seed = grid
    point = np.zeros(3)
    sunk, asked = 0, values.shape[2]
    for k in range(values.shape[2]):
        bottom = (k + low[2]) * size - limits.foot[2]
        sunk += int(bottom + size < 0.0)
        if limits.kind == 0 and bottom > 0.0:
            asked = k
            break
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            values[i, j, :sunk] = amount
            for k in range(sunk, asked):
                point[0], point[1], point[2] = marker(i + low[0], j + low[1], k + low[2], size, seed)
                if not is_within(point, limits):
                    values[i, j, k] = amount


def _places(tree: Metamers) -> BudPlaces:
    rows = slice(0, len(tree))
    return tree.end[rows], tree.direction[rows], tree.lateral_bud_direction[rows]
