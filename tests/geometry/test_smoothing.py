"""The compiled smoothers equal their textbook formulas."""

import numpy as np
from scipy.optimize import isotonic_regression

from pipeline.geometry.smoothing import falling, whittaker


def test_whittaker_solves_its_normal_equations():
    rng = np.random.default_rng(0)
    values, weight = rng.normal(size=(40, 3)), rng.random(40)
    second = np.diff(np.eye(40), 2, axis=0)
    system = np.diag(weight + 1e-9) + 2.5 * second.T @ second
    expected = np.linalg.solve(system, (weight + 1e-9)[:, None] * values)
    np.testing.assert_allclose(whittaker(values, weight, 2.5), expected, atol=1e-10)


def test_whittaker_leaves_two_values_and_straight_lines_alone():
    two = np.array([[0.0], [5.0]])
    np.testing.assert_array_equal(whittaker(two, np.ones(2), 9.0), two)
    line = np.linspace([0, 0], [3, 4], 12)
    np.testing.assert_allclose(whittaker(line, np.ones(12), 1e3), line, atol=1e-9)


def test_falling_equals_isotonic_regression():
    rng = np.random.default_rng(3)
    for _ in range(20):
        values, weight = rng.normal(size=30) - 0.05 * np.arange(30), rng.random(30) + 0.1
        expected = isotonic_regression(values, weights=weight, increasing=False).x
        np.testing.assert_allclose(falling(values, weight), expected, atol=1e-12)
