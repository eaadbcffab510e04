"""In leaf, only what a branch shows from its foot on is bark; the rest of its radii is propagated."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial import cKDTree

import pipeline
from pipeline.cylinders.bark import shown_bark
from pipeline.cylinders.breast import _bark_shows
from pipeline.geometry.estimates import CYLINDER, MOMENTS, NONE
from pipeline.model import MEASURED, PROPAGATED, PointCloud
from pipeline.synthetic import SampleOptions, TubeTreeOptions, grow_tubes, sample


def shown(evidence, kind=CYLINDER):
    """Nodes shown of a single branch."""
    evidence = np.asarray(evidence, dtype=float)
    axes = SimpleNamespace(first=np.array([0, len(evidence)]))
    windows = SimpleNamespace(kind=np.broadcast_to(kind, len(evidence)), evidence=evidence)
    return shown_bark(axes, windows).tolist()


def test_bark_ends_where_the_evidence_does():
    assert shown([1, 1, 1, 1, 1, 0, 0, 0, 1]) == [True] * 5 + [False] * 4


def test_a_gap_is_bridged_where_what_follows_outweighs_it():
    assert shown([1, 1, 1, 1, 0, 1, 1, 1]) == [True] * 8


def test_now_and_then_a_sleeve_of_leaves_fits_a_cylinder():
    assert not any(shown([0.7, 0.1, 0.6, 0.0, 0.9, 0.3, 0.0, 0.2]))


def test_a_thin_twig_among_leaves_shows_nothing():
    assert not any(shown([1] * 8, kind=MOMENTS))


def test_windows_in_the_parents_wood_count_for_nothing():
    kind = [NONE] * 3 + [CYLINDER] * 5
    assert shown([0, 0, 0, 1, 1, 1, 1, 1], kind) == [False] * 3 + [True] * 5


def axes_and(seen_to):
    """A stem of 3 m, measured from the foot up to a height."""
    height = np.arange(0.0, 3.0, 0.1)
    axes = SimpleNamespace(first=np.array([0, 30]), xyz=np.column_stack([0 * height, 0 * height, height]))
    source = np.where(height <= seen_to, MEASURED, PROPAGATED)
    return axes, SimpleNamespace(radii=SimpleNamespace(source=source))


@pytest.mark.parametrize(("seen_to", "expected"), [(2, True), (1.35, True), (1.0, False), (0.5, False)])
def test_a_ring_is_bark_where_half_of_the_stem_around_it_is_measured(seen_to, expected):
    axes, measured = axes_and(seen_to)
    assert _bark_shows(axes, measured, 0.0) is expected


def curtained(share, seed=1):
    """A stem of 10 cm radius, seen to a share from 0.7 m up, in a curtain of leaves 30 to 55 cm off."""
    rng = np.random.default_rng(seed)
    z, angle = rng.uniform(0, 5, 30000), rng.uniform(0, 2 * np.pi, 30000)
    radius = 0.10 - 0.01 * z
    stem = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
    stem = stem[(z < 0.7) | (rng.random(len(z)) < share)]
    away, turn = rng.uniform(0.3, 0.55, 1000), rng.uniform(0, 2 * np.pi, 1000)
    middle = np.column_stack([away * np.cos(turn), away * np.sin(turn), rng.uniform(0.7, 5.3, 1000)])
    way = rng.normal(size=(2, 1000, 3))
    way /= np.linalg.norm(way, axis=2, keepdims=True)
    spot = rng.uniform(-0.04, 0.04, (2, 30, 1000, 1))
    leaves = (middle + spot[0] * way[0] + 0.5 * spot[1] * way[1]).reshape(-1, 3)
    xyz = np.vstack([stem, leaves])
    return PointCloud(xyz + rng.normal(0, 0.003, xyz.shape), np.zeros(3), None)


@pytest.mark.parametrize("share", [1.0, 0.1])
def test_the_stem_is_found_inside_a_curtain_of_leaves(share):
    trunk = pipeline.reconstruct(curtained(share)).trunk
    assert trunk.source == "measured"
    assert trunk.dbh_m == pytest.approx(0.174, rel=0.02)
    assert trunk.lo_m <= 0.174 <= trunk.hi_m


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_curtain_alone_measures_nothing(seed):
    tree = pipeline.reconstruct(curtained(0.0, seed))
    assert tree.trunk.source == "propagated"
    assert tree.trunk.arc_deg == 0.0
    assert tree.trunk.lo_m <= 0.174 <= tree.trunk.hi_m
    assert tree.trunk.hi_m - tree.trunk.lo_m > 0.3 * tree.trunk.dbh_m
    claimed = tree.radius_source == MEASURED
    in_curtain = tree.skeleton.world[:, 2] > 0.8
    length = tree.skeleton.length
    assert length[claimed & in_curtain].sum() < 0.2 * length[in_curtain].sum()


def along(tree):
    """Axis points every centimetre or so: place, radius and the node that each belongs to."""
    graph = tree.skeleton
    start, end = graph.world[graph.parent[1:]], graph.world[1:]
    count = np.maximum(np.ceil(graph.length[1:] / 0.01), 1).astype(int)
    owner = np.repeat(np.arange(len(count)), count)
    share = (np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[owner]
    radius = (1 - share) * tree.start_radius[1:][owner] + share * tree.radius[1:][owner]
    return start[owner] + share[:, None] * (end - start)[owner], radius, owner + 1


@pytest.mark.parametrize("seed", [3, 4])
def test_leaves_do_not_thicken_the_twigs_that_they_hang_on(seed):
    tree = grow_tubes(TubeTreeOptions(seed=seed, height_m=5.0, trunk_radius_m=0.08))
    wood = sample(tree, options=SampleOptions(seed=seed)).xyz
    rng = np.random.default_rng(seed)
    twig = tree.radius < 0.006
    at = tree.skeleton.xyz[twig][rng.integers(0, twig.sum(), 3000)]
    at = np.repeat(at + rng.normal(0, 0.03, at.shape), 20, axis=0)
    xyz = np.vstack([wood, at + rng.normal(0, 0.015, at.shape)])
    found = pipeline.reconstruct(PointCloud(xyz, np.zeros(3), None))
    assert "leafy" in found.metadata["flags"]
    low, high = found.metadata["volume_interval_l"]
    assert low <= 1000 * tree.volume.sum() <= high
    assert found.volume.sum() == pytest.approx(tree.volume.sum(), rel=0.02)
    axis, radius, _ = along(tree)
    place, model, node = along(found)
    gap, nearest = cKDTree(axis).query(place)
    true = radius[nearest]
    thin, thick = true < 0.006, true > 0.015
    assert np.sqrt(np.mean(model[thin] ** 2) / np.mean(true[thin] ** 2)) == pytest.approx(1.0, abs=0.15)
    claimed = found.radius_source[node] == MEASURED
    assert claimed[thick].mean() > 0.9
    assert claimed[thin].mean() < 0.01
    on_wood = gap[claimed] < np.maximum(1.2 * true[claimed], true[claimed] + 0.01)
    assert np.mean(on_wood & (np.abs(np.log(model[claimed] / true[claimed])) < 0.4)) > 0.97
