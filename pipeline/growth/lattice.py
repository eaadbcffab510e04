"""A box of voxels that becomes larger with the tree; voxels are numbered from the zero of coordinates."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import UsageError
from pipeline.model import Floats

Voxels = NDArray[np.int64]
Counts = NDArray[np.int32]
Whole = TypeVar("Whole", np.int64, np.int32)

MOST_VOXELS = 60_000_000
"""Half a gigabyte."""
SPARE = 0.25
"""Share of its size by which the box grows beyond what is needed, on all sides that were ever too near."""


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
        if not len(points):
            return
        low = np.floor(points.min(axis=0) / self.voxel_m).astype(np.int64) - margin
        high = np.floor(points.max(axis=0) / self.voxel_m).astype(np.int64) + margin + 1
        had, top = np.array(self.values.shape), self.low + np.array(self.values.shape)
        if self.values.size:
            if (low >= self.low).all() and (high <= top).all():
                return
            spare = np.maximum(margin, (SPARE * had).astype(np.int64))
            self._grows |= np.array([low < self.low, high > top])
            low = np.where(self._grows[0], np.minimum(self.low, low - spare), self.low)
            high = np.where(self._grows[1], np.maximum(top, high + spare), top)
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


def zeros(_low: Voxels, shape: Voxels) -> Voxels:
    """Fill a box with 0."""
    return np.zeros(tuple(shape.tolist()), dtype=np.int64)


def no_counts(_low: Voxels, shape: Voxels) -> Counts:
    """Fill a box with 0, in numbers of half the size."""
    return np.zeros(tuple(shape.tolist()), dtype=np.int32)
