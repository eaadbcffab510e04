"""Free space: who claims a marker, what is never free, and what a cut gives back."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree

from pipeline.growth import DORMANT, GROWN, Growth, GrowthOptions, Metamers, claims, grow
from pipeline.growth.jitter import marker
from pipeline.growth.markers import Markers
from pipeline.growth.pruning import operation_of
from pipeline.growth.views import BLOCKED

SPACE = GrowthOptions(light="space")


def free_markers(markers: Markers, tree: Metamers) -> np.ndarray:
    """(M, 3) where markers above the ground are that no metamer is near, one cell after the other."""
    grid = markers.grid
    cells = np.argwhere(np.ones(grid.values.shape, dtype=bool)) + grid.low
    every = np.array([marker(int(i), int(j), int(k), grid.voxel_m, markers._seed) for i, j, k in cells])
    far, _ = cKDTree(tree.end[: len(tree)]).query(every)
    return every[(far >= 0.2) & (every[:, 2] >= 0.0)]


def met_free(markers: Markers) -> np.ndarray:
    """(M, 3) where the markers are that buds or metamers have met, and that are free."""
    places, taken = markers.taken()
    return places[taken == 0]


@pytest.mark.parametrize("cone_deg", [60.0, 90.0, 180.0])
def test_claims_are_those_of_plain_numpy(cone_deg: float) -> None:
    options = GrowthOptions(light="space", perception_deg=cone_deg)
    growth = grow(SPACE, 9, seed=3)
    tree = growth.metamers
    markers = Markers(options, 3, tree.end[0].copy())
    markers.add(tree.end[: len(tree)])
    lit = markers.at_buds(tree)
    free = free_markers(markers, tree)
    nearest, owner = np.full(len(free), np.inf), np.full(len(free), -1)
    for i in range(len(tree)):
        waits = (tree.terminal_bud[i] != GROWN, tree.lateral_bud[i] == DORMANT)
        for which, ahead in enumerate((tree.direction[i], tree.lateral_bud_direction[i])):
            to = free - tree.end[i]
            far = np.linalg.norm(to, axis=1)
            seen = (far < 0.5) & (to @ ahead >= np.cos(np.radians(cone_deg / 2)) * far) & (far < nearest)
            if waits[which]:
                nearest[seen], owner[seen] = far[seen], 2 * i + which
    number = np.bincount(owner[owner >= 0], minlength=2 * len(tree))
    assert number.sum() > 200
    np.testing.assert_allclose(lit.terminal, number[::2] * options.full_light / markers._open())
    np.testing.assert_allclose(lit.lateral, number[1::2] * options.full_light / markers._open())
    for bud in np.flatnonzero(number)[:20]:
        to = free[owner == bud] - tree.end[bud // 2]
        way = (to / np.linalg.norm(to, axis=1)[:, None]).sum(axis=0)
        got = markers.towards(tree, np.array([bud // 2]), np.array([bud % 2 == 1]))[0]
        np.testing.assert_allclose(got, way / np.linalg.norm(way), atol=1e-9)


def test_space_around_metamers_and_under_the_ground_is_not_free() -> None:
    tree = grow(SPACE, 6, seed=1).metamers
    markers = Markers(SPACE, 1, tree.end[0].copy())
    markers.add(tree.end[: len(tree)])
    markers.at_buds(tree)
    free = met_free(markers)
    assert len(free) > 100
    far = np.linalg.norm(free[:, None] - tree.end[None, : len(tree)], axis=2).min(axis=1)
    assert far.min() >= 0.2 - 1e-12
    assert free[:, 2].min() >= 0.0
    assert (markers.taken()[1] >= BLOCKED).any()


def test_a_cut_gives_light_to_what_stays() -> None:
    growth = grow(SPACE, 12, seed=2)
    before = growth.light.at_buds(growth.metamers)
    removal = growth.remove(int(growth.metamers.axis()[12]))
    after = growth.light.at_buds(growth.metamers)
    stays = np.flatnonzero(removal.number >= 0)
    gain = after.lateral[removal.number[stays]] - before.lateral[stays]
    assert gain.max() > 0
    assert gain.min() >= 0


def test_no_free_space_lies_out_of_bounds() -> None:
    options = GrowthOptions(
        light="space", bound="box", bound_width_m=1.0, bound_depth_m=0.6, bound_height_m=1.5
    )
    markers = Markers(options, 1, np.zeros(3))
    markers.at_buds(Metamers.one_bud((0.0, 0.0, 0.8)))
    free = met_free(markers)
    assert len(free) > 50
    assert (np.abs(free) <= [0.5 + 1e-9, 0.3 + 1e-9, 1.5 + 1e-9]).all()
    assert (grow(options, 20, seed=1).metamers.held()["end"][:, 0] <= 0.5 + 1e-9).all()


def test_perception_must_reach_beyond_occupancy() -> None:
    with pytest.raises(ValueError, match="raise the one or lower the other"):
        GrowthOptions(light="space", perception=2.0)


def test_any_seed_follows_any_other() -> None:
    for seed in range(12):
        assert len(grow(SPACE, 3, seed=seed).metamers) > 5


def anew(growth: Growth) -> Markers:
    """The markers of a tree, as if it had just come to stand there."""
    tree = growth.metamers
    markers = Markers(growth.options, growth.seed, tree.end[0].copy())
    markers.add(tree.end[: len(tree)])
    return markers


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("espalier", {"tiers": 2}),
        ("thin", {"share": 0.4, "largest": 0.5}),
        ("cut-to-bud", {"order": 0, "length_m": 1.0}),
        ("bend-and-tie", {"order": 1, "from_m": 0.1}),
    ],
)
def test_what_is_kept_from_year_to_year_is_what_a_new_look_gives(name: str, values: dict[str, Any]) -> None:
    growth, pruning = Growth(Metamers.one_bud(), SPACE, seed=4), operation_of(name, values)
    for year in range(1, 13):
        growth.grow_year()
        if name == "espalier" or year == 7:
            pruning.apply(growth)
        for got, wanted in zip(
            growth.light.at_buds(growth.metamers), anew(growth).at_buds(growth.metamers), strict=True
        ):
            np.testing.assert_array_equal(got, wanted)
    assert len(growth.metamers) > 40


def test_buds_whose_view_is_not_kept_look_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    growth = grow(SPACE, 9, seed=3)
    tree = growth.metamers
    usual, every = anew(growth), (np.arange(len(tree)), np.arange(len(tree)) % 2 == 0)
    light, ways = usual.at_buds(tree), usual.towards(tree, *every)
    monkeypatch.setattr(claims, "MOST_KEPT", 500)
    monkeypatch.setattr("pipeline.growth.markers.claim", claims.claim.py_func)
    scarce = anew(growth)
    for _ in range(2):
        np.testing.assert_array_equal(scarce.at_buds(tree), light)
        np.testing.assert_array_equal(scarce.towards(tree, *every), ways)
    assert 0 < (scarce._views.start >= 0).sum() < 20
    assert np.abs(ways).sum() > 10
