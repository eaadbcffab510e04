"""Diameters from height and crown width: the printed rows, their interval, and real stems."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.airborne.allometry import ROWS, AllometryOptions, breast_height_diameter, row_of
from pipeline.cylinders.allometry import GLOBAL, allometric_diameter

METRES = st.floats(1.0, 60.0)


@pytest.mark.parametrize(
    ("biome", "leaf", "expected_cm"),
    [  # a (15 x 8)^b, by hand
        ("unknown", "unknown", 26.83),
        ("palearctic-temperate-mixed", "angiosperm", 22.87),
        ("palearctic-temperate-mixed", "gymnosperm", 33.08),
        ("temperate-conifer", "angiosperm", 23.10),
        ("temperate-conifer", "gymnosperm", 34.98),
    ],
)
def test_rows_of_the_paper(biome, leaf, expected_cm):
    options = AllometryOptions(biome=biome, leaf_type=leaf)
    found = breast_height_diameter(15.0, 8.0, options=options)
    assert 100 * found.dbh_m == pytest.approx(expected_cm, abs=0.02)


@pytest.mark.parametrize(
    ("biome", "leaf"),
    [("unknown", "angiosperm"), ("temperate-conifer", "unknown"), ("unknown", "unknown")],
)
def test_the_global_row_stands_for_what_is_unknown(biome, leaf):
    assert row_of(biome, leaf) is GLOBAL
    options = AllometryOptions(biome=biome, leaf_type=leaf)
    assert breast_height_diameter(20.0, 6.0, options=options).dbh_m == allometric_diameter(20.0, 6.0)


@given(METRES, METRES)
def test_the_interval_is_a_factor_to_either_side(height, crown):
    found = breast_height_diameter(height, crown)
    assert found.hi_m / found.dbh_m == pytest.approx(found.dbh_m / found.lo_m)
    assert found.hi_m / found.dbh_m == pytest.approx(np.exp(1.645 * 0.35))


@given(METRES, METRES, st.sampled_from([*ROWS, ("unknown", "unknown")]))
def test_larger_trees_are_thicker(height, crown, key):
    options = AllometryOptions(biome=key[0], leaf_type=key[1])
    small = breast_height_diameter(height, crown, options=options)
    assert breast_height_diameter(1.1 * height, crown, options=options).dbh_m > small.dbh_m
    assert breast_height_diameter(height, 1.1 * crown, options=options).dbh_m > small.dbh_m


def test_the_amsterdam_tree_lies_within():
    """14.7 m high, 12.6 m wide; 57.1 cm by two mobile scanners."""
    found = breast_height_diameter(14.7, 12.6)
    assert found.lo_m < 0.571 < found.hi_m
