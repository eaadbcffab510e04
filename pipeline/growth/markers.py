"""Light by space colonization: a jittered grid of markers, claimed by the buds that see them nearest."""

from __future__ import annotations

import numpy as np

from pipeline.geometry.compiled import compiled
from pipeline.growth.bound import KINDS, Limits
from pipeline.growth.chance import scramble
from pipeline.growth.claims import claim, middles
from pipeline.growth.columns import Space, Span, columns, judge, no_batch
from pipeline.growth.jitter import START, placed
from pipeline.growth.lattice import Counts, Lattice, Voxels, corners, no_counts
from pipeline.growth.options import GrowthOptions
from pipeline.growth.shade import Shade
from pipeline.growth.sight import BudLight, bud_light
from pipeline.growth.state import DORMANT, GROWN, Mask, Metamers
from pipeline.growth.views import (
    CLOSED,
    FREE,
    TAKEN,
    BudPlaces,
    Met,
    kept,
    none_met,
    none_seen,
    taken_at_first,
    with_room,
)
from pipeline.model import Floats, Ints

NO_ANGLE = -2.0
"""The cosine of half the angle of a cone that holds all."""
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
        The number of every marker that has been met; most of space is never asked for.
    """

    def __init__(self, options: GrowthOptions, seed: int, foot: Floats, shade: Shade | None = None) -> None:
        self._options = options
        # compiled functions return plain integers, whose type would depend on the seed
        self._seed = np.uint64(scramble(np.uint64(seed & 0xFFFFFFFFFFFFFFFF)))
        self._occupancy = options.occupancy * options.metamer_m
        self._sight = options.perception * options.metamer_m
        self._half = float(np.cos(np.radians(options.perception_deg / 2.0)))
        half = (options.bound_width_m / 2.0, options.bound_depth_m / 2.0, options.bound_height_m / 2.0)
        x, y, z = foot.tolist()
        self._limits = Limits(KINDS.index(options.bound), (x, y, z), half, options.bound_base_m)
        self._shade = shade
        self._spacing = options.marker_spacing * options.metamer_m
        self._batch = no_batch(max(self._sight, self._occupancy) / self._spacing)
        self.grid = Lattice(self._spacing, no_counts if shade is None else self._closed)
        self._views, self._met, self._places = none_seen(), none_met(), NOWHERE
        self._first = 1

    def add(self, points: Floats) -> None:
        """Occupy the markers around metamers that end at (P, 3) points."""
        self._occupy(points, 1)

    def remove(self, points: Floats) -> None:
        """Give them free."""
        self._occupy(points, -1)

    def taken(self) -> tuple[Floats, Counts]:
        """Return where the markers are that have been met (M, 3), and by how many metamers each is taken."""
        rows = slice(1, self._met.known)
        return self._met.place[rows], self._met.taken[rows]

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

    def _space(self, values: Counts | None = None, low: Voxels | None = None) -> Space:
        grid = (self.grid.values, self.grid.low) if values is None or low is None else (values, low)
        return (*grid, self._spacing, self._seed), (self._sight, self._half), self._limits, self._batch

    def _open(self) -> float:
        """Markers that a bud sees ahead of the space its own metamer occupies."""
        cone = 2.0 * np.pi / 3.0 * (1.0 - self._half)
        return float(cone * (self._sight**3 - min(self._occupancy, self._sight) ** 3) / self._spacing**3)

    def _occupy(self, points: Floats, sign: int) -> None:
        self._cover(points, self._occupancy)
        self._met = occupy(self._space(), points, self._occupancy, sign, self._met)

    def _closed(self, low: Voxels, shape: Voxels) -> Counts:
        """Return which markers are in a building or near neighbours."""
        values = self._near_neighbours(low, shape)
        for box in () if self._shade is None else self._shade.boxes:
            begin = np.clip(np.floor(box[0] / self._spacing).astype(np.int64) - low, 0, shape)
            end = np.clip(np.floor(box[1] / self._spacing).astype(np.int64) - low + 1, 0, shape)
            values[tuple(slice(a, b) for a, b in zip(begin.tolist(), end.tolist(), strict=True))] = CLOSED
        return values

    def _near_neighbours(self, low: Voxels, shape: Voxels) -> Counts:
        """Close what neighbours occupy, also those that stand just outside of the cells."""
        margin = int(np.ceil(self._occupancy / self._spacing)) + 1
        wide = no_counts(low, shape + 4 * margin)
        points = np.zeros((0, 3)) if self._shade is None else self._shade.points
        cell = np.floor(points / self._spacing).astype(np.int64) - low
        near = ((cell >= -margin) & (cell < shape + margin)).all(axis=1)
        close(self._space(wide, low - 2 * margin), points[near], self._occupancy)
        inner = slice(2 * margin, -2 * margin)
        return wide[inner, inner, inner].copy()


@compiled
def occupy(space: Space, points: Floats, radius: float, amount: int, met: Met) -> Met:
    """Let more, or fewer, metamers have the markers within a radius of points."""
    known = met.known
    for p in range(len(points)):
        n, span = around(points[p], radius, space)
        more = n * (span[1] - span[0] + 1)
        if known + more > len(met.taken):
            met = with_room(met, known, more)
        known = count(n, span, amount, space, met, known)
    return Met(met.place, met.held, met.taken, known)


@compiled
def around(point: Floats, radius: float, space: Space) -> tuple[int, Span]:
    """Judge the markers within a radius of a point; as `columns`."""
    bud, cone = ((point[0], point[1], point[2]), (0.0, 0.0, 1.0)), (radius, NO_ANGLE)
    n, span = columns(bud[0], bud[1], cone, space)
    judge(n, span, bud, cone, space)
    return n, span


@compiled
def count(n: int, span: Span, amount: int, space: Space, met: Met, known: int) -> int:
    """Add an amount to what the judged markers count; how many are known then."""
    (cells, _, size, _), _, limits, (chances, x, y, cell, _, is_seen) = space
    numbers, (places, held, taken, _) = cells.reshape(-1), met
    for c in range(n):
        for k in range(span[1] - span[0] + 1):
            if not is_seen[k, c]:
                continue
            m = numbers[cell[c] + k]
            if m <= 0:
                at = placed(chances[c] + np.uint64(span[0] + k), x[c], y[c], span[0] + k + START, size)
                places[known, 0], places[known, 1], places[known, 2] = at
                taken[known] = taken_at_first(m, at, limits)
                m = numbers[cell[c] + k] = known
                known += 1
            taken[m] += amount
            held[m, 0], held[m, 1] = TAKEN if taken[m] else FREE
    return known


@compiled
def close(space: Space, points: Floats, radius: float) -> None:
    """Close the markers within a radius of points."""
    numbers, cell, is_seen = space[0][0].reshape(-1), space[3].cell, space[3].is_seen
    for p in range(len(points)):
        n, span = around(points[p], radius, space)
        for c in range(n):
            for k in range(span[1] - span[0] + 1):
                if is_seen[k, c]:
                    numbers[cell[c] + k] = CLOSED


def _places(tree: Metamers) -> BudPlaces:
    rows = slice(0, len(tree))
    return tree.end[rows], tree.direction[rows], tree.lateral_bud_direction[rows]
