"""The shortest system: against brute force, against its own rules, and against its bound."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.skeleton.minimal.attaching import RELAXED_DEG, attach_all, relax
from pipeline.skeleton.minimal.bounds import spanning_bound
from pipeline.skeleton.minimal.clusters import by_clusters, middles
from pipeline.skeleton.minimal.exact import solve
from pipeline.skeleton.minimal.histories import all_histories
from pipeline.skeleton.minimal.problem import Axes, Problem, System
from pipeline.skeleton.minimal.reattaching import reattach
from pipeline.skeleton.minimal.search import BUNCH, Budget, _bunch, improve, search
from pipeline.skeleton.minimal.solving import shortest
from tests.skeleton.minimal.problems import broken_rules, by_dull_force, by_force, crown

ANGLES = st.lists(st.floats(20, 90), min_size=1, max_size=3).map(tuple)


def best_of(problem: Problem, known: System | None = None) -> System:
    answer = solve(all_histories(problem, most=100_000), known or attach_all(problem))
    assert answer.proven
    return answer.system


@pytest.mark.parametrize("seed", range(200))
def test_exact_is_brute_force(seed):
    problem = crown(3 + seed % 4, seed, (42.5, 60.0) if seed % 8 < 4 else (42.5,))
    assert best_of(problem, System.empty(problem)).worth == pytest.approx(by_force(problem))


@pytest.mark.parametrize("seed", range(8))
def test_brute_force_tries_everything(seed):
    problem = crown(3 + seed % 2, seed, (42.5, 60.0) if seed % 4 < 2 else (42.5,))
    assert by_force(problem) == pytest.approx(by_dull_force(problem))


def test_brute_force_meets_leaves_that_cannot_be_reached():
    low = Problem(
        np.array([[4.0, 0.0, 1.0], [0.5, 0.0, 6.0], [0.0, 0.0, -1.0], [2.0, 0.0, 4.0]]),
        Axes.trunk(np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 4.0], [0.0, 0.0, 11.0]])),
        np.radians([42.5]),
    )
    free, length = by_force(low)
    assert free > 0
    assert best_of(low).worth == pytest.approx((free, length))


@given(seed=st.integers(0, 10_000), count=st.integers(1, 40), angles=ANGLES)
@settings(max_examples=30)
def test_every_way_keeps_the_rules_and_none_is_worse_than_the_one_before(seed, count, angles):
    problem = crown(count, seed, angles)
    greedy = attach_all(problem)
    searched = improve(greedy, rounds=5, seed=0)
    best = best_of(problem, searched)
    for system in (greedy, searched, best):
        assert broken_rules(system) == []
    assert not greedy.better_than(searched)
    assert not searched.better_than(best)
    assert spanning_bound(problem, best) <= best.total + 1e-9


@pytest.mark.parametrize("seed", range(3))
def test_the_search_comes_within_half_a_percent(seed):
    problem = crown(80, seed)
    searched, best = search(attach_all(problem), Budget(2, 150)), best_of(problem)
    assert searched.worth[0] == best.worth[0]
    assert searched.total <= 1.005 * best.total
    assert attach_all(problem).total > 1.005 * best.total  # there is something to search for


@given(seed=st.integers(0, 10_000), count=st.integers(1, 60), angles=ANGLES)
@settings(max_examples=40)
def test_the_quick_search_keeps_the_rules_and_is_never_worse(seed, count, angles):
    greedy = attach_all(crown(count, seed, angles))
    quick = reattach(greedy, rounds=2 * count, seed=seed)
    assert broken_rules(quick) == []
    assert not greedy.better_than(quick)


def test_the_quick_search_halves_what_is_too_long():
    much, left = 0.0, 0.0
    for seed in range(3):
        problem = crown(80, seed)
        greedy, best = attach_all(problem), best_of(problem)
        much += greedy.total - best.total
        left += reattach(greedy, rounds=160, seed=0).total - best.total
    assert 0.0 < left < 0.5 * much


def test_a_system_that_is_known_does_not_change_the_answer():
    problem = crown(40, 5)
    assert best_of(problem, attach_all(problem)).total == pytest.approx(
        best_of(problem, System.empty(problem)).total
    )


def test_a_bunch_is_whole_subtrees():
    system = attach_all(crown(120, 2))
    for seed in (0, 40, 119):
        bunch = set(_bunch(system, seed))
        assert 0 < len(bunch) <= BUNCH
        assert all(set(system.subtrees[leaf]) <= bunch for leaf in bunch)


def test_clusters_are_solved_from_coarse_to_fine():
    problem = crown(700, 1)
    scaffold = middles(problem.leaves)
    assert 100 < len(scaffold) <= 400
    assert len(set(scaffold.tolist())) == len(scaffold)
    system = by_clusters(problem, Budget(1, 4))
    assert broken_rules(system) == []
    assert not attach_all(problem).better_than(system)


def test_the_trie_says_when_it_is_cut():
    problem = crown(40, 3)
    whole, cut = all_histories(problem, most=100_000), all_histories(problem, most=100)
    assert whole.whole
    assert not cut.whole
    assert len(cut) <= 100 < len(whole)
    assert not all_histories(problem, most=100_000, choices=0).whole


@pytest.mark.parametrize("count", [30, 130])
def test_the_outcome_is_bounded(count):
    outcome = shortest(crown(count, 4), Budget(3, 20, seed=1), exact_leaves=100)
    assert outcome.proven is (count == 30)
    assert 0.0 < outcome.bound_m <= outcome.strict.total
    assert (outcome.length_over_bound == 1.0) is outcome.proven
    assert not outcome.system.free.any()
    assert broken_rules(outcome.system) == []


def test_same_seed_same_system_and_rows_do_not_matter_to_the_least_length():
    problem = crown(60, 9)
    once, again = (improve(attach_all(problem), rounds=10, seed=3) for _ in range(2))
    np.testing.assert_array_equal(once.mother, again.mother)
    assert once.base.tobytes() == again.base.tobytes()
    rows = np.random.default_rng(1).permutation(60)
    mixed = problem.part(rows, problem.roots)
    assert best_of(mixed).total == pytest.approx(best_of(problem).total)


def test_leaves_out_of_reach_are_reached_at_other_angles_or_from_the_nearest_place():
    leaves = np.array([[1.0, 0.0, 5.0], [3.0, 0.0, 2.9], [0.0, -4.0, 0.1]])
    problem = Problem(leaves, Axes.trunk(np.array([[0.0, 0, 0], [0, 0, 11]])), np.radians([42.5]))
    strict = attach_all(problem)
    assert strict.free.tolist() == [False, True, True]
    system = relax(strict)
    assert not system.free.any()
    assert system.off_angle[0] == 0.0
    assert system.off_angle[1] == 5.0  # at 47.5 degrees it starts at 0.15 m
    assert np.isnan(system.off_angle[2])
    np.testing.assert_allclose(system.base[2], [0, 0, 0.1])
    assert max(map(abs, RELAXED_DEG)) == 20.0


def test_no_leaves_are_no_trouble():
    outcome = shortest(crown(0, 0), Budget(3, 10), exact_leaves=10)
    assert outcome.system.total == 0.0
