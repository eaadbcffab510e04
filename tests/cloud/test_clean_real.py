"""Cleaning of real clouds: a tree without ground loses next to nothing, its base stays where it is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pipeline.cloud import clean, read_cloud

WHOLE = [
    "trees/tree1.xyz",
    "trees/tree7.xyz",
    "trees/Lille_2.xyz",
    "trees/Lille_11.xyz",
    "trees/mobile_tree_1.xyz",
    "trees/ahn_LAS00_9.xyz",
    "trees/archi_tree1.las",
    "trees/rtwig_coffeetree.txt",
    "trees/itsme_tree1.las",
    "trees/voxr_t0.asc",
    "trees/ahn4_121913_487434.las",
    "truth/syn_A_als.laz",
    "truth/syn_B_als.laz",
    "truth/syn_A_noisy.laz",
    "truth/syn_B_oneside.laz",
]


@pytest.mark.parametrize("name", WHOLE)
def test_a_tree_without_ground_stays_whole(shared_data: Path, name: str) -> None:
    cloud = read_cloud(shared_data / name)
    tree = clean(cloud)
    dropped = tree.metadata["dropped"]
    assert dropped["outlier"] + dropped["clump"] < 0.01 * len(cloud)
    assert dropped["ground"] == 0
    assert tree.metadata["ground_source"] == "lowest"
    assert tree.metadata["ground_z"] == pytest.approx(cloud.xyz[:, 2].min(), abs=0.05)
    assert "several_stems" not in tree.metadata["flags"]
    assert sum(dropped.values()) + len(tree) == len(cloud)


def test_ground_of_class_2_is_used(shared_data: Path) -> None:
    tree = clean(read_cloud(shared_data / "trees/treetraits_pine0129.laz"))
    assert tree.metadata["ground_source"] == "class"
    assert 1465 <= tree.metadata["dropped"]["ground"] < 2000
    assert tree.metadata["flags"] == ("leafy",)


def test_ground_of_a_file_is_used(shared_data: Path) -> None:
    cloud = read_cloud(shared_data / "trees/ahn4_121913_487434.las")
    tree = clean(cloud, read_cloud(shared_data / "trees/ahn4_121913_487434.ground.laz"))
    assert tree.metadata["ground_source"] == "file"
    height = tree.metadata["top_z"] - tree.metadata["ground_z"]
    assert 14.5 < height < 15.5


def test_noise_classes_do_not_stretch_a_cloud(shared_data: Path) -> None:
    tree = clean(read_cloud(shared_data / "traps/TEAK_056.laz"))
    assert "noise_class" in tree.metadata["flags"]
    assert np.ptp(tree.xyz[:, 2]) < 60
