"""Trees become metamers and come back: what stood stays, for any tree."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import ModelError, UsageError
from pipeline.geometry.numbering import by_paths, renumbered
from pipeline.growth import DAMAGED, DORMANT, GROWN, Growth, GrowthOptions
from pipeline.growth import grow as grow_bud
from pipeline.growth.carried import carried
from pipeline.growth.carrying import MOST_YEARS, Carrying, borne, through
from pipeline.growth.conversion import BUD_WOOD_M, metamers_of
from pipeline.growth.lost import Cut
from pipeline.growth.resampling import goes_on, resample
from pipeline.model import ALLOMETRIC, MEASURED, Skeleton, TreeModel, Trunk
from pipeline.run import grow_on

OPTIONS = GrowthOptions()
LASTING = GrowthOptions(shed_threshold=0.0)


def tree_of(xyz, parent, radius, trunk=None, source=MEASURED):
    count = len(parent)
    skeleton = Skeleton(np.array(xyz, dtype=float), np.array(parent, dtype=np.int32))
    sources = np.full(count, source, dtype=np.uint8)
    return TreeModel(
        skeleton, np.broadcast_to(radius, (count,)).astype(float), sources, np.full(count, 1e-3), trunk
    )


def pole(height=2.0, nodes=5, radius=0.03):
    """A bare pole."""
    z = np.linspace(0.0, height, nodes)
    parent = np.arange(-1, nodes - 1)
    trunk = Trunk(2 * radius, 1.9 * radius, 2.1 * radius, 180.0, "measured", 0.0)
    return tree_of(np.column_stack([0 * z, 0 * z, z]), parent, radius, trunk)


def fork():
    """A stem with three children at 1 m: a thick straight one, a thick bent one, a thin one."""
    xyz = [[0, 0, 0], [0, 0, 1], [0, 0, 2], [1, 0, 1.2], [0, 0.5, 1.5]]
    return tree_of(xyz, [-1, 0, 1, 1, 1], [0.05, 0.05, 0.04, 0.04, 0.008])


@st.composite
def trees(draw):
    """Any tree: forks of any number, segments of any length, also none, radii also 0."""
    count = draw(st.integers(1, 25))
    seed = draw(st.integers(0, 2**32 - 1))
    chance = np.random.default_rng(seed)
    parent = np.array([-1, *(int(chance.integers(0, i)) for i in range(1, count))])
    step = chance.normal(scale=draw(st.sampled_from([0.0, 0.003, 0.08, 0.7])), size=(count, 3))
    step[:, 2] = np.abs(step[:, 2])
    step[chance.random(count) < 0.1] = 0.0
    xyz = np.zeros((count, 3))
    for i in range(1, count):
        xyz[i] = xyz[parent[i]] + step[i]
    radius = np.maximum(chance.choice([0.0, 0.002, 0.006, 0.02, 0.05], size=count), 0.0)
    radius[0] = 0.05
    order = by_paths(parent, np.linalg.norm(step, axis=1))
    new = renumbered(parent, order)
    sources = chance.integers(0, 3, size=count).astype(np.uint8)
    return TreeModel(
        Skeleton(xyz[order], new, np.array([1e5, 4e5, 0.0]), "EPSG:28992"),
        radius[order],
        sources[order],
        np.full(count, np.nan),
        None,
        {"method": "mst"},
    )


def same(a, b):
    np.testing.assert_array_equal(a.skeleton.xyz, b.skeleton.xyz)
    np.testing.assert_array_equal(a.skeleton.parent, b.skeleton.parent)
    np.testing.assert_array_equal(a.radius, b.radius)
    np.testing.assert_array_equal(a.radius_source, b.radius_source)
    np.testing.assert_array_equal(a.radius_rmse, b.radius_rmse)
    np.testing.assert_array_equal(a.skeleton.origin, b.skeleton.origin)
    assert (a.trunk, a.skeleton.crs) == (b.trunk, b.skeleton.crs)


def places(tree):
    return [node.tobytes() for node in tree.skeleton.xyz]


@given(trees(), st.sampled_from([0.05, 0.1, 0.4]))
@settings(max_examples=60)
def test_metamers_are_a_tree(tree, length):
    metamers = metamers_of(tree, GrowthOptions(metamer_m=length), seed=3)
    held = metamers.held()
    for name, array in held.items():
        assert np.isfinite(array.astype(float)).all(), name
    number = np.arange(len(metamers))
    assert (held["parent"] < number).all()
    np.testing.assert_allclose(np.linalg.norm(held["direction"], axis=1), 1.0)
    np.testing.assert_array_equal(held["begin"][1:], held["end"][held["parent"][1:]])
    for child, bud in (("terminal_child", "terminal_bud"), ("lateral_child", "lateral_bud")):
        has = held[child] >= 0
        assert (held["parent"][held[child][has]] == number[has]).all()
        assert ((held[bud] == GROWN) == has).all()
    sides = held["is_lateral"]
    np.testing.assert_array_equal(held["order"][1:], (held["order"][held["parent"]] + sides)[1:])
    resampled = np.linalg.norm(held["end"] - held["begin"], axis=1)
    assert resampled.max() <= 1.5 * length + 1e-9
    assert resampled.sum() <= tree.skeleton.length.sum() + 0.002 * len(metamers)  # near-zero ones


@given(trees())
@settings(max_examples=40)
def test_no_year_changes_nothing(tree):
    after = grow_on(tree, OPTIONS, 0, seed=5)
    same(after, tree)
    assert after.metadata["method"] == "mst"
    assert (after.metadata["growth"]["years"], after.metadata["growth"]["seed"]) == (0, 5)
    same(carried(tree, Growth(metamers_of(tree, OPTIONS, seed=5), OPTIONS, seed=5)), tree)


@given(trees(), st.integers(0, 9))
@settings(max_examples=40)
def test_what_stood_stays_where_it_was(tree, seed):
    after = grow_on(tree, LASTING, 3, seed=seed)
    now = {place: i for i, place in enumerate(places(after))}
    row = np.array([now[place] for place in places(tree)])
    np.testing.assert_array_equal(after.skeleton.xyz[row], tree.skeleton.xyz)
    for array in (after.skeleton.xyz, after.radius, after.start_radius, after.volume):
        assert np.isfinite(array).all()
    twice = {place for place in places(tree) if places(tree).count(place) > 1}
    one = np.array([place not in twice for place in places(tree)])
    kept, old = row[one], np.flatnonzero(one)
    assert (after.radius[kept] >= tree.radius[old]).all()
    same_radius = after.radius[kept] == tree.radius[old]
    np.testing.assert_array_equal(
        after.radius_source[kept][same_radius], tree.radius_source[old][same_radius]
    )
    assert (after.radius_source[kept][~same_radius] == ALLOMETRIC).all()
    assert np.isnan(after.radius_rmse[kept][~same_radius]).all()
    young = np.ones(len(after), dtype=bool)
    young[row] = False
    assert after.skeleton.length.sum() >= tree.skeleton.length.sum() - 1e-9


@given(trees(), st.integers(0, 9))
@settings(max_examples=25)
def test_wood_never_becomes_thinner_whatever_is_cut(tree, seed):
    growth = Carrying(tree, OPTIONS, seed=seed)
    thickest = np.zeros(0)
    chance = np.random.default_rng(seed)
    for year in through(growth, 4):
        old = growth.scanned()
        width = np.zeros(growth.scanned_metamers + 1)
        width[old[old >= 0]] = growth.metamers.held()["width"][old >= 0]
        there = width > 0
        if len(thickest):
            assert (width[there] >= thickest[there] - 1e-15).all()
        thickest = np.maximum(width, thickest) if len(thickest) else width
        if year == 2 and len(growth.metamers) > 1:
            growth.remove(int(chance.integers(1, len(growth.metamers))))
        after = growth.to_model()
        assert set(places(after)) >= {
            place
            for place, held in zip(places(tree), there[growth._origin.stations.holder], strict=True)
            if held
        }


def test_the_thickest_and_straightest_child_goes_on():
    tree = fork()
    assert goes_on(tree).tolist() == [1, 2, -1, -1, -1]
    metamers = metamers_of(tree, OPTIONS, seed=0).held()
    at = int(np.flatnonzero((metamers["end"] == tree.skeleton.xyz[1]).all(axis=1))[0])
    below = metamers["parent"][at]
    assert np.linalg.norm(metamers["end"][at] - metamers["end"][below]) == pytest.approx(0.001, rel=0.01)
    thick, thin = metamers["lateral_child"][below], metamers["lateral_child"][at]
    assert metamers["direction"][thick] @ [1, 0, 0.2] > 0.9
    assert metamers["direction"][thin] @ [0, 0.7, 0.7] > 0.9
    assert metamers["direction"][metamers["terminal_child"][at]].tolist() == [0, 0, 1]


def test_only_young_wood_has_side_buds_and_only_whole_tips_end_buds():
    thin, thick = pole(radius=0.005), pole(radius=0.04)
    young, old = metamers_of(thin, OPTIONS, seed=0).held(), metamers_of(thick, OPTIONS, seed=0).held()
    assert (young["lateral_bud"][1:] == DORMANT).all()
    assert young["lateral_bud"][0] == DAMAGED
    assert (old["lateral_bud"] == DAMAGED).all()
    assert (young["terminal_bud"][-1], old["terminal_bud"][-1]) == (DORMANT, DAMAGED)
    assert (young["width"] < BUD_WOOD_M).all()
    turn = np.diff(young["phyllotactic_angle"][1:])
    assert np.abs(turn - OPTIONS.phyllotaxis_deg).max() <= OPTIONS.phyllotaxis_spread_deg
    lean = np.degrees(np.arccos((young["lateral_bud_direction"] * young["direction"]).sum(axis=1)))
    assert np.abs(lean[1:] - OPTIONS.insertion_deg).max() <= OPTIONS.insertion_spread_deg + 1e-6


def test_a_pole_is_cut_into_metamers_of_the_length():
    stations = resample(pole(height=1.04, nodes=3), 0.1)
    np.testing.assert_allclose(np.diff(stations.end[:, 2]), 0.104)
    np.testing.assert_allclose(stations.width, 0.06)
    assert stations.holder.tolist() == [0, 5, 10]


def test_a_bud_grows_as_from_a_bud():
    bud = tree_of([[0, 0, 0]], [-1], 1e-4)
    grown, plain = grow_on(bud, OPTIONS, 12, seed=4), grow_bud(OPTIONS, 12, seed=4).to_model()
    np.testing.assert_array_equal(grown.skeleton.xyz, plain.skeleton.xyz)
    np.testing.assert_array_equal(grown.skeleton.parent, plain.skeleton.parent)
    np.testing.assert_allclose(grown.radius, plain.radius, rtol=1e-9)
    assert grown.trunk.source == "allometric"
    assert grown.trunk.lo_m is None


def test_the_same_seed_grows_the_same_and_another_does_not():
    one, two, other = (grow_on(fork(), OPTIONS, 6, seed=seed) for seed in (1, 1, 2))
    same(one, two)
    assert places(one) != places(other)


def test_the_trunk_thickens_by_what_it_comes_to_bear():
    tree = replace(fork(), trunk=Trunk(0.1, 0.09, 0.11, 300.0, "measured", -0.5))
    after = grow_on(tree, OPTIONS, 8, seed=1)
    old, new = tree.trunk, after.trunk
    assert new.dbh_m > old.dbh_m
    assert (new.source, new.arc_deg, new.lo_m) == ("allometric", 0.0, old.lo_m)
    assert new.hi_m == pytest.approx(old.hi_m + 2 * (new.dbh_m - old.dbh_m))
    power = OPTIONS.pipe_exponent
    growth = Carrying(tree, OPTIONS, seed=1)
    for _ in through(growth, 8):
        pass
    held, young = growth.metamers.held(), growth.scanned() < 0
    at_old = young & ~young[np.maximum(held["parent"], 0)]
    added = (held["width"][at_old] ** power).sum()
    tips = sum(
        min((2 * OPTIONS.tip_radius_m) ** power, (2 * tree.radius[tip]) ** power)
        for tip in tree.skeleton.tips
    )
    assert new.dbh_m**power - old.dbh_m**power <= added + 1e-12
    assert new.dbh_m**power - old.dbh_m**power >= added - tips - 1e-12


def test_a_cut_ends_where_it_was_made_and_the_trunk_keeps_its_width():
    growth = Carrying(pole(), OPTIONS, seed=0)
    growth.remove(15)
    assert growth.to_model().trunk == pole().trunk
    growth.remove(11)
    after = growth.to_model()
    assert after.skeleton.xyz[:, 2].tolist() == [0.0, 0.5, 1.0]
    growth.remove(9)
    after = growth.to_model()
    np.testing.assert_allclose(after.skeleton.xyz[:, 2], [0.0, 0.5, 0.8])
    np.testing.assert_allclose(after.radius, 0.03)
    assert after.metadata["growth"]["events"] == ({"year": 0, "what": "removal"},) * 3
    assert after.trunk == Trunk(None, None, None, 0.0, None, 0.0)  # it is lower than breast height


def test_a_shoot_from_the_middle_of_a_segment_gets_a_node_there():
    tree = pole(height=1.0, nodes=2, radius=0.004)
    growth = Carrying(tree, GrowthOptions(alpha=4.0), seed=0)
    for _ in through(growth, 3):
        pass
    after = growth.to_model()
    sides = np.flatnonzero(after.skeleton.branch_start & (after.skeleton.order == 1))
    assert len(sides)
    feet = after.skeleton.xyz[after.skeleton.parent[sides]]
    old = feet[feet[:, 2] < 1.0 - 1e-9]
    assert len(old)
    np.testing.assert_allclose(old[:, 2] / 0.1, np.round(old[:, 2] / 0.1))
    assert (after.skeleton.branch[np.isin(places(after), places(tree))] == 0).all()


def test_bent_metamers_take_their_nodes_along():
    tree = pole(height=1.0, nodes=5, radius=0.02)
    growth = Carrying(tree, OPTIONS, seed=0)
    held = growth.metamers.held()
    for i in range(6, len(growth.metamers)):  # the upper half becomes level
        held["begin"][i] = held["end"][held["parent"][i]]
        held["end"][i] = held["begin"][i] + [0.1, 0, 0]
        held["direction"][i] = [1, 0, 0]
    after = growth.to_model().skeleton.xyz
    np.testing.assert_allclose(after[:3, 2], [0.0, 0.25, 0.5])
    np.testing.assert_allclose(after[3:], [[0.25, 0, 0.5], [0.5, 0, 0.5]], atol=1e-12)


def test_branches_that_were_scanned_are_not_shed_for_being_bare():
    xyz = [[0, 0, 0], [0, 0, 1], [0, 0, 2], [3, 0, 1.5]]
    tree = tree_of(xyz, [-1, 0, 1, 1], [0.05, 0.05, 0.03, 0.03])
    plain = Growth(metamers_of(tree, OPTIONS, seed=0), OPTIONS, seed=0)
    assert plain.grow_year().shed > 25
    growth = Carrying(tree, OPTIONS, seed=0)
    assert [growth.grow_year().shed for _ in range(3)] == [0, 0, 0]
    assert (growth.metamers.held()["birth_year"] <= 3).all()


def test_what_a_tip_bears_is_a_tip():
    area = borne(np.array([-1, 0, 1, 1]), np.array([9.0, 5.0, 2.0, 0.5]), 1.0)
    assert area.tolist() == [5.0, 2.5, 1.0, 0.5]


def test_metadata_tell_how_it_grew_and_forget_what_is_untrue():
    known = {"volume_interval_l": (1, 2), "top_z": 2.1, "crown_area_m2": 2.0, "flags": ("sparse",)}
    tree = replace(fork(), metadata=known)
    after = Carrying(tree, OPTIONS, seed=0)
    for _ in through(after, 4):
        pass
    told = after.to_model({"species": "poplar"}).metadata
    assert told["flags"] == ("grown", "sparse")
    assert "volume_interval_l" not in told
    assert told["growth"]["species"] == "poplar"
    assert told["top_z"] > 2.1
    assert told["crown_area_m2"] > 2.0


def test_wrong_trees_and_years_are_named():
    with pytest.raises(ModelError, match=r"without radii.*treepipe fit"):
        metamers_of(fork().skeleton, OPTIONS, seed=0)
    with pytest.raises(ModelError, match=r"all radii of the tree are 0.*treepipe fit"):
        metamers_of(tree_of([[0, 0, 0], [0, 0, 1]], [-1, 0], 0.0), OPTIONS, seed=0)
    with pytest.raises(ModelError, match="no other node may be a root"):
        tree_of([[0, 0, 0], [0, 0, 1]], [-1, -1], 0.1)
    with pytest.raises(UsageError, match=r"20 metamers of 0.1 m, more than most_metamers, 15"):
        metamers_of(pole(), GrowthOptions(most_metamers=15), seed=0)
    with pytest.raises(UsageError, match=r"than most_metamers, 3; raise it"):
        metamers_of(pole(), GrowthOptions(most_metamers=3), seed=0)
    for years in (-1, MOST_YEARS + 1):
        with pytest.raises(UsageError, match=f"cannot grow for {years} years; give 0 to"):
            grow_on(pole(), OPTIONS, years)
    with pytest.raises(UsageError, match=r"before year \d+: the tree would have .* most_metamers, 200"):
        grow_on(pole(radius=0.005), GrowthOptions(most_metamers=200), 30)


def test_an_event_after_the_end_is_refused():
    late = Cut(7, np.zeros(3), 0.01, 1.0)
    with pytest.raises(UsageError, match="an event is of year 7, but growth is from year 0 to 5"):
        grow_on(pole(), OPTIONS, 5, events=[late])
