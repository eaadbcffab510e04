"""The greedy skeleton of sparse clouds: the stem by circles, the growth from point to point."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.cloud import clean, read_cloud
from pipeline.errors import NotATreeError
from pipeline.model import PointCloud, Skeleton, TreeModel
from pipeline.skeleton import greedy, joining, rings
from pipeline.skeleton.greedy import GreedyOptions, by_greedy
from pipeline.skeleton.stem import find_stem
from pipeline.synthetic import SampleOptions, TubeTreeOptions, grow_tubes, sample

Floats = NDArray[np.float64]
BREAST_M = 1.3
HALF_M = 0.05  # as near counts as found


@pytest.fixture(scope="module")
def grown() -> TreeModel:
    return grow_tubes(
        TubeTreeOptions(
            seed=107,
            height_m=17,
            trunk_radius_m=0.22,
            branch_spacing_m=0.5,
            twig_spacing_m=0.9,
            crown_width=0.3,
        )
    )


@pytest.fixture(scope="module")
def scan(grown: TreeModel) -> PointCloud:
    """Return the tree as an airborne scanner sees it: 40 points a square metre of bark, 20 mm noise."""
    return clean(sample(grown, options=SampleOptions(seed=7, density_per_m2=40, noise_m=0.02)))


def along(skeleton: Skeleton) -> Floats:
    """Points every 2 cm along all segments, in world coordinates."""
    start, end = skeleton.world[skeleton.parent[1:]], skeleton.world[1:]
    count = np.maximum(np.ceil(skeleton.length[1:] / 0.02).astype(int), 1)
    return np.vstack(
        [a + (b - a) * ((np.arange(n) + 0.5) / n)[:, None] for a, b, n in zip(start, end, count, strict=True)]
    )


def hanging(grown: TreeModel, scan: PointCloud) -> PointCloud:
    """Leave the crown's points that are off the stem, the ground being known."""
    stem_path = grown.skeleton.xyz[grown.skeleton.paths[0]] - scan.origin
    off = cKDTree(stem_path).query(scan.xyz)[0] > 0.4
    return scan.take(off & (scan.xyz[:, 2] > 0.45 * scan.xyz[:, 2].max()), ground_z=0.0)


def true_radius(grown: TreeModel, height: float) -> float:
    path = grown.skeleton.paths[0]
    return float(np.interp(height, grown.skeleton.xyz[path, 2], grown.radius[path]))


def test_finds_what_the_points_show(grown: TreeModel, scan: PointCloud) -> None:
    found, true = along(by_greedy(scan, GreedyOptions())), along(grown.skeleton)
    assert by_greedy(scan, GreedyOptions()).length[1:].min() > 0.0
    recall = np.mean(cKDTree(found).query(true)[0] < HALF_M)
    precision = np.mean(cKDTree(true).query(found)[0] < HALF_M)
    assert recall > 0.55
    assert precision > 0.75


def test_the_stem_is_followed_to_where_it_is_thin(grown: TreeModel, scan: PointCloud) -> None:
    found = find_stem(scan.xyz, 0.0, 0.02)
    assert found is not None
    path = grown.skeleton.xyz[grown.skeleton.paths[0]]
    height = found.xyz[:, 2] + scan.origin[2]
    axis = np.column_stack([np.interp(height, path[:, 2], path[:, k]) for k in (0, 1)])
    off = np.linalg.norm((found.xyz + scan.origin)[:, :2] - axis, axis=1)
    assert np.mean(off) < 0.03
    assert height[-1] > 0.8 * 17
    assert 0.015 < found.noise < 0.025


def test_the_circles_hold_the_diameter_within_their_error(grown: TreeModel, scan: PointCloud) -> None:
    rows = np.array(by_greedy(scan, GreedyOptions()).metadata["stem_circles"])
    height = rows[:, 0] + scan.origin[2]
    at = int(np.argmin(np.abs(height - BREAST_M)))
    true = true_radius(grown, float(height[at]))
    assert abs(rows[at, 1] - true) < 2.0 * rows[at, 2] < 0.15 * true
    assert (np.diff(rows[:, 0]) > 0).all()


def test_no_bark_gives_a_flagged_stem_straight_up(grown: TreeModel, scan: PointCloud) -> None:
    crown = hanging(grown, scan)
    skeleton = by_greedy(crown, GreedyOptions())
    assert "no_trunk" in skeleton.metadata["flags"]
    assert skeleton.metadata["stem_circles"] == ()
    low = skeleton.xyz[skeleton.paths[0]]
    low = low[low[:, 2] < 0.4 * scan.xyz[:, 2].max()]
    assert low[0, 2] == 0.0
    assert np.ptp(low[:, :2]) < np.ptp(crown.xyz[:, :2])
    np.testing.assert_array_equal(low[:, :2], np.broadcast_to(low[0, :2], (len(low), 2)))
    np.testing.assert_allclose(low[0, :2], np.median(crown.xyz[:, :2], axis=0), atol=0.1)


def test_a_stem_seen_high_up_alone_is_flagged_and_led_to_the_ground(scan: PointCloud) -> None:
    upper = scan.take(scan.xyz[:, 2] > 0.45 * scan.xyz[:, 2].max(), ground_z=0.0)
    skeleton = by_greedy(upper, GreedyOptions())
    assert "no_trunk" in skeleton.metadata["flags"]
    assert skeleton.metadata["stem_circles"][0][0] > 5.0
    np.testing.assert_allclose(skeleton.xyz[0], scan.xyz[np.argmin(scan.xyz[:, 2])] * [1, 1, 0], atol=0.6)


def test_a_seen_stem_raises_no_flag(scan: PointCloud) -> None:
    assert "no_trunk" not in by_greedy(scan, GreedyOptions()).metadata["flags"]


@pytest.mark.parametrize("count", [100, 500, 3000])
def test_a_ball_of_leaves_is_no_stem(count: int) -> None:
    leaves = np.random.default_rng(3).normal(0.0, 1.5, (count, 3))
    assert find_stem(leaves, float(leaves[:, 2].min()) - 4.0, 0.02) is None


def test_any_row_order_gives_the_same_bytes(scan: PointCloud) -> None:
    rows = np.random.default_rng(5).permutation(len(scan))
    mixed = clean(PointCloud(scan.xyz[rows], scan.origin))
    straight = clean(PointCloud(scan.xyz, scan.origin))
    a, b = by_greedy(straight, GreedyOptions()), by_greedy(mixed, GreedyOptions())
    assert a.xyz.tobytes() == b.xyz.tobytes()
    assert a.parent.tobytes() == b.parent.tobytes()
    assert a.metadata["stem_circles"] == b.metadata["stem_circles"]


def test_one_place_is_no_tree() -> None:
    with pytest.raises(NotATreeError, match="is the unit metres"):
        by_greedy(PointCloud(np.zeros((3, 3))), GreedyOptions())


@pytest.mark.parametrize("count", [2, 3, 20, 200])
def test_few_points_give_a_tree(count: int) -> None:
    xyz = np.round(np.random.default_rng(count).normal(0.0, 1.0, (count, 3)), 5)
    skeleton = by_greedy(PointCloud(xyz), GreedyOptions(longest_link=1000.0, tip_beyond_m=0.0))
    reach = cKDTree(skeleton.xyz).query(xyz)[0]
    assert reach.max() < 0.3  # a ball of the centring
    assert (skeleton.parent[1:] < np.arange(1, len(skeleton))).all()


def hand_drawn(*more: tuple[float, float, float]) -> PointCloud:
    """Return a thin pole of points every 10 cm, and a few points beside it."""
    pole = np.column_stack([np.zeros((11, 2)), np.linspace(0.0, 1.0, 11)])
    return PointCloud(np.vstack([pole, np.array(more).reshape(-1, 3)]))


def test_a_branch_leaves_a_link_between_its_points() -> None:
    cloud = PointCloud(np.array([[0, 0, 0], [0, 0, 0.1], [0, 0, 0.2], [0, 0, 0.6], [0.3, 0, 0.55]]))
    skeleton = by_greedy(cloud, GreedyOptions(tip_beyond_m=0.0, longest_link=1000.0))
    side = int(np.argmax(skeleton.xyz[:, 0]))
    foot = skeleton.xyz[skeleton.parent[side]]
    assert foot[0] == 0.0
    assert 0.25 < foot[2] < 0.55


def test_a_lone_point_far_away_is_left_out_and_a_pair_is_not() -> None:
    options = GreedyOptions(tip_beyond_m=0.0)
    alone = by_greedy(hand_drawn((2.0, 0.0, 1.0)), options)
    pair = by_greedy(hand_drawn((2.0, 0.0, 1.0), (2.1, 0.0, 1.0)), options)
    assert alone.xyz[:, 0].max() == 0.0
    assert pair.xyz[:, 0].max() == 2.1


def test_branches_end_past_their_last_point() -> None:
    tip = by_greedy(hand_drawn(), GreedyOptions(tip_beyond_m=0.1)).xyz[-1]
    np.testing.assert_allclose(tip, [0.0, 0.0, 1.1], atol=1e-9)


def test_points_of_a_limb_move_on_to_its_line() -> None:
    rng = np.random.default_rng(2)
    angle, along_limb = rng.uniform(0, 2 * np.pi, 400), rng.uniform(0, 5, 400)
    limb = np.column_stack([along_limb, 0.06 * np.cos(angle), 0.06 * np.sin(angle)])
    moved = greedy._centred(limb, 0.1)
    assert np.median(np.linalg.norm(moved[:, 1:], axis=1)) < 0.02
    plane = rng.uniform(0, 1, (400, 3)) * [1, 1, 0.01]
    assert np.mean(np.all(greedy._centred(plane, 0.1) == plane, axis=1)) > 0.7


def test_offers_are_the_formula() -> None:
    rng = np.random.default_rng(4)
    points, node = rng.normal(0, 1, (50, 3)), rng.normal(0, 1, (1, 3))
    heading = np.array([[0.0, 0.6, 0.8]])
    best, via = np.full(50, 1.2), np.full(50, -1)
    joining._offer(0, points, np.arange(50), (0.45, 0.3), (node, np.array([2.0]), heading), (best, via))
    d = np.linalg.norm(points - node, axis=1)
    cost = d**1.5 + 0.45 * 2.0 + 0.3 * (d - (points - node) @ heading[0])
    np.testing.assert_allclose(best, np.minimum(cost, 1.2))
    np.testing.assert_array_equal(via == 0, cost < 1.2)


def test_a_circle_goes_through_its_points() -> None:
    angle = np.array([0.3, 1.1, 2.9])
    ring = np.column_stack([2 + 0.2 * np.cos(angle), 3 + 0.2 * np.sin(angle), angle])
    np.testing.assert_allclose(rings._through(*ring), (2.0, 3.0, 0.2))
    line = np.column_stack([angle, 2 * angle, angle])
    assert rings._through(*line)[2] == 0.0


def test_half_a_ring_with_twigs_inside_is_refined() -> None:
    rng = np.random.default_rng(8)
    angle = np.linspace(0, np.pi, 40)
    ring = 0.2 * np.column_stack([np.cos(angle), np.sin(angle)]) + rng.normal(0, 0.01, (40, 2))
    twigs = rng.uniform(0.3, 0.5, (10, 2))
    a, b, r = rings._refine(np.vstack([ring, twigs]), (0.02, -0.02, 0.18), 0.01, (0.0, 0.0, 0.2), 10.0)
    np.testing.assert_allclose((a, b, r), (0.0, 0.0, 0.2), atol=0.015)


def test_the_ahn4_tree_is_as_thick_as_the_mobile_scanners_say(shared_data: Path) -> None:
    trees = shared_data / "trees"
    ground = read_cloud(trees / "ahn4_121913_487434.ground.laz")
    cloud = clean(read_cloud(trees / "ahn4_121913_487434.las"), ground=ground)
    rows = np.array(by_greedy(cloud, GreedyOptions()).metadata["stem_circles"])
    height = rows[:, 0] - cloud.metadata["ground_z"]
    at = int(np.argmin(np.abs(height - BREAST_M)))
    assert abs(2 * rows[at, 1] - 0.571) < 2 * 1.645 * rows[at, 2] < 0.06


@pytest.mark.parametrize("name", ["A", "B"])
def test_the_simulated_airborne_trees(shared_data: Path, name: str) -> None:
    cloud = clean(read_cloud(shared_data / "truth" / f"syn_{name}_als.laz"))
    truth = np.load(shared_data / "truth" / f"syn_{name}.truth.npz")
    share = np.linspace(0.05, 0.95, 10)[:, None, None]
    true = (truth["s"] + share * (truth["e"] - truth["s"])).reshape(-1, 3)
    weight = np.tile(np.linalg.norm(truth["e"] - truth["s"], axis=1), 10)
    found = along(by_greedy(cloud, GreedyOptions()))
    assert np.average(cKDTree(found).query(true)[0] < HALF_M, weights=weight) > 0.42
    assert np.mean(cKDTree(true).query(found)[0] < HALF_M) > 0.75
