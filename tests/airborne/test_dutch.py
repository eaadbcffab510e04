"""Dutch names: classes by hand, the same in SQLite."""

from __future__ import annotations

import sqlite3

import pytest

from pipeline.airborne.dutch import CROWN_BOUNDS_M, HEIGHT_BOUNDS_M, classes, select

NAMES = "species TEXT, acq_date_max TEXT, model_uri TEXT, tree_id TEXT, geom BLOB"
FIGURES = ("height_m", "crown_diam_m", "crown_vol_m3", "dbh_cm", "crown_base_h_m")


def shown(**figures):
    file = sqlite3.connect(":memory:")
    file.row_factory = sqlite3.Row
    columns = ", ".join(f"{name} DOUBLE" for name in FIGURES)
    file.execute(f"CREATE TABLE trees ({columns}, {NAMES})")
    marks = ", ".join("?" * len(FIGURES))
    values = [figures.get(name) for name in FIGURES]
    file.execute(f"INSERT INTO trees ({', '.join(FIGURES)}) VALUES ({marks})", values)
    row = dict(file.execute(select("trees", "geom")).fetchone())
    file.close()
    return row


def test_one_tree():
    row = shown(height_m=14.96, crown_diam_m=7.0, crown_vol_m3=210.4, dbh_cm=33.6, crown_base_h_m=4.2)
    assert row["boomhoogteActueel"] == 15
    assert row["boomhoogteklasseActueel"] == "12 tot 15 m."
    assert row["kroondiameterklasseActueel"] == "7 tot 10 m."
    assert (row["kroonvolume"], row["stamdiameter"], row["takvrijeStam"]) == (210, 34, "4 m.")


@pytest.mark.parametrize(("base", "bare"), [(0.0, "0 m."), (1.99, "0 m."), (2.0, "2 m."), (12.0, "8 m.")])
def test_the_bare_stem_is_what_the_crown_leaves(base, bare):
    assert shown(crown_base_h_m=base)["takvrijeStam"] == bare


def test_what_is_unknown_is_called_so():
    row = shown()
    assert (
        row["boomhoogteklasseActueel"]
        == row["kroondiameterklasseActueel"]
        == row["takvrijeStam"]
        == "Onbekend"
    )
    assert row["boomhoogteActueel"] is None


def test_every_class_is_met_from_its_lower_bound_on():
    for bounds, column, name, beyond in (
        (HEIGHT_BOUNDS_M, "height_m", "boomhoogteklasseActueel", "hoger"),
        (CROWN_BOUNDS_M, "crown_diam_m", "kroondiameterklasseActueel", "groter"),
    ):
        named = classes(bounds, beyond)
        met = [shown(**{column: value})[name] for value in (0, *bounds)]
        assert met == list(named)
        assert shown(**{column: bounds[0] - 0.01})[name] == named[0]
