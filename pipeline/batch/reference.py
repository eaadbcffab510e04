"""The reference system of a run: the same for all tiles, in metres, assumed only where none is named."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pyproj import CRS
from pyproj.exceptions import CRSError

from pipeline.cloud.tiles import Tile
from pipeline.errors import UsageError

ASSUMED = "EPSG:7415"
"""RD New with NAP heights: the tiles of AHN do not name it."""

DUTCH = (0.0, 300_000.0, 300_000.0, 630_000.0)
"""Where RD New is used: west, south, east, north."""

FINEST_METRIC_SCALE = 1e-5
"""Finer steps are those of degrees."""


@dataclass(frozen=True)
class Reference:
    """A reference system, whether it was assumed, and what is to be said of it."""

    crs: str
    assumed: bool
    warnings: tuple[str, ...] = ()

    @property
    def wkt(self) -> str:
        """As a LAS file has it."""
        return str(CRS.from_user_input(self.crs).to_wkt("WKT1_GDAL"))


def reference_of(tiles: Sequence[Tile], given: str | None = None) -> Reference:
    """Find the reference system that all tiles share.

    Parameters
    ----------
    tiles : sequence of Tile
    given : str, optional
        For tiles that name none.

    Raises
    ------
    UsageError
        If a tile is in degrees or feet, or tiles are in different systems.
    """
    for tile in tiles:
        _check_units(tile)
    named = [tile for tile in tiles if tile.crs is not None]
    first = next((tile for tile in named if _is_compound(tile)), named[0] if named else None)
    if first is None:
        return _assumed(tiles, given)
    for tile in named:
        if _horizontal(tile) != _horizontal(first):
            msg = (
                f"{tile.path}: is in {_short(tile)}, {first.path} in {_short(first)}; run them apart, or "
                f"reproject one: {_command(tile, _short(first))}"
            )
            raise UsageError(msg)
    warnings = tuple(
        f"{tile.path}: names no reference system; that of the other tiles, {_short(first)}, is assumed"
        for tile in tiles
        if tile.crs is None
    )
    return Reference(str(first.crs), bool(warnings), warnings)


def _check_units(tile: Tile) -> None:
    if "degree" in tile.units or (tile.crs is None and _looks_like_degrees(tile)):
        msg = f"{tile.path}: has coordinates in degrees; reproject it to metres: {_command(tile)}"
        raise UsageError(msg)
    if tile.units:
        msg = (
            f"{tile.path}: has coordinates in {' and '.join(tile.units)} ({_short(tile)}); "
            f"reproject it to metres: {_command(tile)}"
        )
        raise UsageError(msg)


def _looks_like_degrees(tile: Tile) -> bool:
    west, south, east, north = tile.extent
    small = -180 <= west <= east <= 180 and -90 <= south <= north <= 90
    narrow = max(east - west, north - south) < 1.0 and tile.points > 1
    return small and (narrow or min(tile.lattice.scales[:2]) < FINEST_METRIC_SCALE)


def _assumed(tiles: Sequence[Tile], given: str | None) -> Reference:
    """Take the system that was given, or the Dutch one; say so where the tiles are elsewhere."""
    if given is not None:
        return Reference(_checked(given), assumed=True)
    west, south, east, north = DUTCH
    strange = tuple(
        f"{tile.path}: names no reference system and lies outside the Netherlands; "
        f"{ASSUMED} is assumed all the same, give the right one with --crs EPSG:N"
        for tile in tiles
        if not (
            west <= tile.low[0] and tile.high[0] <= east and south <= tile.low[1] and tile.high[1] <= north
        )
    )
    return Reference(ASSUMED, assumed=True, warnings=strange)


def _checked(given: str) -> str:
    """Return a reference system that was given by hand, if it is one in metres."""
    try:
        crs = CRS.from_user_input(given)
    except CRSError as error:
        msg = f"--crs {given}: is no known reference system; give it as EPSG:N, such as {ASSUMED}"
        raise UsageError(msg) from error
    units = {axis.unit_name for axis in crs.axis_info if axis.unit_conversion_factor != 1.0}
    if units:
        msg = f"--crs {given}: is not in metres but in {', '.join(sorted(units))}; reproject the tiles first"
        raise UsageError(msg)
    return given


def _is_compound(tile: Tile) -> bool:
    return bool(CRS.from_user_input(tile.crs).sub_crs_list)


def _horizontal(tile: Tile) -> CRS:
    crs = CRS.from_user_input(tile.crs)
    return crs.sub_crs_list[0] if crs.sub_crs_list else crs


def _short(tile: Tile) -> str:
    crs = CRS.from_user_input(tile.crs)
    return tile.crs if tile.crs and tile.crs.startswith("EPSG:") else str(crs.name)


def _command(tile: Tile, target: str = ASSUMED) -> str:
    """Return the command that reprojects a tile."""
    return (
        f"`pdal translate {tile.path} {tile.path.stem}_m.laz reprojection "
        f"--filters.reprojection.out_srs={target}`"
    )
