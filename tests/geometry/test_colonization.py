"""Space colonization: equal to a search among all nodes, and small cases with answers by hand."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from pipeline.errors import UsageError
from pipeline.geometry.colonization import Rules, colonize

ROOT = (np.zeros((1, 3)), np.array([-1]))
UP = np.array([0.0, 0.0, 1.0])


def by_brute_force(points, first, rules, kill_m):
    """Compare all points with all nodes anew in every iteration."""
    xyz, parent = [np.array(p) for p in first[0]], list(first[1])
    heading = [UP if p < 0 else unit(xyz[i] - xyz[p]) for i, p in enumerate(parent)]
    live = np.ones(len(points), dtype=bool)
    half = np.radians(rules.perception_deg) / 2
    for kill in kill_m:
        if not live.any():
            return np.array(xyz), parent, live, "exhausted"
        run = points[:, None] - np.array(xyz)[None]
        away = np.linalg.norm(run, axis=2)
        perceived = np.einsum("pnk,nk->pn", run, np.array(heading)) >= np.cos(half) * away - 1e-12
        seen = np.where(perceived & (away <= rules.influence_m), away, np.inf)
        nearest = np.where(live & np.isfinite(seen.min(axis=1)), seen.argmin(axis=1), -1)
        count = len(xyz)
        for q in sorted(set(nearest[nearest >= 0].tolist())):
            pull = sum(unit(points[i] - xyz[q]) for i in np.flatnonzero(nearest == q))
            way = direction(pull, heading[q], rules, half)
            child = xyz[q] + rules.step_m * way
            twins = [c for c in range(len(xyz)) if parent[c] == q]
            if all(np.linalg.norm(xyz[c] - child) >= 1e-3 * rules.step_m for c in twins):
                xyz, parent, heading = xyz + [child], parent + [q], heading + [way]
        if len(xyz) == count:
            return np.array(xyz), parent, live, "stalled" if (nearest >= 0).any() else "out_of_reach"
        away = np.linalg.norm(points[:, None] - np.array(xyz)[None], axis=2).min(axis=1)
        live &= away >= kill
    return np.array(xyz), parent, live, "max_iter" if live.any() else "exhausted"


def direction(pull, heading, rules, half):
    way = unit((unit(pull) if rules.tropism_on == "unit" else pull) + np.array(rules.tropism))
    angle = np.arccos(np.clip(way @ heading, -1, 1))
    if angle <= half:
        return way
    side = unit(way - (way @ heading) * heading)
    return np.cos(half) * heading + np.sin(half) * side


def unit(vector):
    return vector / np.linalg.norm(vector)


@settings(deadline=None, max_examples=40)
@given(
    seed=st.integers(0, 10_000),
    count=st.integers(1, 120),
    influence=st.floats(0.5, 4.0),
    ends=st.tuples(st.floats(0.1, 0.45), st.floats(0.1, 0.45)),
    perception=st.sampled_from([90.0, 160.0, 200.0, 360.0]),
    tropism=st.sampled_from([(0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.3, 0.0, -0.4)]),
    on=st.sampled_from(["sum", "unit"]),
)
@example(1, 120, 1.5, (0.1, 0.45), 160.0, (0.0, 0.0, 1.0), "sum")  # the kill distance rises
@example(1, 120, 1.5, (0.45, 0.1), 160.0, (0.0, 0.0, 1.0), "sum")  # it falls
def test_equals_brute_force(seed, count, influence, ends, perception, tropism, on):
    rng = np.random.default_rng(seed)
    points = rng.uniform([-1.5, -1.5, 0.0], [1.5, 1.5, 3.0], (count, 3))
    stem = np.column_stack([np.zeros((4, 2)), 0.2 * np.arange(4)])
    first = (stem, np.arange(4) - 1)
    rules = Rules(0.2, influence, perception, tropism, on)
    kill = np.linspace(*ends, 12)
    xyz, parent, live, reason = by_brute_force(points, first, rules, kill)
    colony = colonize(points, first, rules=rules, kill_m=kill)
    assert colony.parent.tolist() == list(parent)
    np.testing.assert_allclose(colony.xyz, xyz, atol=1e-9)
    np.testing.assert_array_equal(colony.left, live)
    assert colony.reason == reason


def test_one_point_is_reached_in_a_straight_line():
    colony = colonize(np.array([[0, 0, 1.0]]), ROOT, rules=Rules(0.25, 2.0), kill_m=np.full(9, 0.3))
    np.testing.assert_allclose(colony.xyz[:, 2], [0, 0.25, 0.5, 0.75])
    assert colony.parent.tolist() == [-1, 0, 1, 2]
    assert (colony.reason, colony.iterations, colony.left.any()) == ("exhausted", 3, False)


def test_cone_comes_before_the_minimum():
    points = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 2.0]])  # the nearer one is behind
    colony = colonize(points, ROOT, rules=Rules(0.5, 3.0, 160.0), kill_m=np.full(9, 0.3))
    assert colony.reason == "out_of_reach"
    assert colony.left.tolist() == [True, False]
    assert colony.xyz[:, 2].min() == 0.0


def test_a_direction_beyond_the_cone_is_turned_back_to_its_edge():
    rules = Rules(1.0, 3.0, 90.0, tropism=(0.0, 0.0, -9.0))
    colony = colonize(np.array([[0.5, 0, 2.0]]), ROOT, rules=rules, kill_m=np.array([0.1]))
    np.testing.assert_allclose(colony.xyz[1], [np.sqrt(0.5), 0, np.sqrt(0.5)])


@pytest.mark.parametrize(
    ("points", "kill", "reason"),
    [
        (np.zeros((0, 3)), 0.1, "exhausted"),
        (np.array([[0, 0, 9.0]]), 0.1, "out_of_reach"),
        (np.array([[1.0, 0, 1], [-1.0, 0, -1]]), 0.1, "stalled"),  # the pulls cancel out
        (np.array([[0, 0, 1.9]]), 0.01, "max_iter"),
    ],
)
def test_the_reason_to_stop(points, kill, reason):
    colony = colonize(points, ROOT, rules=Rules(0.1, 2.0), kill_m=np.full(3, kill))
    assert colony.reason == reason


def test_two_points_side_by_side_stall_instead_of_looping():
    points = np.array([[1.0, 0, 0.05], [-1.0, 0, 0.05]])  # the node between them grows the same child
    colony = colonize(points, ROOT, rules=Rules(0.1, 1.2), kill_m=np.full(1000, 0.01))
    assert colony.reason == "stalled"
    assert len(colony.xyz) < 10


def test_progress_is_told_after_every_iteration():
    told = []
    points = np.random.default_rng(1).uniform(0, 2, (200, 3))
    colony = colonize(points, ROOT, rules=Rules(0.2, 1.0), kill_m=np.full(7, 0.3), progress=told.append)
    assert [step.done for step in told] == list(range(1, 8))
    assert told[-1].nodes == len(colony.xyz)
    assert told[-1].points_left == colony.left.sum()


@pytest.mark.parametrize("kill", [1.0, 1.5])
def test_a_kill_distance_not_below_influence_is_refused(kill):
    with pytest.raises(UsageError, match="not below the influence distance of 1 m"):
        colonize(np.zeros((1, 3)), ROOT, rules=Rules(0.2, 1.0), kill_m=np.array([0.5, kill]))


def test_a_stray_point_far_away_costs_nothing():
    points = np.vstack([np.random.default_rng(1).uniform(0, 2, (200, 3)), [[1e6, 0, 0]]])
    with_stray = colonize(points, ROOT, rules=Rules(0.2, 1.0), kill_m=np.full(7, 0.3))
    without = colonize(points[:-1], ROOT, rules=Rules(0.2, 1.0), kill_m=np.full(7, 0.3))
    np.testing.assert_allclose(with_stray.xyz, without.xyz, atol=1e-9)
