"""Square cells on the national grid: what one worker does at a time, and the buffer around it.

A cell's core is half-open, so that every apex lies in exactly one core; its window is the core with
a buffer of points around it. Corners and sizes are multiples of `RASTER_M`, so that rasters of
neighbouring cells have the same squares.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydantic import Field, model_validator

from pipeline.errors import UsageError
from pipeline.options import Options

RASTER_M = 0.5
"""Resolution of the rasters; a cell that cannot be halved on this grid is not split."""

LEAST_CORE_M = 50.0
"""Smallest core that is split off; below, the buffer is most of the window."""

Window = tuple[float, float, float, float]
"""West, south, east and north, metres in the tiles' reference system."""


class GridOptions(Options):
    """How an area is cut into cells."""

    core_m: float = Field(500.0, ge=10, le=10_000, description="side of a cell's core, a multiple of 0.5, m")
    buffer_m: float = Field(20.0, ge=0, le=500, description="points read around the core, m")
    most_points: int = Field(
        20_000_000, ge=1_000, description="points of core and buffer above which a cell is split in four"
    )

    @model_validator(mode="after")
    def _on_the_raster(self) -> Self:
        if self.core_m % RASTER_M:
            msg = f"core_m = {self.core_m:g} is no multiple of {RASTER_M:g}; give for example 500"
            raise ValueError(msg)
        return self


@dataclass(frozen=True, order=True)
class Cell:
    """A square of the national grid.

    Parameters
    ----------
    x0, y0 : float
        South-western corner, metres.
    size_m : float
        Side of the core.
    """

    x0: float
    y0: float
    size_m: float

    @property
    def name(self) -> str:
        """Corner and size, the name of the cell's folder.

        Examples
        --------
        >>> Cell(121500.0, 487000.0, 500.0).name, Cell(121500.0, 487062.5, 62.5).name
        ('121500_487000_500', '121500_487062.5_62.5')
        """
        return "_".join(_number(value) for value in (self.x0, self.y0, self.size_m))

    @classmethod
    def named(cls, name: str) -> Cell:
        """Return the cell of a name.

        Raises
        ------
        UsageError
            If the text is no name of a cell.
        """
        try:
            x0, y0, size_m = (float(part) for part in name.split("_"))
        except ValueError:
            size_m = 0.0
        if size_m <= 0:
            msg = f"{name!r} is no cell; cells are named X0_Y0_SIZE in metres, such as 121500_487000_500"
            raise UsageError(msg)
        return cls(x0, y0, size_m)

    @property
    def core(self) -> Window:
        """West, south, east and north of the core; the points on east and north are the neighbours'."""
        return self.window(0.0)

    def window(self, buffer_m: float) -> Window:
        """Return the core with a buffer around it: west, south, east, north."""
        return (
            self.x0 - buffer_m,
            self.y0 - buffer_m,
            self.x0 + self.size_m + buffer_m,
            self.y0 + self.size_m + buffer_m,
        )

    def contains(self, xy: ArrayLike) -> NDArray[np.bool_]:
        """Return for world coordinates (..., 2) whether they lie in the half-open core."""
        return inside(self.core, xy)

    def covers(self, other: Cell) -> bool:
        """Return whether another cell lies wholly in this one."""
        west, south, east, north = other.core
        return self.x0 <= west and self.y0 <= south and east <= self.core[2] and north <= self.core[3]


def inside(window: Window, xy: ArrayLike) -> NDArray[np.bool_]:
    """Return for world coordinates (..., 2) whether they lie in a window, half-open to east and north."""
    x, y = np.moveaxis(np.asarray(xy, dtype=np.float64), -1, 0)
    west, south, east, north = window
    return np.asarray((x >= west) & (x < east) & (y >= south) & (y < north))


def cells_over(extent: Window, options: GridOptions | None = None) -> tuple[Cell, ...]:
    """Return the cells whose half-open cores meet a closed extent, by x, then y.

    Examples
    --------
    >>> [cell.name for cell in cells_over((990.0, 10.0, 1000.0, 20.0), GridOptions(core_m=500))]
    ['500_0_500', '1000_0_500']
    """
    core = (options or GridOptions()).core_m
    rows = _steps(extent[1], extent[3], core)
    return tuple(Cell(x * core, y * core, core) for x in _steps(extent[0], extent[2], core) for y in rows)


def _steps(low: float, high: float, core: float) -> range:
    return range(floor(low / core), floor(high / core) + 1)


def can_split(cell: Cell) -> bool:
    """Return whether the quarters of a cell still stand on the raster and are worth it."""
    half = cell.size_m / 2
    return half >= LEAST_CORE_M and half % RASTER_M == 0


def split(cell: Cell) -> tuple[Cell, Cell, Cell, Cell]:
    """Return the four quarters of a cell, by x, then y; together they cover its core exactly."""
    half = cell.size_m / 2
    west, south = cell.x0, cell.y0
    return (
        Cell(west, south, half),
        Cell(west, south + half, half),
        Cell(west + half, south, half),
        Cell(west + half, south + half, half),
    )


def _number(value: float) -> str:
    """Write a coordinate without needless decimals."""
    return str(int(value)) if float(value).is_integer() else repr(float(value))
