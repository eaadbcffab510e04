"""Whether coordinates are metres, as far as their reference system tells."""

from __future__ import annotations

from functools import lru_cache

from pyproj import CRS
from pyproj.exceptions import CRSError

from pipeline.errors import InputFormatError
from pipeline.model import PointCloud

WITHIN = 1e-9
"""Two units are one when they differ by less than this share; US and international feet differ by 2e-6."""


@lru_cache
def other_unit(crs: str | None) -> str | None:
    """Return the unit in which a reference system counts, along whatever axis, where that is no metre.

    Parameters
    ----------
    crs : str or None
        Such as ``"EPSG:28992"``.

    Returns
    -------
    str or None
        None for metres, and for systems that are not known.

    Examples
    --------
    >>> other_unit("EPSG:28992"), other_unit("EPSG:4326"), other_unit("EPSG:2263")
    (None, 'degree', 'US survey foot')
    """
    try:
        return strange_unit(CRS.from_user_input(crs)) if crs else None
    except CRSError:
        return None


def strange_unit(system: CRS) -> str | None:
    """Return the unit of the first axis that does not count in metres, heights included; else None.

    Examples
    --------
    >>> strange_unit(CRS("EPSG:28992")), strange_unit(CRS("EPSG:28992+6360"))
    (None, 'US survey foot')
    """
    strange = (
        axis
        for axis in system.axis_info
        if axis.unit_name == "degree" or abs(axis.unit_conversion_factor - 1) > WITHIN
    )
    return next((axis.unit_name for axis in strange), None)


def require_metres(cloud: PointCloud) -> None:
    """Raise `InputFormatError` if the reference system of a cloud counts in degrees or feet.

    A system that has no name here, for want of a number, has left its unit in the metadata (``unit``).
    """
    unit = cloud.metadata.get("unit") or other_unit(cloud.crs)
    if unit is None:
        return
    where = cloud.metadata.get("source", {}).get("path", "the cloud")
    name = f" {cloud.crs}" if other_unit(cloud.crs) else ""
    msg = (
        f"{where}: its reference system{name} counts in the unit {unit}, and a tree is measured in "
        "metres; reproject the points to a system in metres first"
    )
    raise InputFormatError(msg)
