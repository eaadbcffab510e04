"""The columns of the inventory, on which tables and maps are built."""

from __future__ import annotations

import re

import pytest

from pipeline.airborne.inventory import COLUMNS, ORDERS

NAMES = [column.name for column in COLUMNS]
PROMISED = (
    ("tree_id", "x", "y", "z_ground", "apex_x", "apex_y", "geometry", "crown"),
    ("height_m", "crown_diam_m", "crown_area_m2", "crown_base_h_m", "stem_vol_m3", "total_len_m"),
    ("dbh_cm", "dbh_lo_cm", "dbh_hi_cm", "dbh_method", "dbh_n_points"),
    ("n_points", "first_return_density", "acq_date_min", "acq_date_max", "flags"),
    ("edition", "method", "version", "config_hash", "cell_id", "model_uri", "crs_assumed"),
)


def test_all_promised_columns_are_there_once():
    assert {name for names in PROMISED for name in names} <= set(NAMES)
    assert len(set(NAMES)) == len(NAMES)


def test_orders_are_counted():
    assert [name for name in NAMES if name.startswith("n_order")] == [
        f"n_order{k}" for k in range(1, ORDERS + 1)
    ]


def test_names_suit_every_database():
    assert all(re.fullmatch(r"[a-z][a-z0-9_]{0,23}", name) for name in NAMES)
    assert NAMES[-2:] == ["geometry", "crown"]


@pytest.mark.parametrize("column", COLUMNS, ids=NAMES)
def test_a_column_says_what_it_is(column):
    assert column.about
    assert not column.about.endswith(".")
    suffix = {"_m": "m", "_cm": "cm", "_m2": "m2", "_m3": "m3"}
    ends = [unit for end, unit in suffix.items() if column.name.endswith(end)]
    assert not ends or column.unit == ends[0]


@pytest.mark.parametrize("column", COLUMNS, ids=NAMES)
def test_types_are_names_that_arrow_knows(column):
    arrow = pytest.importorskip("pyarrow")
    assert arrow.type_for_alias(column.dtype) is not None
