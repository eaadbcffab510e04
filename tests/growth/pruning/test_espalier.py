"""An espalier: as many tiers as asked for, level arms to either side, the same year after year."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.errors import UsageError
from pipeline.growth import Growth, GrowthOptions, Metamers
from pipeline.growth.pruning import Espalier
from pipeline.growth.pruning.operation import leader
from tests.growth.pruning.conftest import SEEDS, check_whole

TIERS, WALL = 2, 30.0


def arms(growth) -> list[tuple[int, np.ndarray]]:
    """Return the place on the stem (from 1) and the way of every branch longer than two metamers."""
    tree, found = growth.metamers, []
    line = leader(tree)[1:].tolist()
    for place, metamer in enumerate(line, 1):
        side = int(tree.lateral_child[metamer])
        if side >= 0 and side not in line and len(tree.axis(side)) > 2:
            found.append((place, tree.end[tree.axis(side)[-1]] - tree.begin[side]))
    return found


@pytest.fixture(scope="module")
def trained():
    """For every seed: an espalier at year 13, and its arms then and in each of the next five years."""
    result = []
    for seed in SEEDS:
        growth, seen = Growth(Metamers.one_bud(), GrowthOptions(), seed=seed), []
        for year in range(1, 19):
            growth.grow_year()
            Espalier(tiers=TIERS, wall_deg=WALL, arm_m=0.8).apply(growth)
            if year >= 13:
                seen.append(arms(growth))
        result.append((growth, seen))
    return result


def test_there_are_as_many_tiers_as_asked_for(trained) -> None:
    for growth, seen in trained:
        assert [place for place, _ in seen[0]] == [4, 5, 10, 11]
        assert len(leader(growth.metamers)) == 1 + 6 * TIERS


def test_one_arm_goes_to_either_side_level_and_along_the_wall(trained) -> None:
    along = np.array([np.cos(np.radians(WALL)), np.sin(np.radians(WALL)), 0.0])
    for _, seen in trained:
        ways = np.array([way / np.linalg.norm(way) for _, way in seen[0]])
        assert np.abs(np.degrees(np.arcsin(ways[:, 2]))).max() < 15
        assert (np.abs(ways @ along) > np.cos(np.radians(15))).all()
        sides = (ways @ along > 0).reshape(TIERS, 2)
        assert (sides.sum(axis=1) == 1).all()


def test_it_stays_as_it_is_for_five_years(trained) -> None:
    for growth, seen in trained:
        for later in seen[1:]:
            assert [place for place, _ in later] == [place for place, _ in seen[0]]
            for (_, before), (_, after) in zip(seen[0], later, strict=True):
                assert np.linalg.norm(before - after) < 0.1
        check_whole(growth)


def test_arms_and_their_shoots_stay_short(trained) -> None:
    for growth, seen in trained:
        tree = growth.metamers
        assert max(np.linalg.norm(way) for _, way in seen[-1]) <= 0.8 + 1e-9
        assert np.linalg.norm(tree.held()["end"][:, :2], axis=1).max() < 1.2


def test_the_stem_has_a_kink_where_a_bud_has_taken_over(trained) -> None:
    for growth, _ in trained:
        tree = growth.metamers
        line = leader(tree)
        assert tree.is_lateral[line[7]]
        assert float(tree.direction[line[6]] @ tree.direction[line[7]]) < np.cos(np.radians(10))


def test_a_grown_tree_is_not_made_an_espalier(tree_of) -> None:
    growth = tree_of(12)
    growth.metamers.width[1:8] = 0.2
    with pytest.raises(UsageError, match=r"trained from a young tree; .* 20 cm thick"):
        Espalier(tiers=1).apply(growth)
