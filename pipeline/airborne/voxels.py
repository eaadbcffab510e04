"""Occupied cubes of the national grid: which points share one, which cubes touch, how points spread.

The moments of a cube are sums of whole numbers from the cube's own corner: exact, and the same in
every window of the cloud. They cost a fraction of a search for every point's neighbours.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.airborne.raster import STEPS, Ints
from pipeline.geometry.compiled import compiled
from pipeline.model import Floats

TOUCHING = 26
MOMENTS = 10  # count, x, y, z, xx, xy, xz, yy, yz, zz


@dataclass(frozen=True, eq=False)
class Voxels:
    """The cubes that hold points, by plan cell and height.

    Parameters
    ----------
    of_point : (P,) array of int32
        Cube of every point.
    moments : (V, 10) array of int64
        Count, sums and sums of products of steps from the cube's lowest corner.
    near : (V, 26) array of int32
        Cubes that touch by a face, an edge or a corner, in a fixed order; -1 where there is none.
    side : int
        Side of a cube in steps.
    """

    of_point: NDArray[np.int32]
    moments: Ints
    near: NDArray[np.int32]
    side: int

    def __len__(self) -> int:
        return len(self.moments)

    @property
    def count(self) -> Ints:
        """(V,) points of every cube."""
        return np.asarray(self.moments[:, 0])


def voxels(xyz: Floats, origin: Floats, side_m: float) -> Voxels:
    """Sort snapped points into cubes.

    Parameters
    ----------
    xyz : (P, 3) array
        In metres from `origin`.
    origin : (3,) array
        Whole metres.
    side_m : float
    """
    side = max(round(side_m * STEPS), 1)
    zero = origin.astype(np.int64) * STEPS
    if not len(xyz):
        return Voxels(
            np.empty(0, np.int32), np.empty((0, MOMENTS), np.int64), np.empty((0, 26), np.int32), side
        )
    low, high = (np.floor(f(xyz, axis=0) * STEPS).astype(np.int64) for f in (np.min, np.max))
    first = (low + zero) // side
    cols, rows, levels = ((high + zero) // side - first + 1).tolist()
    start = first * side - zero
    key = _keys(xyz, start, side, (cols, levels))
    of_point, occupied = _numbered(key, np.argsort(key))
    place = np.column_stack(np.divmod(occupied, levels))
    begin = np.searchsorted(place[:, 0], np.arange(rows * cols + 1))
    return Voxels(
        of_point, _moments(xyz, start, side, of_point, len(place)), _touching(place, begin, cols), side
    )


@compiled
def _keys(xyz: Floats, start: Ints, side: int, shape: tuple[int, int]) -> Ints:
    """Cube of every point, counted by plan cell (row by row), then by level."""
    cols, levels = shape
    key = np.empty(len(xyz), dtype=np.int64)
    for p in range(len(xyz)):
        col = (int(np.rint(xyz[p, 0] * STEPS)) - start[0]) // side
        row = (int(np.rint(xyz[p, 1] * STEPS)) - start[1]) // side
        level = (int(np.rint(xyz[p, 2] * STEPS)) - start[2]) // side
        key[p] = (row * cols + col) * levels + level
    return key


@compiled
def _numbered(key: Ints, order: Ints) -> tuple[NDArray[np.int32], Ints]:
    """Number the occupied cubes along `order`; return every point's number and every cube's key."""
    of_point = np.empty(len(order), dtype=np.int32)
    occupied = np.empty(len(order), dtype=np.int64)
    number = -1
    for p in order:
        if number < 0 or key[p] != occupied[number]:
            number += 1
            occupied[number] = key[p]
        of_point[p] = number
    return of_point, occupied[: number + 1].copy()


@compiled
def _moments(xyz: Floats, start: Ints, side: int, of_point: NDArray[np.int32], number: int) -> Ints:
    out = np.zeros((number, MOMENTS), dtype=np.int64)
    for p in range(len(xyz)):
        row = out[of_point[p]]
        x = (int(np.rint(xyz[p, 0] * STEPS)) - start[0]) % side
        y = (int(np.rint(xyz[p, 1] * STEPS)) - start[1]) % side
        z = (int(np.rint(xyz[p, 2] * STEPS)) - start[2]) % side
        row[0] += 1
        row[1] += x
        row[2] += y
        row[3] += z
        row[4] += x * x
        row[5] += x * y
        row[6] += x * z
        row[7] += y * y
        row[8] += y * z
        row[9] += z * z
    return out


@compiled
def _touching(place: Ints, begin: Ints, cols: int) -> NDArray[np.int32]:
    rows = (len(begin) - 1) // cols
    near = np.full((len(place), TOUCHING), -1, dtype=np.int32)
    for v in range(len(place)):
        row, col = place[v, 0] // cols, place[v, 0] % cols
        for a in range(-1, 2):
            for b in range(-1, 2):
                if not (0 <= row + a < rows and 0 <= col + b < cols):
                    continue
                cell = (row + a) * cols + col + b
                for other in range(begin[cell], begin[cell + 1]):
                    rise = place[other, 1] - place[v, 1]
                    if -1 <= rise <= 1 and other != v:
                        slot = (a + 1) * 9 + (b + 1) * 3 + rise + 1
                        near[v, slot if slot < 13 else slot - 1] = other
    return near


@compiled
def gathered(moments: Ints, near: NDArray[np.int32], side: int) -> Ints:
    """(V, 10) moments of every cube and those that touch it, from the cube's own corner."""
    out = moments.copy()
    for v in range(len(moments)):
        row = out[v]
        for slot in range(TOUCHING):
            other = near[v, slot]
            if other < 0:
                continue
            full = slot if slot < 13 else slot + 1
            b, a, c = full // 9 - 1, full // 3 % 3 - 1, full % 3 - 1
            x, y, z = a * side, b * side, c * side
            m = moments[other]
            row[0] += m[0]
            row[1] += m[1] + m[0] * x
            row[2] += m[2] + m[0] * y
            row[3] += m[3] + m[0] * z
            row[4] += m[4] + 2 * x * m[1] + m[0] * x * x
            row[5] += m[5] + x * m[2] + y * m[1] + m[0] * x * y
            row[6] += m[6] + x * m[3] + z * m[1] + m[0] * x * z
            row[7] += m[7] + 2 * y * m[2] + m[0] * y * y
            row[8] += m[8] + y * m[3] + z * m[2] + m[0] * y * z
            row[9] += m[9] + 2 * z * m[3] + m[0] * z * z
    return out


@compiled
def spreads(moments: Ints) -> Floats:
    """(V, 3) variances along the axes of the points' ellipsoid, largest first, in square steps.

    Less than four points span no ellipsoid: NaN.
    """
    out = np.full((len(moments), 3), np.nan)
    matrix = np.empty((3, 3))
    for v in range(len(moments)):
        m = moments[v]
        n = m[0]
        if n < 4:
            continue
        scale = 1.0 / (float(n) * float(n))
        matrix[0, 0] = (n * m[4] - m[1] * m[1]) * scale
        matrix[0, 1] = matrix[1, 0] = (n * m[5] - m[1] * m[2]) * scale
        matrix[0, 2] = matrix[2, 0] = (n * m[6] - m[1] * m[3]) * scale
        matrix[1, 1] = (n * m[7] - m[2] * m[2]) * scale
        matrix[1, 2] = matrix[2, 1] = (n * m[8] - m[2] * m[3]) * scale
        matrix[2, 2] = (n * m[9] - m[3] * m[3]) * scale
        _eigenvalues(matrix, out[v])
    return out


@compiled
def _eigenvalues(a: Floats, out: Floats) -> None:
    """Eigenvalues of a symmetric 3 x 3 matrix, largest first, by the cosine of a third of an angle."""
    mean = (a[0, 0] + a[1, 1] + a[2, 2]) / 3.0
    off = a[0, 1] ** 2 + a[0, 2] ** 2 + a[1, 2] ** 2
    x, y, z = a[0, 0] - mean, a[1, 1] - mean, a[2, 2] - mean
    size = np.sqrt((x * x + y * y + z * z + 2.0 * off) / 6.0)
    if size == 0.0:
        out[:] = mean
        return
    det = x * (y * z - a[1, 2] ** 2) - a[0, 1] * (a[0, 1] * z - a[1, 2] * a[0, 2])
    det += a[0, 2] * (a[0, 1] * a[1, 2] - y * a[0, 2])
    half = min(max(det / (2.0 * size**3), -1.0), 1.0)
    angle = np.arccos(half) / 3.0
    out[0] = mean + 2.0 * size * np.cos(angle)
    out[2] = max(mean + 2.0 * size * np.cos(angle + 2.0 * np.pi / 3.0), 0.0)
    out[1] = 3.0 * mean - out[0] - out[2]
