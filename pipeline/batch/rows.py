"""One row of the inventory for every tree, and the table of a cell."""

from __future__ import annotations

import datetime
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pipeline.airborne.inventory import COLUMNS, ORDERS
from pipeline.airborne.modelling import Modelled
from pipeline.airborne.tree import AirborneTree
from pipeline.batch.columns import arrow_schema
from pipeline.formats.geoparquet import arrow, points_wkb
from pipeline.model import Floats, PointCloud, TreeModel
from pipeline.report import report

GPS_EPOCH = datetime.datetime(1980, 1, 6, tzinfo=datetime.UTC)
ADJUSTED_S = 1e9  # what LAS takes off standard GPS time
LEAP_S = 18.0  # GPS time is ahead of UTC since 2017; before, by up to five seconds less

MILLIMETRE = 3
CENTIMETRE_MM = 2  # decimals of a figure in centimetres or square metres
LITRE_ML = 6  # decimals of a cubic metre

_RING = np.dtype([("order", "u1"), ("kind", "<u4"), ("rings", "<u4"), ("corners", "<u4")])


@dataclass(frozen=True)
class Survey:
    """What all trees of a cell share.

    Parameters
    ----------
    edition : str
        Which survey the points are of.
    cell_id : str
    config_hash : str
    crs_assumed : bool
        Whether the tiles do not say their reference system.
    """

    edition: str
    cell_id: str
    config_hash: str
    crs_assumed: bool

    def uri(self, tree_id: str) -> str:
        """Where the model of a tree is, from the output folder."""
        return f"cells/{self.cell_id}/models.lsjson.jsonl.zst#{tree_id}"


def tree_ids(edition: str, apexes: Floats) -> list[str]:
    """Name trees by their apexes in whole decimetres.

    Parameters
    ----------
    edition : str
    apexes : (N, 3) array
        World coordinates, metres. Of those that share a decimetre, all but the first by x, y and z are
        numbered from 2.

    Examples
    --------
    >>> tree_ids("ahn4", np.array([[124812.36, 486357.71, 9.0], [124812.31, 486357.79, 7.0]]))
    ['ahn4_1248123_4863577_2', 'ahn4_1248123_4863577']
    """
    seen: dict[str, int] = {}
    names = [""] * len(apexes)
    for k in np.lexsort(apexes.T[::-1]).tolist():
        name = f"{edition}_{math.floor(10 * apexes[k, 0])}_{math.floor(10 * apexes[k, 1])}"
        seen[name] = seen.get(name, 0) + 1
        names[k] = name if seen[name] == 1 else f"{name}_{seen[name]}"
    return names


def row(
    tree_id: str, modelled: Modelled, tree: AirborneTree, cloud: PointCloud, *, survey: Survey
) -> dict[str, Any]:
    """Return all that the inventory tells of one tree, but for its geometry.

    Parameters
    ----------
    tree_id : str
    modelled : Modelled
    tree : AirborneTree
        As it was cut out of `cloud`.
    cloud : PointCloud
        With ``gps_time``, where the time is known.
    survey : Survey

    Returns
    -------
    dict
        A value for every one of `COLUMNS` except ``geometry``; None where a thing is not known.
    """
    model = modelled.tree
    told = report(model)
    foot, apex = model.skeleton.world[0], np.asarray(tree.apex) + cloud.origin
    flags = {*told.flags, *(("crs_assumed",) if survey.crs_assumed else ())}
    first, last = acquired(cloud, tree)
    values: dict[str, Any] = {
        "tree_id": tree_id,
        "x": _rounded(foot[0]),
        "y": _rounded(foot[1]),
        "z_ground": _rounded(told.ground_z),
        "apex_x": _rounded(apex[0]),
        "apex_y": _rounded(apex[1]),
        "height_m": _rounded(told.height_m),
        "crown_diam_m": _rounded(tree.crown_diameter_m),
        "crown_area_m2": _rounded(tree.crown_area_m2, CENTIMETRE_MM),
        "crown_base_h_m": _rounded(told.crown_base_m),
        "dbh_cm": _rounded(told.dbh_cm, CENTIMETRE_MM),
        "dbh_lo_cm": _rounded(told.dbh_lo_cm, CENTIMETRE_MM),
        "dbh_hi_cm": _rounded(told.dbh_hi_cm, CENTIMETRE_MM),
        "dbh_method": told.dbh_source,
        "dbh_n_points": modelled.bark_points,
        "stem_vol_m3": _rounded(told.stem_volume_l / 1000, LITRE_ML),
        "total_len_m": _rounded(told.length_m),
        **_by_order(model),
        "n_points": len(tree.points),
        "first_return_density": _rounded(tree.first_return_density),
        "acq_date_min": first,
        "acq_date_max": last,
        "flags": ",".join(sorted(flags)),
        "method": told.method,
        "version": told.version,
        "model_uri": survey.uri(tree_id),
        "crown": polygon_wkb(np.asarray(tree.crown) + cloud.origin[:2]),
    }
    shared = ("edition", "cell_id", "config_hash", "crs_assumed")
    return values | {name: getattr(survey, name) for name in shared}


def table(rows: Sequence[Mapping[str, Any]]) -> Any:
    """Return rows as an Arrow table with `COLUMNS`, their points as geometry."""
    pa = arrow()
    points = np.array([[one["x"], one["y"], one["z_ground"]] for one in rows]).reshape(-1, 3)
    schema = arrow_schema(COLUMNS)
    held = [
        points_wkb(points)
        if field.name == "geometry"
        else pa.array([one[field.name] for one in rows], field.type)
        for field in schema
    ]
    return pa.table(held, schema=schema)


def acquired(cloud: PointCloud, tree: AirborneTree) -> tuple[datetime.date | None, datetime.date | None]:
    """Return the days (UTC) of a tree's first and last pulse; None where the time says no day.

    Parameters
    ----------
    cloud : PointCloud
        Time counts where the metadata ``gps_time_standard`` is true: adjusted standard GPS time.
    tree : AirborneTree
    """
    time = cloud.attributes.get("gps_time")
    if time is None or not cloud.metadata.get("gps_time_standard") or not len(tree.points):
        return None, None
    own = time[tree.points]
    own = own[np.isfinite(own) & (own != 0.0)]  # files without time hold zeros
    if not len(own):
        return None, None
    return _day(float(own.min())), _day(float(own.max()))


def _day(adjusted_s: float) -> datetime.date:
    return (GPS_EPOCH + datetime.timedelta(seconds=adjusted_s + ADJUSTED_S - LEAP_S)).date()


def polygon_wkb(ring: Floats) -> bytes | None:
    """Return a ring of (K, 2) corners, not closed, as a polygon in well-known binary; None below three."""
    if len(ring) < 3:
        return None
    corners = np.round(np.vstack([ring, ring[:1]]), MILLIMETRE)
    head = np.array([(1, 3, 1, len(corners))], dtype=_RING)
    return head.tobytes() + corners.astype("<f8").tobytes()


def _by_order(model: TreeModel) -> dict[str, int]:
    """Count the branches of each order; the last column holds those beyond too."""
    order = model.skeleton.order[model.skeleton.branch_start]
    count = np.bincount(np.minimum(order, ORDERS), minlength=ORDERS + 1).tolist()
    return {f"n_order{k}": count[k] for k in range(1, ORDERS + 1)}


def _rounded(value: float | None, decimals: int = MILLIMETRE) -> float | None:
    """Return a figure without float noise; None where it is not finite."""
    if value is None or not math.isfinite(value):
        return None
    return round(float(value), decimals) + 0.0
