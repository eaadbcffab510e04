"""Grids over the plan, aligned to the national grid: cell = floor(world / cell size).

Coordinates are whole numbers of steps of `SNAP_M` from an origin of whole metres. Cells, sums and
differences are then exact, and the same in every cloud that holds the same points, wherever its
origin lies and however large it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.model import Floats

Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

STEPS = 4096  # steps in a metre
SNAP_M = 1.0 / STEPS  # 0.24 mm
LEVELS = 4  # grids begin and end at whole blocks of 2 ** LEVELS cells


@dataclass(frozen=True, eq=False)
class Raster:
    """Values in square cells; the value of a cell stands at its centre.

    Parameters
    ----------
    values : (rows, cols) array of float64
        Rows go north (with y), columns east (with x). NaN where nothing is known.
    corner : (2,) array of float64
        Local x and y of the lower left corner of cell [0, 0], in metres.
    cell_m : float
        Side of a cell in metres.
    """

    values: Floats
    corner: Floats
    cell_m: float

    def at(self, xy: Floats) -> Floats:
        """(P,) value at (P, 2) places, bilinear between the centres of cells; NaN outside."""
        return _bilinear(self.values, self.corner, self.cell_m, np.asarray(xy, dtype=np.float64))


@compiled
def _bilinear(values: Floats, corner: Floats, cell: float, xy: Floats) -> Floats:
    rows, cols = values.shape
    out = np.full(len(xy), np.nan)
    for p in range(len(xy)):
        u, v = (xy[p, 0] - corner[0]) / cell - 0.5, (xy[p, 1] - corner[1]) / cell - 0.5
        if not (-0.5 <= u <= cols - 0.5 and -0.5 <= v <= rows - 0.5):
            continue
        u, v = min(max(u, 0.0), cols - 1.0), min(max(v, 0.0), rows - 1.0)
        i, j = int(v), int(u)
        part_v, part_u = v - i, u - j
        far_i, far_j = (i + 1 if part_v > 0.0 else i), (j + 1 if part_u > 0.0 else j)
        south = values[i, j] + part_u * (values[i, far_j] - values[i, j])
        north = values[far_i, j] + part_u * (values[far_i, far_j] - values[far_i, j])
        out[p] = south + part_v * (north - south)
    return out


@dataclass(frozen=True, eq=False)
class Grid:
    """Square cells over a window of the plan.

    Parameters
    ----------
    first : (2,) array of int64
        Column and row, counted from the zero of the national grid, of cell [0, 0]; whole multiples of
        ``2 ** LEVELS``, so that blocks of cells are the same blocks in every window.
    shape : tuple of int
        Rows and columns, whole multiples too.
    side : int
        Side of a cell in steps.
    origin : (2,) array of int64
        World coordinates of the local zero, in whole metres.
    """

    first: Ints
    shape: tuple[int, int]
    side: int
    origin: Ints

    @classmethod
    def over(cls, xyz: Floats, origin: Floats, cell_m: float) -> Grid:
        """Make the grid that holds all points and a cell round them.

        Parameters
        ----------
        xyz : (P, 3) array
            Snapped points relative to `origin`; none gives a grid of one block.
        origin : (3,) array
            Whole metres.
        cell_m : float
            Side of a cell in metres; taken to the nearest step.
        """
        side, block = max(round(cell_m * STEPS), 1), 2**LEVELS
        zero = origin[:2].astype(np.int64)
        low, high = (
            (np.zeros(2, np.int64), np.zeros(2, np.int64))
            if not len(xyz)
            else (np.floor(f(xyz[:, :2], axis=0) * STEPS).astype(np.int64) for f in (np.min, np.max))
        )
        first = ((low + zero * STEPS) // side - 1) // block * block
        last = ((high + zero * STEPS) // side + 1) // block * block + block
        cols, rows = (last - first).tolist()
        return cls(first, (rows, cols), side, zero)

    @property
    def cell_m(self) -> float:
        """Side of a cell in metres."""
        return self.side / STEPS

    @property
    def corner(self) -> Floats:
        """(2,) local x and y of the lower left corner of cell [0, 0], in metres."""
        return np.asarray((self.first * self.side - self.origin * STEPS) / STEPS)

    def cells(self, xyz: Floats) -> NDArray[np.int32]:
        """(P,) position of every point's cell in a raster laid flat."""
        start = self.first * self.side - self.origin * STEPS
        return _cells(xyz, start, self.side, self.shape[1])

    def centres(self, cells: NDArray[np.integer]) -> Floats:
        """(P, 2) local x and y of the centres of cells given by their flat positions."""
        row, col = np.divmod(cells, self.shape[1])
        return np.asarray(self.corner + (np.column_stack([col, row]) + 0.5) * self.cell_m)

    def raster(self, values: Floats) -> Raster:
        """Return flat or shaped values as a raster."""
        return Raster(values.reshape(self.shape), self.corner, self.cell_m)


@compiled
def _cells(xyz: Floats, start: Ints, side: int, cols: int) -> NDArray[np.int32]:
    out = np.empty(len(xyz), dtype=np.int32)
    for p in range(len(xyz)):
        col = (int(np.rint(xyz[p, 0] * STEPS)) - start[0]) // side
        row = (int(np.rint(xyz[p, 1] * STEPS)) - start[1]) // side
        out[p] = row * cols + col
    return out


def snapped(xyz: Floats, origin: Floats) -> tuple[Floats, Floats]:
    """Return points and origin with an origin of whole metres and points of whole steps from it.

    Parameters
    ----------
    xyz : (P, 3) array
        Returned as it is where it fits already.
    origin : (3,) array
    """
    whole = np.floor(origin)
    if not (whole == origin).all():
        xyz = xyz + (origin - whole)
    elif _on_steps(xyz):
        return xyz, whole
    return np.rint(xyz * STEPS) / STEPS, whole


@compiled
def _on_steps(xyz: Floats) -> bool:
    for p in range(len(xyz)):
        for d in range(3):
            if xyz[p, d] * STEPS != np.rint(xyz[p, d] * STEPS):
                return False
    return True
