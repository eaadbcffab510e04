"""The falling fit on a tree is the best one, by a general solver and by its conditions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import LinearConstraint, minimize

from pipeline.geometry.smoothing import falling, falling_tree

seeds = st.integers(0, 100_000)


def random_tree(seed, count):
    """Values, weights and parents; every node stands on any node before it."""
    rng = np.random.default_rng(seed)
    parent = np.array([-1, *(rng.integers(0, i) for i in range(1, count))], dtype=np.int64)
    return rng.normal(size=count), rng.uniform(0.1, 3.0, count), parent


def cost(fit, values, weight):
    return float((weight * (fit - values) ** 2).sum())


def solved(values, weight, parent):
    """The same fit from a general solver."""
    child = np.arange(1, len(values))
    rise = np.zeros((len(child), len(values)))
    rise[np.arange(len(child)), parent[1:]] = 1.0
    rise[np.arange(len(child)), child] = -1.0
    return minimize(
        cost,
        np.full(len(values), values.mean()),
        args=(values, weight),
        jac=lambda fit, v, w: 2.0 * w * (fit - v),
        method="SLSQP",
        constraints=LinearConstraint(rise, 0.0, np.inf),
        options={"ftol": 1e-14, "maxiter": 500},
    ).x


@pytest.mark.parametrize("seed", range(25))
def test_it_equals_a_general_solver(seed):
    tree = random_tree(seed, 2 + seed % 14)
    np.testing.assert_allclose(falling_tree(*tree), solved(*tree), atol=2e-6)


@given(seeds, st.integers(1, 60))
def test_on_a_chain_it_equals_the_chains_own_fit(seed, count):
    values, weight, _ = random_tree(seed, count)
    chain = np.arange(count) - 1
    np.testing.assert_allclose(falling_tree(values, weight, chain), falling(values, weight), atol=1e-12)


@given(seeds, st.integers(2, 300))
def test_no_child_is_above_its_parent_and_the_mean_stays(seed, count):
    values, weight, parent = random_tree(seed, count)
    fit = falling_tree(values, weight, parent)
    assert (fit[1:] <= fit[parent[1:]] + 1e-12).all()
    assert weight @ fit == pytest.approx(weight @ values, abs=1e-9)


@given(seeds, st.integers(2, 200))
def test_what_is_pooled_has_its_own_mean(seed, count):
    """Of the optimum: the misfits of a pooled block sum to nothing, of its outer parts never to less."""
    values, weight, parent = random_tree(seed, count)
    fit = falling_tree(values, weight, parent)
    pull = weight * (values - fit)
    block = np.arange(count)
    for i in range(1, count):
        if fit[i] == fit[parent[i]]:
            block[i] = block[parent[i]]
    np.testing.assert_allclose(np.bincount(block, pull), 0.0, atol=1e-9)
    beyond = pull.copy()
    for i in range(count - 1, 0, -1):
        if block[i] == block[parent[i]]:
            beyond[parent[i]] += beyond[i]
    inner = block != np.arange(count)
    assert (beyond[inner] >= -1e-9).all()  # what is farther out would be thicker: that is why it is pooled


def test_values_that_fall_already_stay():
    parent = np.array([-1, 0, 1, 0, 3, 3])
    values = np.array([9.0, 7.0, 1.0, 8.0, 8.0, 2.0])
    np.testing.assert_array_equal(falling_tree(values, np.ones(6), parent), values)


def test_by_hand():
    # the thicker twin is pooled with the stem, the thinner stays
    parent, values = np.array([-1, 0, 0]), np.array([3.0, 5.0, 1.0])
    np.testing.assert_allclose(falling_tree(values, np.array([1.0, 3.0, 1.0]), parent), [4.5, 4.5, 1.0])


def test_several_roots_know_nothing_of_each_other():
    a, b = random_tree(1, 20), random_tree(2, 30)
    parent = np.concatenate([a[2], np.where(b[2] >= 0, b[2] + 20, -1)])
    both = falling_tree(np.concatenate([a[0], b[0]]), np.concatenate([a[1], b[1]]), parent)
    np.testing.assert_array_equal(both, np.concatenate([falling_tree(*a), falling_tree(*b)]))


@given(seeds, st.integers(2, 80))
def test_the_numbering_of_siblings_makes_no_difference(seed, count):
    values, weight, parent = random_tree(seed, count)
    depth = np.zeros(count, dtype=np.int64)
    for i in range(1, count):
        depth[i] = depth[parent[i]] + 1
    order = np.lexsort((np.random.default_rng(seed).random(count), depth))
    number = np.argsort(order)
    above = np.where(parent >= 0, number[parent], -1)[order]
    other = falling_tree(values[order], weight[order], above)
    np.testing.assert_allclose(other[number], falling_tree(values, weight, parent), atol=1e-10)


def test_a_long_chain_and_a_wide_star_are_no_trouble():
    count = 20_000
    values = np.random.default_rng(0).normal(size=count)
    chain, star = np.arange(count) - 1, np.minimum(np.arange(count) - 1, 0)
    np.testing.assert_allclose(
        falling_tree(values, np.ones(count), chain), falling(values, np.ones(count)), atol=1e-10
    )
    fit = falling_tree(values, np.ones(count), star)
    np.testing.assert_array_equal(fit[1:], np.minimum(values[1:], fit[0]))
