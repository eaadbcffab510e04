"""The pipe rule, its exceptions, and where radii come from."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from pipeline.lsystem import LsystemOptions, decode, encode
from pipeline.lsystem.radii import exceptions, grow_radii, shares, sources, sources_text
from pipeline.model import TreeModel

PARENT = np.array([-1, 0, 1, 1], dtype=np.int32)
WOOD = np.array([10.0, 10, 5, 4])


def test_the_rule_shares_the_cross_section() -> None:
    assert shares(PARENT, WOOD, 0.5) == pytest.approx([1, 1, 0.5**0.5, 0.4**0.5])
    assert shares(PARENT, WOOD, 0).tolist() == [1, 1, 1, 1]


def test_nothing_carried_is_shared_without_a_warning() -> None:
    assert shares(PARENT, np.zeros(4), 0.5).tolist() == [1, 1, 1, 1]


def test_only_what_the_rule_misses_is_an_exception() -> None:
    share = np.array([1, 1, 0.5, 0.5])
    radius = np.array([0.1, 0.08, 0.041, 0.045])
    tolerance = 0.002
    missed = exceptions(PARENT, share, radius, tolerance)
    assert missed.tolist() == [False, True, False, True]
    given = np.where(missed, radius, np.nan)
    given[0] = 0.1
    assert grow_radii(PARENT, share, given) == pytest.approx([0.1, 0.08, 0.04, 0.045])
    assert exceptions.py_func(PARENT, share, radius, tolerance).tolist() == missed.tolist()
    assert grow_radii.py_func(PARENT, share, given).tolist() == grow_radii(PARENT, share, given).tolist()


def test_a_tree_that_follows_the_rule_costs_nothing(tree_of: Callable[..., TreeModel]) -> None:
    tree = tree_of([[0, 0, 0], [0, 0, 1], [0, 0, 2], [0, 1, 1]], [-1, 0, 1, 1], [0.1, 0.1, 0.0577, 0.0577])
    assert "!" not in encode(tree)["axiom"]
    assert encode(tree, options=LsystemOptions(radii="all"))["axiom"].count("!") == 3
    off = tree_of([[0, 0, 0], [0, 0, 1], [0, 0, 2], [0, 1, 1]], [-1, 0, 1, 1], [0.1, 0.1, 0.0577, 0.0677])
    assert encode(off)["axiom"].count("!") == 1
    assert encode(off, options=LsystemOptions(radii="none"))["axiom"].count("!") == 0


def test_without_radii_nothing_claims_to_be_measured(tree_of: Callable[..., TreeModel]) -> None:
    tree = tree_of([[0, 0, 0], [0, 0, 1]], [-1, 0])
    document = encode(tree, options=LsystemOptions(radii="none"))
    assert "source" not in document["radius"]
    assert decode(document).radius_source.tolist() == [1, 1]
    assert decode(encode(tree)).radius_source.tolist() == [0, 0]


def test_sources_are_runs() -> None:
    source = np.array([0, 0, 0, 1, 2, 2, 0], dtype=np.uint8)
    assert sources_text(source) == "m3p1a2m1"
    assert sources("m3p1a2m1", 7).tolist() == source.tolist()
    assert sources(None, 2).tolist() == [1, 1]
