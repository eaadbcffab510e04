"""Biomass: the published figures, and an equation of others that knows the stem."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.airborne.biomass import CARBON_SHARE, biomass


def test_a_tree_by_hand():
    broad = biomass([20.0], [10.0], ["angiosperm"])
    assert broad.agb_kg[0] == pytest.approx(0.016 * 200**2.013 * np.exp(0.020808), rel=1e-9)
    needle = biomass([20.0], [10.0], ["gymnosperm"])
    assert needle.agb_kg[0] == pytest.approx(0.109 * 200**1.79 * np.exp(0.020808), rel=1e-9)
    assert broad.carbon_kg[0] == pytest.approx(0.47 * broad.agb_kg[0])


def test_an_unknown_kind_lies_between_and_its_interval_spans_both():
    known = [biomass([20.0], [6.0], [kind]) for kind in ("angiosperm", "gymnosperm")]
    for kind in (None, [""], ["palm"]):
        unknown = biomass([20.0], [6.0], kind)
        assert min(one.agb_kg for one in known) < unknown.agb_kg < max(one.agb_kg for one in known)
        assert unknown.lo_kg == min(one.lo_kg for one in known)
        assert unknown.hi_kg == max(one.hi_kg for one in known)


@pytest.mark.parametrize(
    ("kind", "density", "scale", "power"),
    [("angiosperm", 0.56, 0.694, 0.730), ("gymnosperm", 0.42, 1.004, 0.730)],
)
def test_it_agrees_with_an_equation_that_knows_stem_and_wood(kind, density, scale, power):
    # Chave et al. (2014), equation 4: 0.0673 (wood density D^2 H)^0.976, with the stems of Jucker et al.
    height, crown = np.array([8.0, 12, 18, 25]), np.array([4.0, 6, 8, 11])
    stem = scale * (height * crown) ** power
    other = 0.0673 * (density * stem**2 * height) ** 0.976
    ours = biomass(height, crown, np.full(4, kind))
    assert ((ours.lo_kg < other) & (other < ours.hi_kg)).all()


def test_what_is_unknown_stays_unknown():
    figures = biomass([np.nan, 10.0, 0.0], [3.0, np.nan, 3.0], ["angiosperm"] * 3)
    assert np.isnan(np.array(figures)).all()
    assert biomass([], [], None).agb_kg.shape == (0,)
    assert CARBON_SHARE == 0.47
