"""A box of voxels that becomes larger with the tree; voxels are numbered from the zero of coordinates."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import UsageError
from pipeline.geometry.compiled import compiled
from pipeline.model import Floats

Voxels = NDArray[np.int64]
Counts = NDArray[np.int32]
Whole = TypeVar("Whole", np.int64, np.int32)

MOST_VOXELS = 60_000_000
"""Half a gigabyte."""
SPARE = 0.25
"""Share of its size that the box has beyond what is needed, on sides that were ever too near, if it can."""


class Lattice(Generic[Whole]):
    """A dense part of an endless grid of whole numbers.

    Parameters
    ----------
    voxel_m : float
        Edge of a voxel, metres. Voxel (i, j, k) begins at (i, j, k) times this.
    fill : callable
        Gives what the voxels of a box hold at first, of its lowest voxel and its shape.

    Attributes
    ----------
    low : (3,) array of int64
        The lowest voxel of the box.
    values : (I, J, K) array
        Of what `fill` gives.
    """

    def __init__(self, voxel_m: float, fill: Callable[[Voxels, Voxels], NDArray[Whole]]) -> None:
        self.voxel_m = voxel_m
        self._fill: Callable[[Voxels, Voxels], NDArray[Whole]] = fill
        self.low: Voxels = np.zeros(3, dtype=np.int64)
        self.values: NDArray[Whole] = fill(self.low, self.low)
        self._grows = np.zeros((2, 3), dtype=bool)

    def cover(self, points: Floats, margin: int) -> None:
        """Make the box so large that all points lie `margin` voxels or more within.

        Raises
        ------
        UsageError
            If it would have more than `MOST_VOXELS` voxels.
        """
        if len(points):
            self.hold(*corners(points), margin)

    def hold(self, lowest: Floats, highest: Floats, margin: int) -> None:
        """Make the box so large that all between two corners (3,), metres, lies `margin` voxels within.

        Raises
        ------
        UsageError
            As `cover`.
        """
        low = np.floor(lowest / self.voxel_m).astype(np.int64) - margin
        high = np.floor(highest / self.voxel_m).astype(np.int64) + margin + 1
        had, top = np.array(self.values.shape), self.low + np.array(self.values.shape)
        if self.values.size:
            if (low >= self.low).all() and (high <= top).all():
                return
            spare = np.maximum(margin, (SPARE * had).astype(np.int64))
            self._grows |= np.array([low < self.low, high > top])
            # beyond what is needed, not beyond what there is: else all sides would grow whenever one does
            wide_low = np.minimum(self.low, low - self._grows[0] * spare)
            wide_high = np.maximum(top, high + self._grows[1] * spare)
            low, high = np.minimum(self.low, low), np.maximum(top, high)
            if (wide_high - wide_low).astype(float).prod() <= MOST_VOXELS:
                low, high = wide_low, wide_high
        self._enlarge(low, high - low)

    def _enlarge(self, low: Voxels, shape: Voxels) -> None:
        if shape.astype(float).prod() > MOST_VOXELS:
            size = " x ".join(f"{n * self.voxel_m:.0f}" for n in shape)
            msg = (
                f"{size} m have too many voxels of {self.voxel_m:g} m (more than {MOST_VOXELS:,}); give "
                "larger ones (voxel_m or marker_spacing), a bound, or fewer years"
            )
            raise UsageError(msg)
        values = self._fill(low, shape)
        at = self.low - low
        inner = tuple(slice(a, a + n) for a, n in zip(at.tolist(), self.values.shape, strict=True))
        if self.values.size:
            values[inner] = self.values
        self.low, self.values = low, values


@compiled
def corners(points: Floats) -> tuple[Floats, Floats]:
    """Return the least and greatest coordinates of (P, 3) points, one at least."""
    low, high = points[0].copy(), points[0].copy()
    for p in range(1, len(points)):
        for c in range(3):
            low[c], high[c] = min(low[c], points[p, c]), max(high[c], points[p, c])
    return low, high


def zeros(_low: Voxels, shape: Voxels) -> Voxels:
    """Fill a box with 0."""
    return np.zeros(tuple(shape.tolist()), dtype=np.int64)


def no_counts(_low: Voxels, shape: Voxels) -> Counts:
    """Fill a box with 0, in numbers of half the size."""
    return np.zeros(tuple(shape.tolist()), dtype=np.int32)
