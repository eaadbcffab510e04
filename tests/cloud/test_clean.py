"""Cleaning: the order of the rows does not matter, what does not belong goes, the tree stays."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from pipeline.cloud import CleanOptions, clean
from pipeline.errors import InputFormatError, NotATreeError
from pipeline.model import PointCloud

HEIGHT_M = 6.0


def a_tree(seed: int = 1, points: int = 4000) -> np.ndarray:
    """Points of a stem of 15 cm radius that stands at (0, 0, 0) and a round crown of 1.5 m at 5 m."""
    rng = np.random.default_rng(seed)
    angle, z = rng.uniform(0, 2 * np.pi, points), rng.uniform(0, HEIGHT_M, points)
    radius = 0.15 * (1 - 0.8 * z / HEIGHT_M)
    stem = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), z])
    way = rng.normal(size=(points, 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    return np.concatenate([stem, way * 1.5 * np.sqrt(rng.uniform(0.05, 1, (points, 1))) + [0, 0, 5]])


def a_patch(
    slope_deg: float, *, noise_m: float = 0.01, points: int = 4000, side_m: float = 3.0
) -> np.ndarray:
    rng = np.random.default_rng(7)
    plan = rng.uniform(-side_m / 2, side_m / 2, (points, 2)) + [0.4, 0.3]
    height = np.tan(np.radians(slope_deg)) * plan[:, 0] + rng.normal(0, noise_m, points)
    return np.column_stack([plan, height])


def cleaned(xyz: np.ndarray, **options: float) -> PointCloud:
    """Clean a tree whose crown is a ball of points: leaves, if anyone asked."""
    return clean(PointCloud(xyz), options=CleanOptions(leaves="keep", **options))


def total(cloud: PointCloud) -> int:
    return int(sum(cloud.metadata["dropped"].values()) + cloud.metadata["points_used"])


# -- order and place ---------------------------------------------------------------------------


@settings(max_examples=8)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_order_of_the_rows_does_not_matter(seed: int) -> None:
    xyz = np.concatenate([a_tree(points=600), a_patch(10, points=600), a_tree(points=600)[:50]])
    marks = np.arange(len(xyz)) % 5
    order = np.random.default_rng(seed).permutation(len(xyz))
    one = clean(PointCloud(xyz, attributes={"intensity": marks}))
    two = clean(PointCloud(xyz[order], attributes={"intensity": marks[order]}))
    assert one.xyz.tobytes() == two.xyz.tobytes()
    assert one.attributes["intensity"].tobytes() == two.attributes["intensity"].tobytes()
    assert dict(one.metadata) == dict(two.metadata)


def test_a_cloud_100_km_away_is_cleaned_alike() -> None:
    xyz = np.round(np.concatenate([a_tree(), a_patch(15)]), 3)
    move = np.array([1e5, -1e5, 1e5])
    here, there = cleaned(xyz), cleaned(xyz + move)
    assert here.metadata["dropped"] == there.metadata["dropped"]
    assert np.allclose(here.xyz + move, there.xyz, atol=2e-5, rtol=0)
    assert there.metadata["ground_z"] == pytest.approx(here.metadata["ground_z"] + 1e5, abs=1e-6)


def test_what_a_cloud_is_stays() -> None:
    cloud = PointCloud(a_tree(), np.array([1.0, 2, 3]), "EPSG:28992", metadata={"crs_assumed": True})
    result = clean(cloud, options=CleanOptions(leaves="keep"))
    assert result.crs == "EPSG:28992"
    assert result.origin.tolist() == [1, 2, 3]
    assert result.metadata["flags"] == ("crs_assumed", "no_ground")


# -- what is dropped ---------------------------------------------------------------------------


def test_a_clean_tree_loses_almost_nothing() -> None:
    tree = cleaned(a_tree())
    assert tree.metadata["dropped"]["outlier"] < 0.01 * 8000
    assert {k for k, v in tree.metadata["dropped"].items() if v} <= {"outlier", "voxel"}
    assert tree.metadata["ground_z"] == pytest.approx(0, abs=0.02)
    assert tree.metadata["ground_source"] == "lowest"
    assert tree.metadata["top_z"] == tree.xyz[:, 2].max()
    assert tree.metadata["crown_area_m2"] == pytest.approx(np.pi * 1.5**2, rel=0.1)


def test_repeated_and_invalid_points_are_counted() -> None:
    xyz = a_tree()
    bad = np.array([[np.nan, 0, 0], [0, np.inf, 0], [1e38, 1e38, 1e38]])
    tree = cleaned(np.concatenate([xyz, xyz[:30], bad]))
    assert tree.metadata["dropped"]["duplicate"] == 30
    assert tree.metadata["dropped"]["invalid"] == 3
    assert tree.metadata["points_in"] == total(tree) == len(xyz) + 33


@pytest.mark.parametrize("depth", [0.3, 2.0])
def test_a_lone_low_point_goes(depth: float) -> None:
    tree = cleaned(np.concatenate([a_tree(), [[0.05, 0, -depth]]]))
    assert tree.xyz[:, 2].min() > -0.01
    assert tree.metadata["ground_z"] == pytest.approx(0, abs=0.02)


def test_a_zero_point_among_national_coordinates_goes() -> None:
    tree = cleaned(np.concatenate([a_tree() + [1e5, 4.5e5, 0], [[0.0, 0, 0]]]))
    assert tree.metadata["points_used"] == cleaned(a_tree() + [1e5, 4.5e5, 0]).metadata["points_used"]


def test_classes_say_what_is_noise_building_and_ground() -> None:
    xyz = np.concatenate([a_tree(), a_patch(0), [[0, 0, 500.0]] * 3, [[1, 1, 3.0]] * 4])
    classes = np.repeat([0, 2, 7, 6], [8000, 4000, 3, 4]).astype(np.uint8)
    soil = PointCloud(xyz, attributes={"classification": classes})
    tree = clean(soil, options=CleanOptions(leaves="keep"))
    assert tree.metadata["flags"] == ("noise_class",)
    assert tree.metadata["dropped"]["clump"] == 4
    assert tree.metadata["dropped"]["outlier"] >= 3
    assert tree.metadata["ground_source"] == "class"
    assert tree.metadata["ground_z"] == pytest.approx(0, abs=0.01)
    assert set(tree.attributes["classification"]) == {0}


def test_withheld_points_go() -> None:
    withheld = np.zeros(8000, dtype=bool)
    withheld[:100] = True
    tree = clean(PointCloud(a_tree(), attributes={"withheld": withheld}))
    assert not tree.attributes["withheld"].any()
    assert "noise_class" in tree.metadata["flags"]


def test_a_far_clump_goes_and_a_near_twig_stays() -> None:
    rng = np.random.default_rng(3)
    far = rng.normal(0, 0.05, (60, 3)) + [6, 0, 4]
    near = rng.normal(0, 0.05, (60, 3)) + [2.2, 0, 5]
    tree = cleaned(np.concatenate([a_tree(), far, near]))
    assert tree.metadata["dropped"]["clump"] == 60
    assert tree.xyz[:, 0].max() < 3
    assert (tree.xyz[:, 0] > 1.9).sum() >= 50


def test_a_large_part_that_hangs_free_is_kept_and_flagged() -> None:
    xyz = a_tree()
    gap = xyz[(xyz[:, 2] < 1.5) | (xyz[:, 2] > 3.0)]
    tree = cleaned(gap)
    assert tree.metadata["dropped"]["clump"] == 0
    assert "floating_parts" in tree.metadata["flags"]


def test_a_second_tree_goes_and_is_flagged() -> None:
    tree = cleaned(np.concatenate([a_tree(), a_tree(2, 2500) + [5, 0, 0]]))
    assert "several_stems" in tree.metadata["flags"]
    assert tree.xyz[:, 0].max() < 2
    assert tree.metadata["dropped"]["clump"] > 4900


def test_cells_double_until_few_enough_points_are_left() -> None:
    tree = cleaned(a_tree(), max_points=1500)
    assert 300 < len(tree) <= 1500
    assert total(tree) == 8000


# -- the ground --------------------------------------------------------------------------------


@pytest.mark.parametrize("slope_deg", [0, 15, 20])
@pytest.mark.parametrize("noise_m", [0.003, 0.02])
def test_a_patch_of_ground_is_found(slope_deg: float, noise_m: float) -> None:
    tree = cleaned(np.concatenate([a_tree(), a_patch(slope_deg, noise_m=noise_m)]))
    assert tree.metadata["ground_source"] == "found"
    assert tree.metadata["flags"] == ()
    assert tree.metadata["ground_z"] == pytest.approx(0, abs=0.03)
    assert 3900 <= tree.metadata["dropped"]["ground"] <= 4100
    stem = (np.hypot(tree.xyz[:, 0], tree.xyz[:, 1]) < 0.2) & (tree.xyz[:, 2] > 0.15) & (tree.xyz[:, 2] < 1)
    assert stem.sum() > 500


def test_no_ground_is_found_where_none_may_be() -> None:
    xyz = np.concatenate([a_tree(), a_patch(0)])
    assert cleaned(xyz, find_ground=False).metadata["ground_source"] == "lowest"


def test_ground_of_a_file_is_used_from_its_own_origin() -> None:
    origin = np.array([50.0, 60, 7])
    soil = PointCloud(a_patch(15, side_m=8) + [0, 0, -0.5] - origin, origin)
    tree = clean(PointCloud(a_tree()), soil)
    assert tree.metadata["ground_source"] == "file"
    assert tree.metadata["ground_z"] == pytest.approx(-0.5, abs=0.03)


def test_ground_of_a_file_counts_before_that_of_the_classes() -> None:
    xyz = np.concatenate([a_tree(), a_patch(0)])
    classes = np.repeat([0, 2], [8000, 4000]).astype(np.uint8)
    cloud = PointCloud(xyz, attributes={"classification": classes})
    plain = clean(cloud, options=CleanOptions(leaves="keep"))
    tree = clean(cloud, PointCloud(a_patch(0) + [0, 0, -0.3]), options=CleanOptions(leaves="keep"))
    assert (plain.metadata["ground_source"], tree.metadata["ground_source"]) == ("class", "file")
    assert tree.metadata["ground_z"] == pytest.approx(-0.3, abs=0.02)
    assert tree.metadata["dropped"]["ground"] >= 4000  # the classes still say what is no tree
    assert set(tree.attributes["classification"]) == {0}


def test_ground_of_another_place_is_refused() -> None:
    with pytest.raises(InputFormatError, match="same reference system"):
        clean(PointCloud(a_tree()), PointCloud(a_patch(0) + [1000, 0, 0]))


# -- what is no tree ---------------------------------------------------------------------------

RAMP = np.linspace(0, 5, 50)


@pytest.mark.parametrize(
    ("xyz", "text"),
    [
        (np.zeros((0, 3)), "0 points usable of 0.*at least 10"),
        (np.eye(3), "3 points usable of 3"),
        (np.full((50, 3), 2.0), "50 points come down to one place"),
        (np.column_stack([RAMP, RAMP, RAMP]), "on one line.*give a scan"),
        (np.column_stack([RAMP, RAMP % 1.7, 0 * RAMP]), "in one plane"),
        (np.random.default_rng(0).uniform(0, 150, (5000, 3)), "150 m.*`treepipe batch`"),
    ],
)
def test_what_is_no_tree_is_said(xyz: np.ndarray, text: str) -> None:
    with pytest.raises(NotATreeError, match=text):
        clean(PointCloud(xyz, metadata={"source": {"path": "a.xyz"}}))


def test_nothing_but_ground_says_so() -> None:
    with pytest.raises(NotATreeError, match=r"usable of 4000 \(.*\d+ ground.*\)"):
        clean(PointCloud(a_patch(5)))


def test_the_error_names_the_file() -> None:
    with pytest.raises(NotATreeError, match=r"^a\.xyz: "):
        clean(PointCloud(np.eye(3), metadata={"source": {"path": "a.xyz"}}))


def test_options_are_checked() -> None:
    with pytest.raises(ValidationError, match="voxel_m"):
        CleanOptions(voxel_m=0)


# -- leaves ------------------------------------------------------------------------------------


def test_leaves_are_dropped_where_the_crown_is_in_leaf() -> None:
    """A ball of points over a stem is foliage: the stem stays, and height and crown are the whole tree's."""
    xyz = a_tree()
    bare, whole = clean(PointCloud(xyz)), cleaned(xyz)
    assert "leafy" in bare.metadata["flags"]
    assert bare.metadata["dropped"]["leaf"] > 0.3 * len(xyz)
    assert total(bare) == len(xyz)
    for key in ("top_z", "ground_z", "crown_area_m2"):
        assert bare.metadata[key] == whole.metadata[key]
    stem = np.hypot(bare.xyz[:, 0], bare.xyz[:, 1]) < 0.2
    low = bare.xyz[:, 2] < 2
    assert (stem & low).sum() > 0.98 * (np.hypot(*whole.xyz[whole.xyz[:, 2] < 2, :2].T) < 0.2).sum()
    assert cleaned(xyz).metadata["dropped"]["leaf"] == 0


def test_leaves_can_be_dropped_on_request() -> None:
    xyz = a_tree()
    asked = clean(PointCloud(xyz), options=CleanOptions(leaves="drop"))
    assert asked.metadata["dropped"]["leaf"] > 0
