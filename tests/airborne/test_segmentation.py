"""Trees from airborne points: scenes counted by hand, tiles cut into cells, clouds that hold nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.airborne.segmentation import SegmentationOptions, Segmented, segment
from pipeline.cloud import read_cloud
from pipeline.model import PointCloud

SLOPE = 0.3


def scene(*parts: tuple[np.ndarray, int], origin: tuple[float, float, float] = (0, 0, 0)) -> PointCloud:
    xyz = np.concatenate([points for points, _ in parts])
    kinds = np.concatenate([np.full(len(points), kind, np.uint8) for points, kind in parts])
    return PointCloud(np.rint(xyz * 4096) / 4096, np.array(origin), attributes={"classification": kinds})


def ground(slope: float = 0.0, size: float = 40.0) -> tuple[np.ndarray, int]:
    x, y = np.meshgrid(np.arange(0.1, size, 0.4), np.arange(0.1, size, 0.4))
    return np.column_stack([x.ravel(), y.ravel(), slope * x.ravel()]), 2


def crown(x: float, y: float, height: float, slope: float = 0.0, seed: int = 1) -> tuple[np.ndarray, int]:
    """A cone from 3 m above the ground to its tip, 3 m wide at the foot's side, filled with points."""
    rng = np.random.default_rng(seed)
    up = 3 + (height - 3) * rng.random(3000)
    wide = 3 * (height - up) / (height - 3) * np.sqrt(rng.random(3000))
    turn = rng.uniform(0, 2 * np.pi, 3000)
    points = np.column_stack([x + wide * np.cos(turn), y + wide * np.sin(turn), up])
    points = np.concatenate([points, [[x, y, height]]])
    points[:, 2] += slope * x
    return points, 1


def grid_of(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    noise = np.random.default_rng(3).normal(0, 0.02, (x.size, 3))
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()]) + noise


def test_a_cone_on_a_slope_is_one_tree_of_its_height() -> None:
    made = segment(scene(ground(SLOPE), crown(20, 20, 15, SLOPE)))
    (tree,) = made.trees
    assert tree.apex == pytest.approx([20, 20, 15 + SLOPE * 20], abs=0.001)
    assert tree.ground_z == pytest.approx(SLOPE * 20, abs=0.05)
    assert tree.base == pytest.approx([20, 20], abs=0.3)
    assert tree.crown_diameter_m == pytest.approx(6, abs=0.7)  # the thin rim lies below a fifth of the height
    assert tree.flags == ()
    assert len(tree.points) > 2900


def test_two_crowns_that_touch_are_two_trees_in_order_of_x() -> None:
    made = segment(scene(ground(), crown(22.5, 20, 14), crown(17.5, 20, 12, seed=2)))
    assert [t.apex[0] for t in made.trees] == pytest.approx([17.5, 22.5], abs=0.01)
    assert not set(made.trees[0].points) & set(made.trees[1].points)


def test_a_facade_a_pole_and_a_van_are_no_trees() -> None:
    across, up = np.meshgrid(np.arange(5, 25, 0.2), np.arange(2.1, 9, 0.2))
    facade = grid_of(across, np.full_like(across, 10.0), up)
    height = np.arange(0.2, 8, 0.1)
    pole = grid_of(np.full_like(height, 30), np.full_like(height, 30), height)
    along, beside = np.meshgrid(np.arange(30, 35, 0.2), np.arange(15, 17, 0.2))
    van = grid_of(along, beside, np.full_like(along, 2.4))
    made = segment(scene(ground(), (facade, 1), (pole, 1), (van, 1)))
    assert made.trees == ()
    assert not made.vegetation.any()


def test_a_tree_at_a_wall_says_so_and_a_tree_far_from_it_does_not() -> None:
    across, up = np.meshgrid(np.arange(5, 15, 0.2), np.arange(2.1, 9, 0.2))
    house = grid_of(across, np.full_like(across, 10.0), up)
    made = segment(scene(ground(), (house, 6), crown(10, 14, 12), crown(30, 30, 12)))
    assert [t.flags for t in made.trees] == [("near_building",), ()]


def test_without_classes_the_ground_is_found_and_said_to_be() -> None:
    soil, _ = ground(SLOPE)
    (tree,) = segment(scene((soil, 0), (crown(20, 20, 15, SLOPE)[0], 0))).trees
    assert tree.flags == ("no_ground",)
    assert tree.apex[2] - tree.ground_z == pytest.approx(15, abs=0.3)


def test_ground_of_its_own_file_counts() -> None:
    soil = scene(ground(), origin=(5, 5, -2))
    cloud = scene((crown(20, 20, 15)[0], 0))
    (tree,) = segment(cloud, ground=soil).trees
    assert tree.flags == ()
    assert tree.ground_z == pytest.approx(-2, abs=0.01)


def test_a_small_tree_below_a_large_one_is_found_when_asked_for() -> None:
    high, _ = crown(20, 20, 24)
    high = high[high[:, 2] > 12]
    low, _ = crown(20.5, 20, 6, seed=5)
    cloud = scene(ground(), (high, 1), (low, 1))
    assert len(segment(cloud).trees) == 1
    found = segment(cloud, options=SegmentationOptions(understory=True)).trees
    assert sorted(t.flags for t in found) == [(), ("understory",)]


@pytest.mark.parametrize("kind", [0, 1, 2, 9])
@pytest.mark.parametrize("count", [0, 1, 19, 500])
def test_clouds_without_trees_hold_no_tree(kind: int, count: int) -> None:
    flat = np.random.default_rng(0).random((count, 3)) * [30, 30, 0.01]
    assert segment(scene((flat, kind))).trees == ()


def test_a_cloud_that_is_nothing_but_vegetation_does_not_crash() -> None:
    points, _ = crown(20, 20, 15)
    assert all("no_ground" in t.flags for t in segment(scene((points, 0))).trees)
    assert isinstance(segment(PointCloud(points)), Segmented)


def known(
    made: Segmented, cloud: PointCloud, low: np.ndarray, high: np.ndarray
) -> dict[bytes, tuple[bytes, ...]]:
    """Everything that is said of the trees whose apex lies in a half-open square, by apex."""
    out = {}
    for t in made.trees:
        apex = t.apex + cloud.origin
        if (apex[:2] >= low).all() and (apex[:2] < high).all():
            points = cloud.world[t.points]
            points = points[np.lexsort(points.T)]
            facts = (
                points,
                t.base + cloud.origin[:2],
                t.crown + cloud.origin[:2],
                t.ground_z + cloud.origin[2],
            )
            out[apex.tobytes()] = (*(np.asarray(f).tobytes() for f in facts), repr(t.flags).encode())
    return out


@pytest.mark.parametrize(("name", "core"), [("chablais3.laz", 45.0), ("ahn4_2496_9727.laz", 30.0)])
def test_a_tile_in_cells_gives_the_trees_of_the_whole(shared_data: Path, name: str, core: float) -> None:
    read = read_cloud(shared_data / "tiles" / name)
    cloud = PointCloud(np.rint(read.xyz * 4096) / 4096, read.origin, attributes=read.attributes)
    whole = segment(cloud)
    low, high = cloud.world[:, :2].min(axis=0), cloud.world[:, :2].max(axis=0)
    seen = 0
    for x in np.arange(np.floor(low[0] / core) * core, high[0], core):
        for y in np.arange(np.floor(low[1] / core) * core, high[1], core):
            square = np.array([x, y])
            inside = ((cloud.world[:, :2] >= square - 20) & (cloud.world[:, :2] < square + core + 20)).all(
                axis=1
            )
            part = cloud.take(inside)
            origin = np.floor(part.world.min(axis=0)) if len(part) else cloud.origin
            part = PointCloud(part.xyz - (origin - cloud.origin), origin, attributes=part.attributes)
            mine = known(segment(part), part, square, square + core)
            assert mine == known(whole, cloud, square, square + core)
            seen += len(mine)
    assert seen == len(whole.trees) > 10


def stand(seed: int = 7) -> PointCloud:
    """Cones on a slope at forest spacing, some of which touch; 48 m wide, across the corner of blocks."""
    rng = np.random.default_rng(seed)
    parts = [ground(SLOPE, 48.0)]
    for number, (i, j) in enumerate(np.ndindex(8, 8)):
        x, y = 3.2 + 5.6 * np.array([i, j]) + rng.uniform(-1.2, 1.2, 2)
        points, kind = crown(float(x), float(y), float(rng.uniform(8, 18)), SLOPE, seed=number)
        parts.append((points[:: 4 if number % 3 else 9], kind))
    return scene(*parts, origin=(121_990, 487_010, 0))


@pytest.mark.parametrize("core", [6.0, 9.5, 14.0])
def test_many_small_cells_give_the_trees_of_the_whole(core: float) -> None:
    cloud = stand()
    whole = segment(cloud)
    low, high = cloud.world[:, :2].min(axis=0), cloud.world[:, :2].max(axis=0)
    seen = 0
    for x in np.arange(np.floor(low[0] / core) * core, high[0], core):
        for y in np.arange(np.floor(low[1] / core) * core, high[1], core):
            square = np.array([x, y])
            inside = (cloud.world[:, :2] >= square - 20) & (cloud.world[:, :2] < square + core + 20)
            part = cloud.take(inside.all(axis=1))
            origin = np.floor(part.world.min(axis=0))
            part = PointCloud(part.xyz - (origin - cloud.origin), origin, attributes=part.attributes)
            mine = known(segment(part), part, square, square + core)
            assert mine == known(whole, cloud, square, square + core)
            seen += len(mine)
    assert seen == len(whole.trees) > 40


def test_one_broad_crown_is_one_tree(shared_data: Path) -> None:
    cloud, soil = (
        read_cloud(shared_data / "trees" / f"ahn4_121913_487434{end}") for end in (".las", ".ground.laz")
    )
    (tree,) = segment(cloud, ground=soil).trees
    assert tree.apex[2] - tree.ground_z == pytest.approx(14.8, abs=0.3)
    assert tree.crown_diameter_m > 11
    parted = segment(cloud, ground=soil, options=SegmentationOptions(valley_share=0.0))
    assert len(parted.trees) == 2


def test_street_trees_are_found_where_they_stand(shared_data: Path) -> None:
    cloud = read_cloud(shared_data / "tiles" / "ahn4_2496_9727.laz")
    base = np.array([t.base for t in segment(cloud).trees]) + cloud.origin[:2]
    inside = (base >= (124800, 486350)).all(axis=1) & (base <= (124834.56, 486400)).all(axis=1)
    assert inside.sum() == 9


def test_the_row_order_does_not_matter() -> None:
    cloud = scene(ground(SLOPE), crown(20, 20, 15, SLOPE), crown(25, 20, 12, SLOPE, seed=4))
    mixed = cloud.take(np.random.default_rng(1).permutation(len(cloud)))
    nowhere, everywhere = np.full(2, -np.inf), np.full(2, np.inf)
    assert known(segment(cloud), cloud, nowhere, everywhere) == known(
        segment(mixed), mixed, nowhere, everywhere
    )
