"""The report as rows of text."""

from pipeline.studio.scan.figures import flags, rows


def test_figures_have_units_and_intervals():
    known = {
        "dbh_cm": 31.25,
        "dbh_lo_cm": 30.0,
        "dbh_hi_cm": 32.5,
        "volume_l": 1234.5,
        "crs": None,
        "branches": 12,
    }
    assert [(row.key, row.text) for row in rows(known)] == [
        ("dbh_cm", "31.2 (30.0 to 32.5) cm"),
        ("volume_l", "1,234.5 L"),
        ("branches", "12"),
    ]


def test_parts_that_are_nothing_are_left_out():
    known = {
        "dropped": {"ground": 2889, "leaf": 0},
        "radius_share": {"measured": 0.656},
        "seconds": {"fit": None},
    }
    assert [(row.label, row.text) for row in rows(known)] == [
        ("Left out: ground", "2,889"),
        ("Length with radii measured", "65.6 %"),
    ]


def test_flags_are_explained_and_new_ones_named():
    said = flags({"flags": ["no_ground", "brand_new"]})
    assert said[0] == {
        "name": "no_ground",
        "says": "no ground was found: the height counts from the lowest points",
    }
    assert said[1] == {"name": "brand_new", "says": "brand_new"}
    assert flags({}) == []
