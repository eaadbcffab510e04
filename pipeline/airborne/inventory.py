"""The inventory: what is told of every airborne tree, one row each."""

from __future__ import annotations

from typing import Literal, NamedTuple

Dtype = Literal["string", "float64", "int32", "bool", "date32", "binary"]
"""Types by the names that Arrow gives them."""

ORDERS = 4
"""Branches are counted by order up to this one, which counts those beyond too."""


class Column(NamedTuple):
    """One column of the inventory.

    Parameters
    ----------
    name : str
        The unit stands in it where there is one; names of at most 24 letters.
    dtype : Dtype
    unit : str
        Empty where there is none.
    about : str
        One line.
    """

    name: str
    dtype: Dtype
    unit: str
    about: str


COLUMNS: tuple[Column, ...] = (
    Column("tree_id", "string", "", "edition and apex in whole decimetres, EDITION_X_Y"),
    Column("x", "float64", "m", "foot of the stem, in the tile's reference system"),
    Column("y", "float64", "m", "foot of the stem, in the tile's reference system"),
    Column("z_ground", "float64", "m", "height of the ground at the tree"),
    Column("apex_x", "float64", "m", "highest point"),
    Column("apex_y", "float64", "m", "highest point"),
    Column("height_m", "float64", "m", "highest point above the ground"),
    Column("crown_diam_m", "float64", "m", "diameter of the circle with the crown's area"),
    Column("crown_area_m2", "float64", "m2", "area of the crown in plan"),
    Column("crown_base_h_m", "float64", "m", "height above the ground at which the crown begins"),
    Column("dbh_cm", "float64", "cm", "diameter of the stem 1.3 m above the ground"),
    Column("dbh_lo_cm", "float64", "cm", "lower end of its 90 % interval"),
    Column("dbh_hi_cm", "float64", "cm", "upper end of its 90 % interval"),
    Column("dbh_method", "string", "", "measured, propagated or allometric"),
    Column("dbh_n_points", "int32", "", "points on the bark that the diameter is measured from, 0 if none"),
    Column("stem_vol_m3", "float64", "m3", "volume of the model's stem, with the diameter dbh_cm"),
    Column("total_len_m", "float64", "m", "length of the model's stem and branches"),
    *(
        Column(
            f"n_order{order}", "int32", "", f"branches of order {order}{' and beyond' * (order == ORDERS)}"
        )
        for order in range(1, ORDERS + 1)
    ),
    Column("n_points", "int32", "", "points of the tree"),
    Column("first_return_density", "float64", "1/m2", "first returns on a square metre of crown"),
    Column(
        "acq_date_min", "date32", "", "day (UTC) of the first laser pulse; null where the time is unknown"
    ),
    Column("acq_date_max", "date32", "", "day (UTC) of the last laser pulse; null where the time is unknown"),
    Column("flags", "string", "", "warnings, sorted, with commas between; empty if there are none"),
    Column("edition", "string", "", "which survey the points are of, such as ahn4"),
    Column("method", "string", "", "how the model was made: a skeleton method, or straight_stem"),
    Column("version", "string", "", "of treepipe"),
    Column("config_hash", "string", "", "SHA-256 of all options"),
    Column("cell_id", "string", "", "cell whose core holds the apex"),
    Column("model_uri", "string", "", "archive#tree_id of the model, relative to the output folder"),
    Column("crs_assumed", "bool", "", "whether the tile does not say its reference system"),
    Column("geometry", "binary", "", "POINT Z (x, y, z_ground) as WKB"),
    Column("crown", "binary", "", "outline of the crown in plan, POLYGON as WKB; null where it has no area"),
)
