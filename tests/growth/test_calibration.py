"""Growth fitted to what a tree has become: pairs whose growth is known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pipeline.errors import ModelError, UsageError
from pipeline.growth import GrowthOptions
from pipeline.growth.calibration import (
    FITTED,
    SearchOptions,
    Size,
    calibrate,
    options_at,
    place_of,
    size_of,
)
from pipeline.growth.carrying import Carrying
from pipeline.growth.lost import lost_wood
from pipeline.jobs.simulation import bud
from pipeline.jobs.standing import wood_points
from pipeline.run import grow_on

YEARS = 5


@pytest.fixture(scope="module")
def young():
    """A tree of ten years."""
    return grow_on(bud(), GrowthOptions(alpha=2.6), 12, seed=2)


@pytest.mark.parametrize(
    "truth", [{"alpha": 3.0, "dominance": 0.5}, {"alpha": 2.3, "metamer_m": 0.14, "voxel_m": 0.14}]
)
def test_known_growth_is_found_again(young, truth):
    later = size_of(grow_on(young, GrowthOptions(**truth), YEARS, seed=11))
    search = SearchOptions(trials=100, seed=3)
    found = calibrate(young, later, YEARS, search=search)
    grown = np.subtract(later, size_of(young))
    assert (grown > 0).all()
    assert max(found.errors().values()) < 0.2  # truth has chances of its own
    np.testing.assert_allclose(found.reached, later, atol=0.2 * grown.max())
    again = size_of(grow_on(young, found.options, YEARS, seed=search.seed))
    assert again == found.reached


def test_the_same_seed_finds_the_same(young):
    later = Size(*(1.2 * np.array(size_of(young))))
    search = SearchOptions(trials=12, seed=5)
    one, two = (calibrate(young, later, 3, search=search) for _ in range(2))
    assert one == two
    more = calibrate(young, later, 3, search=search.model_copy(update={"trials": 40}))
    assert sum(more.errors().values()) < sum(one.errors().values()) + 1e-3


def test_what_is_not_fitted_stays_and_voxels_follow_the_metamers():
    start = GrowthOptions(insertion_deg=50, metamer_m=0.1, voxel_m=0.2)
    options = options_at(np.full(4, 0.5), start)
    assert options.insertion_deg == 50
    assert options.voxel_m == pytest.approx(2 * options.metamer_m, abs=1e-4)
    np.testing.assert_allclose(
        [getattr(options_at(place_of(start), start), name) for name in FITTED],
        [getattr(start, name) for name in FITTED],
        atol=1e-4,
    )


def test_a_measure_that_is_not_known_does_not_count(young):
    later = size_of(young)._replace(dbh_m=np.nan, height_m=3.4)
    found = calibrate(young, later, 2, search=SearchOptions(trials=4))
    assert np.isnan(found.errors()["dbh_m"])
    with pytest.raises(ModelError, match="neither height nor crown"):
        calibrate(young, Size(np.nan, np.nan, np.nan), 2)
    with pytest.raises(UsageError, match="growth needs one at least"):
        calibrate(young, later, 0)


def test_a_branch_that_is_gone_is_proposed_as_a_cut(young):
    graph = young.skeleton
    sides = np.flatnonzero(graph.branch_start & (graph.order == 1))
    carried = graph.subtree_length + graph.length
    target = int(sides[np.argmax(carried[sides])])
    growth = Carrying(young, GrowthOptions(), seed=0)
    position = (graph.xyz[target] + graph.xyz[graph.parent[target]]) / 2
    ends = growth.metamers.held()["end"]
    growth.remove(int(np.argmin(np.linalg.norm(ends - graph.xyz[target], axis=1))))
    pruned = growth.to_model()
    (cut,) = lost_wood(young, wood_points(pruned))
    assert np.linalg.norm(cut.position - position) < 0.6  # steep, it stands within 0.2 m of the stem so far
    assert cut.length_m <= carried[target] + 1e-9
    assert cut.length_m > 0.7 * carried[target]
    assert lost_wood(young, wood_points(young)) == ()
    after = grow_on(young, GrowthOptions(), 0, events=[cut])
    gone = young.skeleton.length.sum() - after.skeleton.length.sum()
    assert gone == pytest.approx(cut.length_m, abs=0.2)


def test_sizes_are_those_of_the_points_where_they_are_known(young):
    told = {"ground_z": -1.0, "top_z": 9.0, "crown_area_m2": np.pi}
    assert size_of(replace(young, metadata=told, trunk=None))[::2] == (10.0, 2.0)
    assert np.isnan(size_of(replace(young, trunk=None)).dbh_m)
