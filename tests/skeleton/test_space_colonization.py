"""Growth into a cloud: known trees are found, gaps are crossed, and poor clouds are refused or survived."""

from __future__ import annotations

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.spatial import cKDTree

from pipeline.cloud import clean, read_cloud
from pipeline.errors import NotATreeError
from pipeline.model import PointCloud
from pipeline.skeleton import SkeletonOptions, extract
from pipeline.synthetic import read_truth

OPTIONS = SkeletonOptions(method="space-colonization")


def along(start, end, step=0.02):
    """Points every two centimetres along segments."""
    count = np.maximum(1, np.ceil(np.linalg.norm(end - start, axis=1) / step)).astype(int)
    owner = np.repeat(np.arange(len(start)), count)
    number = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    return start[owner] + (end - start)[owner] * ((number + 0.5) / count[owner])[:, None]


def segments(skeleton):
    return along(skeleton.world[skeleton.parent[1:]], skeleton.world[1:])


def line(a, b, count):
    return np.linspace(a, b, count)


def test_an_upright_line_becomes_its_axis():
    skeleton = extract(PointCloud(line([0, 0, 0], [0, 0, 5.0], 101)), options=OPTIONS)
    np.testing.assert_allclose(skeleton.xyz[:, :2], 0, atol=1e-6)
    assert skeleton.order.max() == 0
    assert skeleton.xyz[:, 2].max() == pytest.approx(5.0, abs=0.1)


def test_a_fork_has_two_arms():
    arms = [line([0, 0, 2.0], [x, 0, 4.0], 60) for x in (-1.5, 1.5)]
    skeleton = extract(PointCloud(np.vstack([line([0, 0, 0], [0, 0, 2.0], 60), *arms])), options=OPTIONS)
    points = segments(skeleton)
    for x in (-1.5, 1.5):
        assert np.linalg.norm(points - [x, 0, 4.0], axis=1).min() < 0.15
    assert cKDTree(points).query(np.vstack(arms))[0].max() < 0.2


def test_a_gap_is_crossed():
    cloud = np.vstack([line([0, 0, 0], [0, 0, 3.0], 61), line([0, 0, 4.2], [0, 0, 6.0], 37)])
    skeleton = extract(PointCloud(cloud), options=OPTIONS)
    assert skeleton.xyz[:, 2].max() > 5.8
    assert skeleton.metadata["unused"] < 0.1


def test_the_method_is_named():
    metadata = extract(PointCloud(line([0, 0, 0], [0, 0, 5.0], 101)), options=OPTIONS).metadata
    assert metadata["method"] == "space-colonization"
    assert metadata["stop_reason"] in {"exhausted", "stalled", "out_of_reach"}


def test_a_known_tree_from_the_air(shared_data):
    cloud = clean(read_cloud(shared_data / "truth" / "syn_A_als.laz"))
    truth = read_truth(shared_data / "truth" / "syn_A.truth.npz")
    skeleton = extract(cloud, options=OPTIONS)
    found = segments(skeleton)
    thick = truth.r > 0.02
    away = cKDTree(found).query(along(truth.s[thick], truth.e[thick]))[0]
    assert np.median(away) < 0.05
    astray = cKDTree(along(truth.s, truth.e)).query(found)[0]
    assert np.median(astray) < 0.05
    assert skeleton.metadata["unused"] < 0.15


def test_a_real_crown_is_reached_everywhere(shared_data):
    cloud = clean(read_cloud(shared_data / "trees" / "ahn4_121913_487434.las"))
    skeleton = extract(cloud, options=OPTIONS)
    away = cKDTree(segments(skeleton)).query(cloud.world)[0]
    assert np.median(away) < 0.15
    assert np.quantile(away, 0.99) < 1.0
    assert extract(cloud, options=OPTIONS).xyz.tobytes() == skeleton.xyz.tobytes()


@pytest.mark.parametrize("points", [np.zeros((1, 3)), np.zeros((5, 3))])
def test_too_few_points_are_refused(points):
    with pytest.raises(NotATreeError, match="one place"):
        extract(PointCloud(points), options=OPTIONS)


@pytest.mark.parametrize("kill", [2.5, 4.0])
def test_kill_at_or_above_influence_is_refused(kill):
    with pytest.raises(ValidationError, match=r"not below colony_influence 2\.5"):
        SkeletonOptions(method="space-colonization", colony_kill=kill)
