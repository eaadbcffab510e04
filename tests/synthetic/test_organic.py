"""Trees that organise themselves, as `synth tree --kind organic` grows them."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.growth import GrowthOptions, grow
from pipeline.synthetic import kind_named, tree_of, truth_of
from pipeline.synthetic.organic import OrganicTreeOptions, grow_organic

KIND = kind_named("organic")
STEM_M = 1.3


@pytest.fixture(scope="module")
def habits():
    """One tree of each preset."""
    return {name: KIND.grow(KIND.options(**KIND.preset(name))) for name in KIND.presets}


def test_the_seed_alone_decides_and_the_truth_holds_the_tree() -> None:
    one, same, other = (KIND.grow(KIND.options(seed=seed, years=12)) for seed in (3, 3, 4))
    assert one.skeleton.xyz.tobytes() == same.skeleton.xyz.tobytes()
    assert one.skeleton.xyz.tobytes() != other.skeleton.xyz.tobytes()
    assert tree_of(truth_of(one)).skeleton.length.sum() == pytest.approx(one.skeleton.length.sum())


def test_without_a_clear_stem_it_is_the_tree_of_the_growth_model() -> None:
    tree = grow_organic(OrganicTreeOptions(years=9, seed=2))
    plain = grow(GrowthOptions(), 9, seed=2).to_model()
    assert tree.skeleton.xyz.tobytes() == plain.skeleton.xyz.tobytes()
    assert tree.radius.tobytes() == plain.radius.tobytes()


def test_presets_are_street_trees_with_a_stem_to_measure(habits) -> None:
    assert set(habits) == {"decurrent", "excurrent", "pendulous"}
    for tree in habits.values():
        z = tree.skeleton.xyz[:, 2]
        passes = (z[1:] > STEM_M) & (z[tree.skeleton.parent[1:]] <= STEM_M)
        assert passes.sum() == 1
        assert 0.12 <= 2.0 * tree.radius[1:][passes][0] <= 0.45
        assert 8.0 <= np.ptp(z) <= 15.0
        assert 500 <= len(tree) <= 4000


def test_habits_differ_as_their_names_say(habits) -> None:
    xyz = {name: tree.skeleton.xyz for name, tree in habits.items()}
    slender = {name: at[:, 2].max() / np.ptp(at[:, :2], axis=0).max() for name, at in xyz.items()}
    assert slender["excurrent"] > 1.3 * slender["decurrent"]
    hangs = {
        name: (at[tips, 2] < at[tree.skeleton.parent[tips], 2]).mean()
        for name, tree in habits.items()
        for at, tips in [(xyz[name], tree.skeleton.tips)]
    }
    assert hangs["pendulous"] > 0.5
    assert max(hangs["decurrent"], hangs["excurrent"]) < 0.2
