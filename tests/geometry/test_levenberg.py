"""Levenberg-Marquardt cylinders on points whose cylinder is known."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.geometry import levenberg


def arc_points(radius, arc_deg, noise, count=200, seed=0):
    rng = np.random.default_rng(seed)
    angle = np.radians(rng.uniform(-arc_deg / 2, arc_deg / 2, count))
    r = radius + rng.normal(0, noise, count)
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), rng.uniform(-0.1, 0.1, count)])


def fitted(points, guess, noise=0.001):
    prior = np.array([1 / guess, 1 / guess, 8.0, 8.0, 1 / guess])
    start = np.array([0.0, 0.0, 0.0, 0.0, guess])
    return levenberg.fit_cylinder(points, start, prior, noise)


def test_the_jacobian_is_exact():
    points = arc_points(0.2, 300, 0.02, 30)
    theta = np.array([0.01, -0.02, 0.05, 0.03, 0.18])
    here, jacobian = np.empty(30), np.empty((30, 5))
    levenberg._distances(points, theta, here, jacobian)
    for k in range(5):
        ahead, behind, unused = np.empty(30), np.empty(30), np.empty((30, 5))
        step = np.zeros(5)
        step[k] = 1e-6
        levenberg._distances(points, theta + step, ahead, unused)
        levenberg._distances(points, theta - step, behind, unused)
        np.testing.assert_allclose(jacobian[:, k], (ahead - behind) / 2e-6, atol=1e-7)


@pytest.mark.parametrize(("arc", "within"), [(360, 0.005), (270, 0.01), (180, 0.03), (90, 0.08)])
def test_the_radius_of_an_arc(arc, within):
    errors = [
        abs(fitted(arc_points(0.3, arc, 0.003, seed=s) - [0.05, 0, 0], 0.25, 0.003)[0][4] / 0.3 - 1)
        for s in range(10)
    ]
    assert np.max(errors) <= within


def test_the_standard_error_tells_the_spread():
    results = [fitted(arc_points(0.15, 200, 0.004, 80, s), 0.15, 0.004) for s in range(200)]
    radius = np.array([theta[4] for theta, _, _, _ in results])
    claimed = np.array([0.004 * np.sqrt(cov[4, 4]) for _, cov, _, _ in results])
    assert radius.std() == pytest.approx(claimed.mean(), rel=0.3)


def test_a_twig_touching_the_stem_does_not_move_it():
    stem = arc_points(0.2, 360, 0.002)
    twig = np.column_stack([np.linspace(0.2, 0.6, 30), np.zeros(30), np.zeros(30)])
    theta = fitted(np.vstack([stem, twig]), 0.2, 0.002)[0]
    assert theta[4] == pytest.approx(0.2, rel=0.01)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 1000))
def test_scale_does_not_matter(seed):
    points = arc_points(0.2, 250, 0.004, 60, seed)
    small = fitted(points, 0.2, 0.004)[0][4]
    large = fitted(points * 10, 2.0, 0.04)
    assert large[0][4] == pytest.approx(10 * small, rel=2e-3)


def test_the_compiled_kernel_equals_its_python_twin():
    points = arc_points(0.2, 250, 0.004, 60, 3)
    prior, start = np.full(5, 4.0), np.array([0.0, 0, 0, 0, 0.2])
    compiled = levenberg.fit_cylinder(points, start, prior, 0.002)
    plain = levenberg.fit_cylinder.py_func(points, start, prior, 0.002)
    np.testing.assert_allclose(compiled[0], plain[0], rtol=1e-9, atol=1e-12)


def test_a_system_that_is_not_positive_is_reported():
    assert not levenberg.solve(np.zeros((2, 2)), np.ones(2))[1]
    x, good = levenberg.solve(np.array([[4.0, 2], [2, 3]]), np.array([2.0, 5]))
    assert good
    np.testing.assert_allclose(x, [-0.5, 2.0])
