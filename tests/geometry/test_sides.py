"""Which side was seen is learnt from thick bark, and thin twigs are completed by it."""

import numpy as np
import pytest

from pipeline.geometry.axes import Axes
from pipeline.geometry.estimates import CYLINDER, MOMENTS
from pipeline.geometry.sides import HALF_RING, LEAST, complete, seen_from
from pipeline.geometry.windows import Windows, measure, share_out

NOISE = 0.004
SIDE = np.array([HALF_RING, 0.0, 0.0])


def tube(radius, arc_deg, noise, count, *, seed=0, length=2.0, facing_deg=0.0):
    """Points on an upright tube, of which an arc about a direction is seen."""
    rng = np.random.default_rng(seed)
    angle = np.radians(facing_deg + rng.uniform(-arc_deg / 2, arc_deg / 2, count))
    xyz = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), rng.uniform(0, length, count)])
    return xyz + rng.normal(0, noise, (count, 3))


def upright(radius, length=2.0, step=0.04):
    z = np.arange(0.0, length + 1e-9, step)
    xyz = np.column_stack([np.zeros((len(z), 2)), z])
    return Axes(xyz, np.array([0, len(z)]), np.array([-1]), np.full(len(z), radius**2))


def measured(radius, xyz, noise):
    axes = upright(radius)
    return axes, measure(axes, share_out(xyz, axes), noise, 0.1)


def thick(count, facing, /, **other):
    """Windows of sound bark, all facing one way, some of it changed."""
    given = {
        "kind": np.full(count, CYLINDER),
        "shift": np.zeros((count, 3)),
        "square": np.full(count, 0.01),
        "variance": np.full(count, 1e-6),
        "centre_variance": np.full(count, 1e-6),
        "count": np.full(count, 100),
        "spread": np.full(count, 0.002),
        "arc": np.full(count, 6.0),
        "evidence": np.ones(count),
        "facing": np.tile(np.asarray(facing, float), (count, 1)),
    }
    return Windows(**(given | other))


@pytest.mark.parametrize("facing_deg", [0.0, 120.0, 250.0])
def test_bark_seen_from_one_side_tells_the_side(facing_deg):
    _, windows = measured(0.1, tube(0.1, 180, 0.003, 4000, facing_deg=facing_deg), 0.003)
    towards = seen_from(windows, 0.003)
    at = np.radians(facing_deg)
    np.testing.assert_allclose(towards, HALF_RING * np.array([np.cos(at), np.sin(at), 0.0]), atol=0.04)


def test_bark_seen_all_round_tells_no_side():
    _, windows = measured(0.1, tube(0.1, 360, 0.003, 8000), 0.003)
    assert np.linalg.norm(seen_from(windows, 0.003)) < 0.03


def test_no_side_is_more_than_half_a_ring():
    np.testing.assert_allclose(seen_from(thick(9, [0.0, 0.9, 0.0]), 0.002), [0.0, HALF_RING, 0.0])
    np.testing.assert_allclose(seen_from(thick(9, [0.0, 0.3, 0.0]), 0.002), [0.0, 0.3, 0.0])


@pytest.mark.parametrize(
    "unfit",
    [
        {"kind": np.full(9, MOMENTS)},
        {"count": np.full(9, 29)},
        {"evidence": np.full(9, 0.5)},
        {"square": np.full(9, (5 * 0.002) ** 2)},
    ],
)
def test_thin_dubious_and_sparse_windows_are_not_asked(unfit):
    assert seen_from(thick(9, [0.5, 0, 0], **unfit), 0.002).tolist() == [0, 0, 0]


def test_it_takes_some_windows_to_know():
    assert seen_from(thick(LEAST - 1, [0.5, 0, 0]), 0.002).tolist() == [0, 0, 0]
    assert seen_from(thick(LEAST, [0.5, 0, 0]), 0.002).tolist() == [0.5, 0, 0]


@pytest.fixture(scope="module")
def twig():
    """Half a ring of a twig of 8 mm, seen with 4 mm noise, many times over."""
    axes, windows = measured(0.008, tube(0.008, 180, NOISE, 6000), NOISE)
    assert (windows.kind == MOMENTS).mean() > 0.9
    return axes, windows


def test_half_a_twig_is_completed(twig):
    axes, windows = twig
    thin = windows.kind == MOMENTS
    whole = complete(windows, axes, SIDE)
    assert np.median(windows.square[thin]) < 0.75 * 0.008**2  # as if it were slimmer
    assert np.median(whole.square[thin]) == pytest.approx(0.008**2, rel=0.10)
    assert (whole.variance[thin] > windows.variance[thin]).all()


def test_the_axis_lies_behind_the_middle_of_half_a_ring(twig):
    axes, windows = twig
    thin = windows.kind == MOMENTS
    whole = complete(windows, axes, SIDE)
    assert windows.shift[thin, 0].mean() == pytest.approx(HALF_RING * 0.008, rel=0.1)
    assert np.abs(whole.shift[thin].mean(axis=0)).max() < 0.0007


def test_a_twig_that_points_at_the_scanner_stays_where_it_is(twig):
    axes, windows = twig
    np.testing.assert_allclose(complete(windows, axes, SIDE[::-1]).shift, windows.shift, atol=1e-12)


def test_fitted_cylinders_and_trees_seen_all_round_stay_as_they_are(twig):
    axes, windows = twig
    before = thick(len(axes.xyz), SIDE)
    after = complete(before, axes, SIDE)
    for name in ("square", "variance", "shift"):
        np.testing.assert_array_equal(getattr(after, name), getattr(before, name))
        same = getattr(complete(windows, axes, np.zeros(3)), name)
        np.testing.assert_array_equal(same, getattr(windows, name))
