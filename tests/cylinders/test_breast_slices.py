"""The slice at breast height is as short as the points allow, and the model passes through it."""

from types import SimpleNamespace

import numpy as np
import pytest

from pipeline.cylinders import breast, fit
from pipeline.cylinders.breast import breast_height, through_breast_height
from pipeline.geometry.axes import Axes
from pipeline.geometry.windows import measure, share_out
from pipeline.model import ALLOMETRIC, MEASURED, PROPAGATED, PointCloud, Skeleton, Trunk

LENGTH, AT = 3.0, 1.3
GROUND = -0.2
"""Everything stands 20 cm below zero, so that height is not z."""


def even(z):
    return np.full_like(z, 0.12)


def tapered(z):
    return 0.15 - 0.04 * z


def swollen(z):
    """A collar a hand above breast height and one a hand below."""
    return np.where((np.abs(z - AT) > 0.055) & (np.abs(z - AT) < 0.1), 0.16, 0.12)


def stem(profile, density, noise, seed=0):
    """Points on an upright stem; the density is per square metre of bark."""
    rng = np.random.default_rng(seed)
    z = rng.uniform(0, LENGTH, rng.poisson(2 * np.pi * 0.12 * LENGTH * density))
    angle, r = rng.uniform(0, 2 * np.pi, len(z)), profile(z)
    xyz = np.column_stack([r * np.cos(angle), r * np.sin(angle), z + GROUND])
    return xyz + rng.normal(0, noise, xyz.shape)


def axes_of(profile):
    z = np.linspace(0, LENGTH, 76)
    xyz = np.column_stack([np.zeros((76, 2)), z + GROUND])
    return Axes(xyz, np.array([0, 76]), np.array([-1]), profile(z) ** 2)


def trunk_of(profile, points, noise, *, believed=None, source=MEASURED, error=0.01):
    """Trunk of a stem whose fitted radii are `believed`, to so many metres."""
    axes = axes_of(believed or profile)
    shared = share_out(points, axes)
    count = len(axes.xyz)
    radii = SimpleNamespace(source=np.full(count, source), error=np.full(count, error))
    measured = SimpleNamespace(
        shared=shared,
        windows=measure(axes, shared, noise, 0.04),
        radii=radii,
        crown=SimpleNamespace(in_leaf=False),
    )
    return breast_height(axes, measured, noise, GROUND)


@pytest.fixture
def slices(monkeypatch):
    """Heights of the slices that are fitted at breast height, in the order in which they are."""
    seen = []
    whole = breast._slice

    def spy(points, *rest):
        seen.append(round(float(np.ptp(points[:, 2])), 2) if len(points) else 0.0)
        return whole(points, *rest)

    monkeypatch.setattr(breast, "_slice", spy)
    return seen


def test_a_sharp_cloud_is_measured_in_the_shortest_slice(slices):
    trunk_of(even, stem(even, 20_000, 0.002), 0.002)
    assert slices == [0.10]


def test_few_noisy_points_take_the_tallest(slices):
    trunk_of(even, stem(even, 1500, 0.015), 0.015)
    assert slices == pytest.approx([0.10, 0.15, 0.20], abs=0.015)


def test_what_lies_outside_the_short_slice_does_not_matter():
    sharp = trunk_of(swollen, stem(swollen, 20_000, 0.001), 0.001, believed=even, error=0.02)
    assert sharp.dbh_m == pytest.approx(0.24, rel=0.005)
    assert sharp.arc_deg == 360.0
    coarse = trunk_of(swollen, stem(swollen, 700, 0.008), 0.008, believed=even, error=0.02)
    assert coarse.dbh_m > 0.243  # a taller slice holds the collars


@pytest.mark.parametrize(("density", "noise"), [(20_000, 0.002), (4000, 0.005), (1500, 0.01)])
def test_a_tapered_stem_is_measured_without_bias(density, noise):
    true = 2 * tapered(AT)
    error = np.array(
        [trunk_of(tapered, stem(tapered, density, noise, s), noise).dbh_m / true - 1 for s in range(25)]
    )
    assert abs(error.mean()) < 0.005
    assert np.abs(error).max() < 0.03


def test_a_fit_that_is_thinner_or_thicker_does_not_sway_sharp_points():
    points = stem(tapered, 20_000, 0.002)
    for factor in (0.9, 1.1):
        trunk = trunk_of(tapered, points, 0.002, believed=lambda z, f=factor: f * tapered(z))
        assert trunk.dbh_m == pytest.approx(2 * tapered(AT), rel=0.01)


@pytest.mark.parametrize(("density", "noise", "width"), [(8000, 0.003, 0.03), (2000, 0.01, 0.06)])
def test_the_interval_holds_the_truth_nine_times_in_ten(density, noise, width):
    true = 2 * tapered(AT)
    trunks = [trunk_of(tapered, stem(tapered, density, noise, s), noise) for s in range(60)]
    assert np.mean([t.lo_m <= true <= t.hi_m for t in trunks]) >= 0.85
    assert all(t.lo_m < t.dbh_m < t.hi_m for t in trunks)
    assert np.median([t.hi_m - t.lo_m for t in trunks]) < width * true


def test_a_stem_without_points_there_is_read_off_the_model():
    points = stem(tapered, 8000, 0.002)
    bare = points[np.abs(points[:, 2] - GROUND - AT) > 0.3]
    trunk = trunk_of(tapered, bare, 0.002, source=PROPAGATED, error=0.0)
    assert trunk.source == "propagated"
    assert trunk.dbh_m == pytest.approx(2 * tapered(AT), rel=0.005)
    assert trunk.arc_deg == 0.0
    assert (trunk.hi_m - trunk.lo_m) / trunk.dbh_m == pytest.approx(2 * 1.645 * 0.3, rel=0.01)
    guess = trunk_of(tapered, bare, 0.002, source=ALLOMETRIC, error=0.0)
    assert guess.source == "allometric"
    assert guess.hi_m / guess.dbh_m == pytest.approx(guess.dbh_m / guess.lo_m)
    assert guess.hi_m > 1.5 * guess.dbh_m


def test_a_slice_of_few_points_is_as_sure_as_the_stem_around_it():
    """Each window of a sparse scan says little, all of them below and above say much."""
    points = stem(even, 40, 0.02)
    sparse = trunk_of(even, points, 0.02, error=0.06)
    assert sparse.source == "propagated"
    assert (sparse.hi_m - sparse.lo_m) / 2.0 == pytest.approx(2 * 1.645 * 0.06 / 2.0)
    sure = trunk_of(even, points, 0.02, error=0.001)
    assert (sure.hi_m - sure.lo_m) / sure.dbh_m == pytest.approx(2 * 1.645 * 0.15)


def test_something_else_at_breast_height_is_not_the_stem():
    """A sign, a nest, a shrub: the stem above and below knows better."""
    points = stem(even, 8000, 0.002)
    wide = np.abs(points[:, 2] - GROUND - AT) < 0.15
    points[wide, :2] *= 1.6
    trunk = trunk_of(even, points, 0.002)
    assert trunk.dbh_m == pytest.approx(0.24, rel=0.01)


def trunk(dbh, source="measured"):
    return Trunk(dbh, 0.9 * dbh if dbh else None, 1.1 * dbh if dbh else None, 360.0, source, GROUND)


def at_breast_height(axes):
    return np.interp(AT + GROUND, axes.xyz[:, 2], axes.radius)


@pytest.mark.parametrize("dbh", [0.15, 0.196, 0.25])
def test_the_stem_is_led_through_the_measured_diameter(dbh):
    axes = through_breast_height(axes_of(tapered), trunk(dbh))
    assert at_breast_height(axes) == pytest.approx(dbh / 2, rel=1e-9)
    assert (np.diff(axes.radius) <= 1e-12).all()
    far = np.abs(2 * tapered(axes.xyz[:, 2] - GROUND) - dbh) > abs(dbh - 2 * tapered(AT)) + 0.01
    np.testing.assert_allclose(axes.square[far], axes_of(tapered).square[far])


@pytest.mark.parametrize(("dbh", "source"), [(0.2, "propagated"), (0.2, "allometric"), (None, None)])
def test_a_diameter_that_was_not_measured_changes_nothing(dbh, source):
    axes = axes_of(tapered)
    assert through_breast_height(axes, trunk(dbh, source)) is axes


@pytest.mark.parametrize(("density", "noise"), [(8000, 0.002), (2000, 0.01)])
def test_the_finished_model_has_the_diameter_that_is_told(density, noise):
    points = stem(tapered, density, noise)
    cloud = PointCloud(points, metadata={"ground_z": GROUND})
    nodes = np.array([[0.01, 0, GROUND], [0, 0.01, 1.0], [0, 0, LENGTH + GROUND]])
    tree = fit(cloud, Skeleton(nodes, [-1, 0, 1], metadata={"ground_z": GROUND}))
    path = tree.skeleton.paths[0]
    radius = np.interp(AT + GROUND, tree.skeleton.xyz[path, 2], tree.radius[path])
    assert tree.trunk.source == "measured"
    assert 2 * radius == pytest.approx(tree.trunk.dbh_m, abs=1e-6)
    assert tree.trunk.dbh_m == pytest.approx(2 * tapered(AT), rel=0.02)
