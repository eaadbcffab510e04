"""Which method `auto` chooses, and what it says of it."""

from __future__ import annotations

import numpy as np
import pytest

from pipeline.cloud import clean, read_cloud
from pipeline.errors import NotATreeError
from pipeline.model import PointCloud
from pipeline.skeleton import METHODS, SkeletonOptions, extract
from pipeline.skeleton.extraction import CLOSE_M, _choose


def pole(apart_m, *, even=False, low=True, metadata=None):
    """A pole 8 m high and 0.8 m thick; points are strewn over its bark, or evenly."""
    area = 2 * np.pi * 0.4 * 8
    if even:
        way, z = np.meshgrid(np.arange(0, 2 * np.pi * 0.4, apart_m), np.arange(0, 8, apart_m))
    else:  # the median distance of strewn points is 0.47 of the root of their area
        count = int(area * (0.47 / apart_m) ** 2)
        way, z = np.random.default_rng(1).uniform(size=(2, count)) * [[2 * np.pi * 0.4], [8]]
    way, z = way.ravel() / 0.4, z.ravel()
    xyz = np.column_stack([0.4 * np.cos(way), 0.4 * np.sin(way), z])
    return PointCloud(xyz if low else xyz[z > 2], metadata={"ground_z": 0.0, **(metadata or {})})


@pytest.mark.parametrize(
    ("apart_m", "even", "method"),
    [
        (0.02, False, "geodesic"),
        (0.04, False, "geodesic"),
        (0.055, False, "greedy"),
        (0.055, True, "geodesic"),  # thinned to a raster, points lie four times as dense
        (0.09, False, "greedy"),
        (0.09, True, "greedy"),
    ],
)
def test_the_spacing_decides(apart_m, even, method):
    name, reason = _choose(pole(apart_m, even=even))
    assert name == method
    assert reason.startswith("dense: points every" if method == "geodesic" else "sparse: points every")
    assert ("evenly thinned" in reason) is (even and method == "geodesic")


def test_the_spacing_that_cleaning_found_is_believed():
    cloud = pole(0.02, metadata={"spacing_m": 0.2})
    assert _choose(cloud) == ("greedy", "sparse: points every 200 mm, too few to show surfaces")


def test_leaves_and_a_hidden_trunk_are_told():
    seen = {"dropped": {"leaf": 3 * len(pole(0.03))}}
    assert _choose(pole(0.03, metadata=seen))[1].endswith("; 75% of the points were leaves")
    assert _choose(pole(0.1, low=False))[1].endswith("; points on the lower trunk: 0")
    assert "trunk" not in _choose(pole(0.1))[1]


@pytest.mark.parametrize("count", [1, 2, 5])
def test_a_few_points_are_no_trouble(count):
    xyz = np.column_stack([np.zeros((count, 2)), 0.06 * np.arange(count)])
    assert _choose(PointCloud(xyz))[0] in METHODS


def test_the_order_of_points_and_a_turn_make_no_difference():
    cloud = pole(0.055)
    turned = cloud.xyz[::-1] @ np.array([[0.6, 0.8, 0], [-0.8, 0.6, 0], [0, 0, 1]])
    assert _choose(PointCloud(turned, metadata=dict(cloud.metadata))) == _choose(cloud)


def test_the_reason_travels_with_the_skeleton():
    cloud = clean(pole(0.15))
    skeleton = extract(cloud)
    assert skeleton.metadata["method"] == "greedy"
    assert skeleton.metadata["method_reason"] == _choose(cloud)[1]
    asked = extract(cloud, options=SkeletonOptions(method="mst"))
    assert (asked.metadata["method"], asked.metadata["method_reason"]) == ("mst", "asked for")


def test_what_a_method_says_of_itself_reaches_the_report():
    cloud = clean(pole(0.3))
    options = SkeletonOptions(method="minimal-length", most_leaves=30)
    known = extract(cloud, options=options).metadata
    assert "method_note" not in known
    figures = known["minimal_length"]
    assert known["method_reason"].startswith(f"asked for; {figures['leaves']} leaves, ")
    assert (
        f"{figures['branches_m']:.1f} m of branches, proven least; length over bound 1.00"
        in known["method_reason"]
    )
    quick = extract(cloud, options=options.model_copy(update={"exact_leaves": 0})).metadata
    assert f"the least is {quick['minimal_length']['bound_m']:.1f} m or more" in quick["method_reason"]


def test_no_points_are_no_tree():
    with pytest.raises(NotATreeError, match="no points"):
        extract(PointCloud(np.zeros((0, 3))))


@pytest.mark.parametrize(
    ("name", "method"),
    [
        ("truth/syn_A_clean.laz", "geodesic"),
        ("truth/syn_A_als.laz", "greedy"),
        ("trees/archi_tree1.las", "geodesic"),  # thinned to 5 cm: all of its bark shows
        ("trees/Lille_2.xyz", "greedy"),  # strewn, 6 cm apart
    ],
)
def test_known_clouds(shared_data, name, method):
    assert _choose(clean(read_cloud(shared_data / name)))[0] == method


def test_beyond_the_limit_greedy_finds_more_and_more_exactly():
    """The figures behind the limit, in small: a known tree whose points lie half as far again apart."""
    from pipeline.accuracy import compare
    from pipeline.synthetic import SampleOptions, TubeTreeOptions, grow_tubes, sample

    tree = grow_tubes(TubeTreeOptions(seed=2, height_m=6.0))
    cloud = clean(sample(tree, options=SampleOptions(density_per_m2=0.47**2 / (1.5 * CLOSE_M) ** 2)))
    assert cloud.metadata["spacing_m"] > CLOSE_M
    found = {m: compare(extract(cloud, options=SkeletonOptions(method=m)), tree.skeleton) for m in METHODS}
    assert found["greedy"].recall > found["geodesic"].recall
    assert found["greedy"].precision > found["geodesic"].precision
