"""The part of the tiles that is asked for: a box, or the polygons of a file."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from pyproj import CRS, Transformer

from pipeline.airborne.grid import Cell, Window
from pipeline.batch.extra import missing
from pipeline.batch.vectors import read_vector
from pipeline.errors import UsageError


@dataclass(frozen=True)
class Area:
    """An area in the run's reference system, a geometry of shapely."""

    shape: Any

    def meets(self, cell: Cell) -> bool:
        """Return whether a cell's core has a part in the area."""
        shapely = _package("shapely")
        shapely.prepare(self.shape)  # once: the outline of a country has many corners
        return bool(shapely.intersects(self.shape, shapely.box(*cell.core)))

    @property
    def text(self) -> str:
        """As WKT, the same for the same area."""
        return str(self.shape.normalize().wkt)


def parse_bbox(text: str) -> Window:
    """Read ``X0,Y0,X1,Y1``.

    Raises
    ------
    UsageError
        If it is no box.
    """
    try:
        west, south, east, north = (float(part) for part in text.split(","))
    except ValueError:
        west, south, east, north = 0.0, 0.0, 0.0, 0.0
    if not (west < east and south < north):
        msg = f"--bbox {text}: is no box; give west,south,east,north, such as 121000,487000,122000,488000"
        raise UsageError(msg)
    return west, south, east, north


def box_area(window: Window) -> Area:
    """Return the area of a box."""
    return Area(_package("shapely").box(*window))


def read_area(path: Path, crs: str) -> Area:
    """Read the polygons of a GeoJSON, GeoPackage or other vector file, in the system `crs`.

    Raises
    ------
    UsageError
        If the file cannot be read or holds no polygon.
    MissingExtraError
        If pyogrio or shapely is not installed.
    """
    pyogrio, shapely = _package("pyogrio"), _package("shapely")
    if not path.is_file():
        msg = f"{path}: there is no such file; check the name given to --aoi"
        raise UsageError(msg)
    try:
        info, geometry, _ = read_vector(path)
    except (pyogrio.errors.DataSourceError, pyogrio.errors.DataLayerError, ValueError) as error:
        reason = str(error).partition("\n")[0]
        msg = f"{path}: no polygons can be read there ({reason}); give a GeoJSON or GeoPackage to --aoi"
        raise UsageError(msg) from error
    shapes = [] if geometry is None else list(shapely.from_wkb(geometry))
    areas = [shape for shape in shapes if shape is not None and shape.area > 0]
    if not areas:
        msg = f"{path}: holds no polygon; give a file with the outline of the area to --aoi"
        raise UsageError(msg)
    return Area(_placed(shapely.make_valid(shapely.union_all(areas)), info["crs"], crs))


def _placed(shape: Any, source: str | None, target: str) -> Any:
    """Reproject a shape, unless it is where it should be."""
    if source is None:
        return shape
    here, there = CRS.from_user_input(source), CRS.from_user_input(target)
    flat = there.sub_crs_list[0] if there.sub_crs_list else there
    if here.equals(flat, ignore_axis_order=True) or here == there:
        return shape
    transform = Transformer.from_crs(here, flat, always_xy=True).transform
    return _package("shapely").transform(shape, transform, interleaved=False)


def _package(name: str) -> Any:
    """Import a package of the extra."""
    try:
        return import_module(name)
    except ImportError as error:
        raise missing(name) from error
