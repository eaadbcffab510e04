"""The range noise is read off bark to some percents, and nothing makes it jump."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from pipeline.geometry.axes import Axes
from pipeline.geometry.estimates import CYLINDER, MOMENTS
from pipeline.geometry.noise import BARK, LEAST_M, MOST_M, NOISE, range_noise
from pipeline.geometry.windows import Windows, measure, share_out

RADIUS, LENGTH = 0.12, 4.0
GUESS = 0.002


def stem_windows(noise, believed, seed=0, rough=0.0):
    """Windows along a stem of known noise, measured as if it were `believed`."""
    rng = np.random.default_rng(seed)
    count = 16_000
    angle, z = rng.uniform(0, 2 * np.pi, count), rng.uniform(0, LENGTH, count)
    r = RADIUS + rough * np.sin(7 * angle) * (np.sin(9 * z) > 0)
    xyz = np.column_stack([r * np.cos(angle), r * np.sin(angle), z]) + rng.normal(0, noise, (count, 3))
    nodes = np.linspace(0.05, LENGTH - 0.05, 97)
    line = np.column_stack([np.zeros((97, 2)), nodes])
    axes = Axes(line, np.array([0, 97]), np.array([-1]), np.full(97, RADIUS**2))
    return measure(axes, share_out(xyz, axes), believed, 0.04)


def windows_of(spread, **other):
    """Sound windows with these misfits."""
    count = len(spread)
    given = {
        "kind": np.full(count, CYLINDER),
        "shift": np.zeros((count, 3)),
        "square": np.full(count, 0.01),
        "variance": np.full(count, 1e-6),
        "centre_variance": np.full(count, 1e-6),
        "count": np.full(count, 100),
        "spread": np.asarray(spread, dtype=float),
        "arc": np.full(count, 6.0),
        "evidence": np.ones(count),
        "facing": np.zeros((count, 3)),
    }
    return Windows(**(given | other))


@pytest.mark.parametrize("noise", [0.002, 0.005, 0.010])
def test_the_noise_of_a_stem(noise):
    found = GUESS
    for _ in range(3):  # as the fit does: what is found is believed in the next round
        found = range_noise(stem_windows(noise, found), found)
    assert found == pytest.approx(noise, rel=0.05)


def test_rough_bark_is_not_noise():
    windows = stem_windows(0.002, GUESS, rough=0.012)
    assert np.median(windows.spread) > 0.0028
    assert range_noise(windows, GUESS) < 0.0026


def quartile_ratio(spread):
    return spread * norm.ppf(0.75) * 2


def misfits(width, count=80):
    """Log-normal misfits about 4 mm, the same ones for every width."""
    return 0.004 * np.exp(width * norm.ppf((np.arange(count) + 0.5) / count))


def test_nothing_jumps_where_misfits_begin_to_look_like_bark():
    widths = np.linspace(0.2, 0.9, 1401)
    ratio = np.exp(quartile_ratio(widths))
    assert ratio[0] < NOISE < BARK < ratio[-1]
    found = np.array([range_noise(windows_of(misfits(w)), GUESS) for w in widths])
    assert np.abs(np.diff(found)).max() < 0.005 * 0.004
    assert found[0] == pytest.approx(0.004, rel=1e-3)  # the median, where noise alone explains them
    lower = 0.004 * np.exp(-widths[-1] * norm.ppf(0.75))
    assert found[-1] == pytest.approx(lower, rel=0.02)  # the lower quartile, of rough bark


def test_one_window_more_or_less_hardly_matters():
    rng = np.random.default_rng(5)
    spread = misfits(0.5) * rng.uniform(0.99, 1.01, 80)
    windows = windows_of(spread)
    whole = range_noise(windows, GUESS)
    for left_out in range(80):
        kept = np.arange(80) != left_out
        assert range_noise(windows, GUESS, kept) == pytest.approx(whole, rel=0.04)


def test_a_weight_that_fades_makes_no_jump_either():
    """A window may leave by losing its evidence, a little at a time."""
    spread = np.concatenate([np.full(10, 0.003), np.linspace(0.003, 0.008, 10)])
    found = []
    for evidence in np.linspace(1.0, 0.0, 1001):
        sure = np.concatenate([np.ones(10), np.full(10, evidence)])
        found.append(range_noise(windows_of(spread, evidence=sure), GUESS))
    assert np.abs(np.diff(found)).max() < 0.02 * 0.003
    assert found[-1] == pytest.approx(0.003)


def test_thick_stems_say_more_than_twigs():
    spread = np.concatenate([np.full(10, 0.002), np.full(40, 0.006)])
    square = np.concatenate([np.full(10, 0.04), np.full(40, 0.0004)])
    assert range_noise(windows_of(spread, square=square), GUESS) == pytest.approx(0.002, rel=0.01)


@pytest.mark.parametrize("unfit", [{"kind": MOMENTS}, {"count": 14}, {"arc": 2.0}, {"evidence": 0.0}])
def test_windows_that_show_no_bark_are_not_asked(unfit):
    windows = windows_of(np.full(20, 0.006))
    other = {name: np.full(20, value) for name, value in unfit.items()}
    assert range_noise(windows, GUESS) == pytest.approx(0.006)
    assert range_noise(replace(windows, **other), GUESS) == GUESS


def test_four_windows_are_too_few_and_noise_has_its_bounds():
    assert range_noise(windows_of(np.full(4, 0.006)), GUESS) == GUESS
    assert range_noise(windows_of(np.full(5, 0.006)), GUESS) == pytest.approx(0.006)
    assert range_noise(windows_of(np.full(5, 0.1)), GUESS) == MOST_M
    assert range_noise(windows_of(np.full(5, 1e-6)), GUESS) == LEAST_M
