"""The areas that statistics are told of: polygons of a file by their names, or the cells."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.airborne.grid import Cell, Window
from pipeline.batch.merging.packages import package
from pipeline.batch.vectors import read_vector
from pipeline.errors import InputFormatError, InputMissingError
from pipeline.model import Floats

NAMED = ("name", "naam", "area", "gebied", "wijk", "buurt", "buurtnaam", "wijknaam", "id", "code")
"""Usual names of a column with the names of areas; the first that is there counts."""

HECTARE_M2 = 10_000.0


@dataclass(frozen=True)
class Areas:
    """Polygons with names; a tree may lie in several, or in none.

    Parameters
    ----------
    names : tuple of str
    shapes : tuple
        Polygons of shapely, in the reference system of the trees.
    half_open : bool
        Whether a point on the eastern or northern edge is the neighbour's, for areas that are boxes.
    flown : optional
        Where tiles are; what lies beyond counts for no area's size. None where that is not known.
    """

    names: tuple[str, ...]
    shapes: tuple[Any, ...]
    half_open: bool = False
    flown: Any = None

    @property
    def hectares(self) -> tuple[float, ...]:
        """Size of every area."""
        return tuple(shape.area / HECTARE_M2 for shape in self._sized)

    @property
    def all_hectares(self) -> float:
        """Size of all areas together, no place counted twice."""
        return float(package("shapely").union_all(self._sized).area) / HECTARE_M2

    @cached_property
    def _sized(self) -> tuple[Any, ...]:
        """Parts of the areas where tiles are; most lie amidst them, and those at the edge are cut."""
        if self.flown is None:
            return self.shapes
        shapely = package("shapely")
        shapely.prepare(self.flown)
        amidst = shapely.covers(self.flown, np.array(self.shapes, dtype=object))
        pairs = zip(self.shapes, amidst.tolist(), strict=True)
        return tuple(shape if whole else shapely.intersection(shape, self.flown) for shape, whole in pairs)

    @cached_property
    def _tree(self) -> Any:
        return package("shapely").STRtree(self.shapes)

    def holding(self, xy: Floats) -> NDArray[np.int64]:
        """Return pairs (2, K) of point and area, for points (N, 2) that lie in an area or on its edge."""
        found = self._tree.query(package("shapely").points(xy), predicate="intersects")
        point, area = np.asarray(found, dtype=np.int64)
        if self.half_open:
            far = package("shapely").bounds(np.array(self.shapes))[:, 2:]
            before = (xy[point] < far[area]).all(axis=1)
            point, area = point[before], area[before]
        return np.stack([point, area])


def of_cells(cells: Sequence[Cell]) -> Areas:
    """Return the cores of cells as areas."""
    box = package("shapely").box
    return Areas(tuple(cell.name for cell in cells), tuple(box(*cell.core) for cell in cells), half_open=True)


def within_cells(areas: Areas, cells: Sequence[Cell]) -> Areas:
    """Return the parts of areas that cells cover, so that figures by the hectare are right at the edge."""
    shapely = package("shapely")
    covered = shapely.union_all([shapely.box(*cell.core) for cell in cells])
    return Areas(areas.names, tuple(shapely.intersection(shape, covered) for shape in areas.shapes))


def within_tiles(areas: Areas, extents: Sequence[Window]) -> Areas:
    """Return areas whose size is that of their parts in tiles: of a cell at the edge, not all is seen.

    Parameters
    ----------
    areas : Areas
    extents : sequence of Window
        Of the tiles, as their headers tell; where there is none, the areas stay as they are.
    """
    shapely = package("shapely")
    return (
        replace(areas, flown=shapely.union_all([shapely.box(*one) for one in extents])) if extents else areas
    )


def read_areas(path: Path, crs: str | None) -> Areas:
    """Read polygons with names, such as neighbourhoods.

    Parameters
    ----------
    path : Path
        GeoJSON, GeoPackage or another vector file. The names stand in a column of `NAMED`, else areas are
        numbered.
    crs : str or None
        Reference system of the trees.

    Raises
    ------
    InputMissingError
        If there is no such file.
    InputFormatError
        If it cannot be read or holds no polygon.
    """
    if not path.is_file():
        msg = f"{path}: there is no such file; check the name of the areas"
        raise InputMissingError(msg)
    pyogrio, shapely = package("pyogrio"), package("shapely")
    try:
        info, geometry, values = read_vector(path)
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, ValueError) as error:
        reason = str(error).partition("\n")[0]
        msg = f"{path}: no areas can be read there ({reason}); give a GeoJSON or GeoPackage of polygons"
        raise InputFormatError(msg) from error
    shapes = [] if geometry is None else list(shapely.make_valid(shapely.from_wkb(geometry)))
    kept = [k for k, shape in enumerate(shapes) if shape is not None and shape.area > 0]
    if not kept:
        msg = f"{path}: holds no polygon; give a file with the outlines of areas"
        raise InputFormatError(msg)
    fields = {str(name).lower(): column for name, column in zip(info["fields"], values, strict=True)}
    column = next((fields[name] for name in NAMED if name in fields), None)
    names = tuple(f"area {k + 1}" if column is None else str(column[k]) for k in kept)
    return Areas(names, tuple(_placed([shapes[k] for k in kept], info["crs"], crs)))


def _placed(shapes: list[Any], source: str | None, target: str | None) -> list[Any]:
    """Reproject shapes, if their file names a system and it is another one."""
    if source is None or target is None:
        return shapes
    from pyproj import CRS, Transformer  # noqa: PLC0415 (slow to import)

    here, there = CRS.from_user_input(source), CRS.from_user_input(target)
    flat = there.sub_crs_list[0] if there.sub_crs_list else there
    if here.equals(flat, ignore_axis_order=True):
        return shapes
    transform = Transformer.from_crs(here, flat, always_xy=True).transform
    return [package("shapely").transform(shape, transform, interleaved=False) for shape in shapes]
