"""What a scanner sees: nothing behind a trunk, edges as wide as the beam, and the truth of every return."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pipeline.cloud import read_cloud
from pipeline.errors import NotATreeError, UsageError
from pipeline.geometry.surface import Tubes, nearest_tube
from pipeline.model import Skeleton, TreeModel
from pipeline.synthetic import (
    SURFACES,
    AlsOptions,
    Scan,
    TlsOptions,
    TubeTreeOptions,
    grow_tubes,
    read_truth,
    scan,
    step_for,
    truth_of,
    write_scan,
)

try:
    import open3d  # noqa: F401  whether it can be loaded
except (ImportError, OSError) as error:
    ABSENT = f"open3d cannot be loaded: {error}"
else:
    ABSENT = ""
needs_open3d = pytest.mark.skipif(bool(ABSENT), reason=ABSENT)

BARE = {"ground_radius_m": 0.0, "noise_m": 0.0, "sub_rays": 1}


def posts(*places: tuple[float, float, float, float]) -> TreeModel:
    """Return upright posts (east, north, radius, height) on a thin axis along the ground."""
    xyz, parent, radius = [(places[0][0], places[0][1], 0.0)], [-1], [places[0][2]]
    for k, (east, north, thick, tall) in enumerate(places):
        foot = 0
        if k:
            foot = len(xyz)
            xyz.append((east, north, 0.0))
            parent.append(0)
            radius.append(0.001)
        parent.append(foot)
        xyz.append((east, north, tall))
        radius.append(thick)
    count = len(xyz)
    skeleton = Skeleton(np.array(xyz), np.array(parent, dtype=np.int32), np.array([5.0, 6, 7]), "EPSG:28992")
    return TreeModel(skeleton, np.array(radius), np.zeros(count, dtype=np.uint8), np.zeros(count))


def off_surface(made: Scan, tree: TreeModel) -> np.ndarray:
    parent = tree.skeleton.parent[1:]
    world = tree.skeleton.world
    tubes = Tubes(world[parent], world[1:], tree.start_radius[1:], tree.radius[1:])
    return np.abs(nearest_tube(made.cloud.world, tubes).surface)


@pytest.fixture(scope="module")
def tree() -> TreeModel:
    return grow_tubes(TubeTreeOptions(seed=3, height_m=4, trunk_radius_m=0.07, max_order=2))


@pytest.fixture(scope="module")
def leafy(tree: TreeModel) -> Scan:
    if ABSENT:
        pytest.skip(ABSENT)
    return scan(tree, options=TlsOptions(leaves=True, step_deg=0.15, neighbours=3, neighbour_distance_m=3))


@needs_open3d
def test_exact_rays_end_on_the_bark(tree: TreeModel) -> None:
    # Flat sides stand off round bark by facet_m; where a ring at a bend is left out, by a little more.
    for options in (TlsOptions(**BARE, step_deg=0.1), AlsOptions(**BARE, density_per_m2=900, facet_m=0.0002)):
        made = scan(tree, options=options)
        off = off_surface(made, tree)
        assert len(off) > 200
        assert off.mean() < 0.0001
        assert np.percentile(off, 99) < 0.001
        assert off.max() < 0.005
        np.testing.assert_allclose(made.cloud.world, made.returns.true_xyz, atol=1e-9)
        assert np.abs(made.returns.range_error_m).max() < 1e-9


@needs_open3d
def test_what_stands_behind_a_trunk_is_not_seen() -> None:
    both = posts((0, 0, 0.2, 3.0), (-3.0, 0, 0.1, 2.5))
    front = scan(both, options=TlsOptions(**BARE, positions=((8.0, 0.0, 1.5),)))
    behind = scan(both, options=TlsOptions(**BARE, positions=((-9.0, 0.0, 1.5),)))
    hidden = front.cloud.xyz[:, 0] < -2
    assert not hidden.any()
    assert (front.returns.branch == 0).all()
    assert (behind.cloud.xyz[:, 0] < -2).sum() > 500
    assert (front.cloud.xyz[:, 0] > 0).all()


@needs_open3d
def test_points_are_as_dense_as_the_step_says() -> None:
    step = step_for(20_000, 10.0)
    assert step == pytest.approx(np.degrees(0.1 / np.sqrt(200) / 10))
    how = TlsOptions(**BARE, positions=((10.5, 0.0, 1.5),), step_deg=step)
    xyz = scan(posts((0, 0, 0.5, 3.0)), options=how).cloud.xyz
    seen = (np.abs(xyz[:, 1]) < 0.1) & (np.abs(xyz[:, 2] - 1.5) < 0.5)
    assert seen.sum() / (0.2 * 1.0) == pytest.approx(20_000, rel=0.05)


@needs_open3d
def test_pulses_are_as_dense_as_asked() -> None:
    made = scan(posts((0, 0, 0.1, 3.0)), options=AlsOptions(density_per_m2=40, margin_m=6, ground_radius_m=5))
    ground = made.cloud.attributes["classification"] == 2
    away = np.linalg.norm(made.cloud.xyz[:, :2], axis=1)
    ring = ground & (away > 2) & (away < 4.5)
    assert ring.sum() / (np.pi * (4.5**2 - 2**2)) == pytest.approx(40, rel=0.06)


@needs_open3d
def test_a_wider_beam_makes_a_post_wider() -> None:
    wide = []
    for divergence in (0.0, 2.0, 8.0):
        how = {**BARE, "sub_rays": 19, "aperture_m": 0.0, "divergence_mrad": divergence, "stations": 1}
        xyz = scan(
            posts((0, 0, 0.05, 3.0)), options=TlsOptions(**how, distance_m=10, step_deg=0.02)
        ).cloud.xyz
        wide.append(np.abs(xyz[(xyz[:, 2] > 0.5) & (xyz[:, 2] < 2.5), 1]).max())
    assert wide[0] == pytest.approx(0.05, abs=0.002)
    assert wide[0] + 0.004 < wide[1] <= 0.05 + 0.010 + 0.001
    assert wide[1] + 0.012 < wide[2] <= 0.05 + 0.040 + 0.001


@needs_open3d
@pytest.mark.parametrize(("gap", "returns"), [(0.3, 2), (3.0, 1)])
def test_an_edge_gives_two_returns_or_one_between(gap: float, returns: int) -> None:
    how = {**BARE, "sub_rays": 19, "divergence_mrad": 5.0, "gap_m": gap}
    both = posts((0, 0, 0.1, 3.0), (-1.0, 0.2, 0.3, 3.0))
    made = scan(both, options=TlsOptions(**how, positions=((10.0, 0.0, 1.5),)))
    told = made.returns
    assert told.number_of_returns.max() == returns
    between = (made.cloud.xyz[:, 0] < -0.15) & (made.cloud.xyz[:, 0] > -0.55)
    assert between.any() == (returns == 1)  # in the air between the posts: mixed pixels
    assert (told.spread_m[between] > 0.3).all()
    if returns == 2:
        first = (told.return_number == 1) & (told.number_of_returns == 2)
        last = told.return_number == 2
        assert first.sum() == last.sum() > 50
        assert (told.true_range_m[last] - told.true_range_m[first] > gap).all()
        assert (told.branch[first] == 0).all()
        assert (told.branch[last] > 0).all()
        assert (told.hits[first].astype(int) + told.hits[last] <= 19).all()


@needs_open3d
def test_noise_is_along_the_beam_and_as_asked() -> None:
    how = {**BARE, "noise_m": 0.01, "stations": 1}
    made = scan(posts((0, 0, 0.4, 3.0)), options=TlsOptions(**how))
    shift = made.cloud.world - made.returns.true_xyz
    assert made.returns.range_error_m.std() == pytest.approx(0.01, rel=0.03)
    np.testing.assert_allclose(
        np.linalg.norm(shift, axis=1), np.abs(made.returns.range_error_m), rtol=1e-5, atol=1e-8
    )
    still = scan(posts((0, 0, 0.4, 3.0)), options=TlsOptions(**(how | {"noise_m": 0.0})))
    moved = scan(
        posts((0, 0, 0.4, 3.0)), options=TlsOptions(**(how | {"noise_m": 0.0, "registration_m": 0.01}))
    )
    once = moved.cloud.xyz - still.cloud.xyz
    assert np.ptp(once, axis=0).max() < 1e-9
    assert 0.001 < np.linalg.norm(once[0]) < 0.05


@needs_open3d
def test_wind_moves_the_top_and_not_the_ground(tree: TreeModel) -> None:
    how = {"step_deg": 0.2, "noise_m": 0.0}
    still, windy = (scan(tree, options=TlsOptions(**how, wind_m=wind)) for wind in (0.0, 0.05))
    moved = np.linalg.norm(windy.cloud.xyz - still.cloud.xyz, axis=1)
    high = still.cloud.xyz[:, 2] > 3.5
    assert moved[windy.returns.surface == 2].max() == 0
    assert 0.01 < moved[high].mean() < moved.max() <= 0.051


@needs_open3d
def test_every_return_knows_where_it_comes_from(tree: TreeModel, leafy: Scan) -> None:
    told, attributes = leafy.returns, leafy.cloud.attributes
    kinds = {SURFACES[k] for k in np.unique(told.surface)}
    assert kinds == {"wood", "leaf", "ground", "neighbour"}
    expected = np.array([1, 5, 2, 1])[told.surface]
    np.testing.assert_array_equal(attributes["classification"], expected)
    on_tree = told.surface <= 1
    assert (told.segment[~on_tree] == -1).all()
    assert (told.segment[on_tree] >= 0).all()
    truth = truth_of(tree)
    np.testing.assert_array_equal(truth.branch[told.segment[on_tree]], told.branch[on_tree])
    np.testing.assert_array_equal(truth.order[told.segment[on_tree]], told.order[on_tree])
    wood = told.surface == 0
    own = told.segment[wood]
    along = truth.e[own] - truth.s[own]
    offset = told.true_xyz[wood] - truth.s[own]
    share = np.clip((offset * along).sum(axis=1) / (along**2).sum(axis=1), 0, 1)
    away = np.linalg.norm(offset - share[:, None] * along, axis=1)
    assert np.percentile(np.abs(away - truth.r[own]), 99) < 0.003
    assert (np.linalg.norm(told.true_xyz[told.surface == 1][:, :2], axis=1) < 3).all()


@needs_open3d
def test_leaves_hide_wood(tree: TreeModel, leafy: Scan) -> None:
    bare = scan(tree, options=TlsOptions(step_deg=0.15))
    assert (leafy.returns.surface == 1).sum() > 1000
    assert (leafy.returns.surface == 0).sum() < 0.95 * (bare.returns.surface == 0).sum()


@needs_open3d
def test_a_seed_gives_one_scan_and_one_file(tree: TreeModel, tmp_path: Path) -> None:
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        write_scan(
            scan(tree, options=TlsOptions(step_deg=0.2, leaves=True, seed=seed)), tmp_path / f"{name}.laz"
        )
    for suffix in (".laz", ".truth.npz", ".returns.npz"):
        same = (tmp_path / f"a{suffix}").read_bytes()
        assert same == (tmp_path / f"b{suffix}").read_bytes()
        assert (same == (tmp_path / f"c{suffix}").read_bytes()) == (suffix == ".truth.npz")


@needs_open3d
def test_one_thread_or_many_make_no_difference(tree: TreeModel, tmp_path: Path) -> None:
    write_scan(scan(tree, options=AlsOptions(leaves=True)), tmp_path / "here.laz")
    code = (
        "import os, sys;"
        "hasattr(os, 'sched_setaffinity') and os.sched_setaffinity(0, {min(os.sched_getaffinity(0))});"
        "from pipeline.synthetic import *;"
        "tree = grow_tubes(TubeTreeOptions(seed=3, height_m=4, trunk_radius_m=0.07, max_order=2));"
        "write_scan(scan(tree, options=AlsOptions(leaves=True)), sys.argv[1])"
    )
    subprocess.run([sys.executable, "-c", code, str(tmp_path / "alone.laz")], check=True)
    assert (tmp_path / "here.laz").read_bytes() == (tmp_path / "alone.laz").read_bytes()


@needs_open3d
def test_what_is_written_is_read(tree: TreeModel, leafy: Scan, tmp_path: Path) -> None:
    cloud, truth, returns = write_scan(leafy, tmp_path / "oak.laz")
    back = read_cloud(cloud)
    assert set(back.attributes) == set(leafy.cloud.attributes)
    for name, values in leafy.cloud.attributes.items():
        np.testing.assert_array_equal(back.attributes[name], values)
    assert back.metadata["scan"]["scanner"] == "tls"
    assert json.dumps(back.metadata["scan"])
    np.testing.assert_array_equal(read_truth(truth).r, truth_of(tree).r)
    with np.load(returns) as told:
        assert {len(told[key]) for key in told.files} == {len(back)}
        np.testing.assert_array_equal(told["segment"], back.attributes["segment"])
        error = np.linalg.norm(told["true_xyz"] - back.world, axis=1)
    assert np.median(error) < 0.01


@needs_open3d
def test_the_cloud_stands_where_the_tree_stands() -> None:
    made = scan(posts((0, 0, 0.2, 3.0)), options=TlsOptions(**BARE, stations=1))
    assert made.cloud.origin.tolist() == [5, 6, 7]
    assert made.cloud.crs == "EPSG:28992"
    far = posts((400_000.0, 300_000.0, 0.2, 3.0))
    moved = scan(far, options=TlsOptions(**BARE, stations=1))
    np.testing.assert_allclose(moved.cloud.xyz - [400_000, 300_000, 0], made.cloud.xyz, atol=1e-4)


@needs_open3d
def test_a_station_in_a_trunk_is_refused() -> None:
    with pytest.raises(
        UsageError, match=r"station 1 at 0\.10 m east .* stands inside a trunk; give a larger"
    ):
        scan(posts((0, 0, 0.2, 3.0)), options=TlsOptions(positions=((5, 0, 1), (0.1, 0, 1))))


@needs_open3d
def test_no_hit_at_all_is_an_error() -> None:
    with pytest.raises(NotATreeError, match=r"none of the \d+ beams hits the tree; move the scanner nearer"):
        scan(posts((0, 0, 0.2, 3.0)), options=TlsOptions(max_range_m=2.0))
    with pytest.raises(NotATreeError, match="none of the 0 beams"):
        scan(posts((0, 0, 0.0005, 0.002)), options=TlsOptions(**BARE, step_deg=5, stations=1))
    dot = TreeModel(
        Skeleton(np.zeros((1, 3)), np.array([-1], dtype=np.int32)),
        np.ones(1),
        np.zeros(1, dtype=np.uint8),
        np.zeros(1),
    )
    with pytest.raises(NotATreeError, match="no wood that could be scanned; give a model"):
        scan(dot)
