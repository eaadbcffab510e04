"""Leaves: they go, the wood stays and hangs together, and small changes of the cloud change little."""

from __future__ import annotations

from functools import cache
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from pipeline.cloud import CleanOptions, clean, read_cloud
from pipeline.cloud.clumps import components
from pipeline.cloud.leaves import LeafOptions, find_leaves, heaviest_part
from pipeline.cloud.lines import FLOOR, line_scores
from pipeline.geometry.voxels import first_in_cell
from pipeline.synthetic import SampleOptions, TubeTreeOptions, grow_tubes, sample

STOUT_M = 0.012


class Leafy(NamedTuple):
    """A cloud with known leaves; `stout` points lie on wood thicker than `STOUT_M`."""

    xyz: np.ndarray
    leaf: np.ndarray
    stout: np.ndarray


def in_order(xyz: np.ndarray) -> np.ndarray:
    return np.lexsort((xyz[:, 0], xyz[:, 1], xyz[:, 2]))


def discs(at: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return a leaf of 4 to 8 cm, five points each, within 3 to 28 cm of every place."""
    way, face = rng.normal(size=(2, len(at), 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    middle = at + way * rng.uniform(0.03, 0.28, (len(at), 1))
    spot = rng.normal(size=(5, len(at), 3))
    spot -= (spot * face).sum(axis=2, keepdims=True) / (face**2).sum(axis=1)[:, None] * face
    spot /= np.linalg.norm(spot, axis=2, keepdims=True)
    size = rng.uniform(0.02, 0.04, len(at))[:, None] * np.sqrt(rng.random((5, len(at), 1)))
    return (middle + size * spot).reshape(-1, 3)


def needles(at: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return a shoot of 10 to 30 cm with 60 points up to 6 cm away at every twelfth place."""
    at = np.repeat(at[::12], 60, axis=0)
    way, off = rng.normal(size=(2, len(at) // 60, 3)).repeat(60, axis=1)[0], rng.normal(size=(len(at), 3))
    way /= np.linalg.norm(way, axis=1)[:, None]
    off *= 0.06 * rng.random((len(at), 1)) ** 0.7 / np.linalg.norm(off, axis=1)[:, None]
    return at + way * rng.uniform(0, 0.3, (len(at), 1)) + off


@cache
def leafy(seed: int, kind: str) -> Leafy:
    """A tree of 6 m with as many leaf points as wood points; `kind` is disc, needle or bare."""
    rng = np.random.default_rng(seed)
    tree = grow_tubes(TubeTreeOptions(seed=seed, height_m=6, trunk_radius_m=0.09, max_order=2))
    wood = sample(tree, options=SampleOptions(seed=seed, density_per_m2=6000, noise_m=0.003)).xyz
    thin = np.flatnonzero(tree.radius < STOUT_M)
    at = tree.skeleton.xyz[rng.choice(thin, len(wood) // 5)]
    grow = {"disc": discs, "needle": needles, "bare": lambda at, _: at[:0]}[kind]
    foliage = grow(at, rng)
    stout = _near_stout(wood, tree.skeleton.xyz[tree.radius > STOUT_M], tree.radius[tree.radius > STOUT_M])
    xyz = np.round(np.concatenate([wood, foliage]), 5)
    order = in_order(xyz)
    leaf = np.arange(len(xyz)) >= len(wood)
    return Leafy(xyz[order], leaf[order], np.append(stout, np.zeros(len(foliage), dtype=bool))[order])


def _near_stout(xyz: np.ndarray, nodes: np.ndarray, radius: np.ndarray) -> np.ndarray:
    near = np.zeros(len(xyz), dtype=bool)
    for node, size in zip(nodes, radius, strict=True):
        near |= np.linalg.norm(xyz - node, axis=1) < size + 0.03
    return near


# -- known trees -------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["disc", "needle"])
@pytest.mark.parametrize("seed", [1, 2])
def test_leaves_go_and_stout_wood_stays(seed: int, kind: str) -> None:
    tree = leafy(seed, kind)
    found = find_leaves(tree.xyz)
    assert found[tree.stout].mean() < 0.01
    assert found[tree.leaf].mean() > 0.8
    assert tree.leaf[~found].mean() < 0.2


@pytest.mark.parametrize("kind", ["disc", "needle"])
def test_the_wood_hangs_together(kind: str) -> None:
    tree = leafy(1, kind)
    label = components(tree.xyz[~find_leaves(tree.xyz)], 0.2)
    assert np.bincount(label).max() > 0.97 * len(label)


def test_a_bare_tree_loses_little() -> None:
    tree = leafy(1, "bare")
    found = find_leaves(tree.xyz)
    assert found.mean() < 0.04
    assert not found[tree.stout].any()


def test_a_turn_and_a_millimetre_change_little() -> None:
    tree = leafy(1, "disc")
    turn = np.radians(31)
    rotation = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
    moved = tree.xyz @ rotation.T + np.random.default_rng(5).normal(0, 0.001, tree.xyz.shape)
    order = in_order(moved)
    again = np.empty(len(moved), dtype=bool)
    again[order] = find_leaves(moved[order])
    assert np.mean(again == find_leaves(tree.xyz)) > 0.95


def test_a_cloud_elsewhere_has_the_same_leaves() -> None:
    xyz = leafy(1, "disc").xyz
    assert np.mean(find_leaves(xyz) == find_leaves(xyz + [64.0, -32.0, 16.0])) > 0.97


# -- hidden branches, lone spots ---------------------------------------------------------------


def rod(start: tuple[float, ...], end: tuple[float, ...], radius: float, seed: int = 3) -> np.ndarray:
    """Points on a rod, 6000 on a square metre."""
    rng = np.random.default_rng(seed)
    a, b = np.array(start), np.array(end)
    length = np.linalg.norm(b - a)
    count = int(2 * np.pi * radius * length * 6000)
    off = np.cross(rng.normal(size=(count, 3)), (b - a) / length)
    return a + rng.random((count, 1)) * (b - a) + radius * off / np.linalg.norm(off, axis=1)[:, None]


def labels_of(*parts: np.ndarray) -> list[np.ndarray]:
    xyz = np.concatenate(parts)
    order = in_order(xyz)
    leaf = np.empty(len(xyz), dtype=bool)
    leaf[order] = find_leaves(xyz[order])
    return np.split(leaf, np.cumsum([len(part) for part in parts])[:-1])


def test_a_gap_in_a_branch_is_bridged() -> None:
    stem = rod((0, 0, 0), (0, 0, 3), 0.08)
    near, beyond = rod((0.08, 0, 2), (0.6, 0, 2.3), 0.012), rod((0.8, 0, 2.415), (1.6, 0, 2.875), 0.012)
    for leaf in labels_of(stem, near, beyond):
        assert leaf.mean() < 0.02


def test_a_lone_spot_in_the_foliage_is_leaf() -> None:
    rng = np.random.default_rng(1)
    stem, spot = rod((0, 0, 0), (0, 0, 3), 0.08), rod((1.1, 0, 3), (1.1, 0.25, 3), 0.006)
    foliage = rng.uniform([-1.5, -1.5, 2.5], [1.5, 1.5, 4], (20_000, 3))
    bark, lone, leaves = labels_of(stem, spot, foliage)
    assert not bark[stem[:, 2] < 2.5].any()
    assert bark.mean() < 0.04
    assert lone.all()
    assert leaves.mean() > 0.95


def test_a_handful_of_points_is_wood() -> None:
    few = np.random.default_rng(1).random((8, 3))
    assert not find_leaves(few).any()
    assert not find_leaves(np.repeat(few, 5, axis=0)[in_order(np.repeat(few, 5, axis=0))]).any()


@pytest.mark.parametrize("wrong", [{"leaf_cell_m": 0.0}, {"wood_score": -1.0}, {"cell": 1.0}])
def test_options_are_checked(wrong: dict[str, float]) -> None:
    with pytest.raises(ValidationError):
        LeafOptions(**wrong)


# -- parts -------------------------------------------------------------------------------------


def test_lines_stand_out_from_clutter() -> None:
    rng = np.random.default_rng(2)
    twig = np.column_stack([np.linspace(-0.5, 0.5, 41), np.zeros(41), np.zeros(41)])
    clutter = rng.uniform(-0.5, 0.5, (3000, 3))
    xyz = np.concatenate([twig, clutter])
    xyz = xyz[first_in_cell(xyz, 0.01)]
    on = np.hypot(xyz[:, 1], xyz[:, 2]) < 1e-9
    score = line_scores(xyz, 0.025)
    assert np.median(score[on]) > np.quantile(score[~on], 0.98)


def test_a_point_alone_has_no_line() -> None:
    assert line_scores(np.zeros((1, 3)), 0.025).tolist() == [FLOOR]


@given(st.data())
def test_no_connected_part_is_heavier(data: st.DataObject) -> None:
    count = data.draw(st.integers(1, 8))
    before = np.array([-1] + [data.draw(st.integers(0, i - 1)) for i in range(1, count)])
    weight = np.array([float(data.draw(st.integers(-5, 5))) for _ in range(count)])
    parts = ({0, *others} for size in range(count) for others in combinations(range(1, count), size))
    best = max(weight[sorted(part)].sum() for part in parts if all(before[i] in part for i in part if i))
    kept = heaviest_part(np.arange(count), before, weight)
    assert kept[0]
    assert all(kept[before[i]] for i in np.flatnonzero(kept) if i)
    assert weight[kept].sum() == best


# -- real trees --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "crown_z", "low", "high"),
    [("itsme_tree1.las", 20.0, 0.5, 0.7), ("treetraits_pine0129.laz", 12.0, 0.5, 0.7)],
)
def test_stems_of_real_trees_stay(
    shared_data: Path, name: str, crown_z: float, low: float, high: float
) -> None:
    cloud = clean(read_cloud(shared_data / "trees" / name), options=CleanOptions(leaves="keep"))
    xyz = cloud.xyz
    leaf = find_leaves(xyz)
    assert leaf[xyz[:, 2] < crown_z].mean() < 0.02
    assert low < leaf.mean() < high
