"""Generators by name, and what a wrong name is answered with."""

from __future__ import annotations

import pytest

from pipeline.errors import UsageError
from pipeline.synthetic import KINDS, kind_named
from pipeline.synthetic.tubes import PRESETS


@pytest.mark.parametrize("name", KINDS)
def test_every_kind_takes_a_seed_and_grows_with_every_preset(name: str) -> None:
    kind = KINDS[name]
    assert "seed" in kind.options.model_fields
    for preset in kind.presets:
        kind.options(**kind.preset(preset))


def test_the_habits_differ() -> None:
    tree = {name: KINDS["tubes"].grow(KINDS["tubes"].options(**preset)) for name, preset in PRESETS.items()}
    tips = {name: one.skeleton.xyz[one.skeleton.tips, 2].mean() for name, one in tree.items()}
    tops = {name: one.skeleton.xyz[:, 2].max() for name, one in tree.items()}
    assert tops["sapling"] < 4 < tops["pendulous"] < tops["excurrent"]
    assert tips["pendulous"] / tops["pendulous"] < tips["leaning"] / tops["leaning"]
    assert (tree["decurrent"].skeleton.order == 0).sum() > 1
    assert min(one.skeleton.xyz[:, 2].min() for one in tree.values()) > -0.2


def test_a_wrong_name_is_answered_with_the_right_ones() -> None:
    assert kind_named("tubes") is KINDS["tubes"]
    with pytest.raises(UsageError, match=r"unknown kind of tree 'tube', do you mean tubes\? known: tubes"):
        kind_named("tube")
    with pytest.raises(UsageError, match="unknown preset 'oak'; known: sapling, excurrent"):
        KINDS["tubes"].preset("oak")
