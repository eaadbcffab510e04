"""Every reader behind `read_cloud`: what it gives, and what it says of a file that is no cloud."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

import numpy as np
import pytest

from pipeline.cloud import CLOUD_SUFFIXES, read_cloud
from pipeline.errors import InputFormatError, InputMissingError, MissingExtraError, UsageError

POINTS = {
    "Lille_11.xyz": 19337,
    "Lille_2.xyz": 28993,
    "ahn4_121913_487434.ground.laz": 11059,
    "ahn4_121913_487434.las": 4040,
    "ahn_LAS00_9.xyz": 4957,
    "archi_tree1.las": 20198,
    "itsme_tree1.las": 30826,
    "mobile_tree_1.xyz": 16493,
    "rtwig_coffeetree.txt": 14667,
    "tree1.xyz": 11855,
    "tree7.xyz": 15130,
    "treetraits_pine0129.laz": 355572,
    "voxr_t0.asc": 49054,
    "voxr_t1.asc": 60028,
}


@pytest.mark.parametrize("name", POINTS)
def test_real_clouds_read_whole(shared_data: Path, name: str) -> None:
    cloud = read_cloud(shared_data / "trees" / name)
    assert len(cloud) == POINTS[name]
    assert np.isfinite(cloud.xyz).all()
    assert (cloud.xyz.min(axis=0) >= 0).all()
    assert (cloud.xyz.min(axis=0) < 1).all()
    assert (cloud.origin % 1 == 0).all()


def test_a_duplicate_dimension_name_is_numbered(shared_data: Path) -> None:
    cloud = read_cloud(shared_data / "traps" / "slice_buttress.las")
    assert len(cloud) == 12219
    assert {"deviation", "deviation_2"} <= set(cloud.attributes)
    assert cloud.origin == pytest.approx([286646, 583796, 27])


def test_noise_far_above_is_left_to_cleaning(shared_data: Path) -> None:
    cloud = read_cloud(shared_data / "traps" / "TEAK_056.laz")
    assert len(cloud) == 8027
    assert (cloud.attributes["classification"] == 7).sum() == 2


@pytest.mark.parametrize(
    ("name", "crs"),
    [
        ("trees/ahn4_121913_487434.ground.laz", "EPSG:7415"),
        ("tiles/chablais3.laz", "EPSG:2154"),
        ("tiles/spanner_als.laz", "EPSG:6341"),  # compound without a code: its horizontal part
        ("tiles/ahn3_2386_9702.laz", None),
    ],
)
def test_the_reference_system_is_a_code(shared_data: Path, name: str, crs: str | None) -> None:
    assert read_cloud(shared_data / name).crs == crs


def test_a_skeleton_of_2021_is_called_one(shared_data: Path) -> None:
    with pytest.raises(InputFormatError, match=r"is a skeleton .* use the cloud"):
        read_cloud(shared_data / "ls2021" / "LAS00_9_skeleton.ply")


def test_metadata_say_where_the_points_come_from(tmp_path: Path) -> None:
    file = tmp_path / "a.xyz"
    file.write_text("1.5 2.5 3.5\n2 3 4\n")
    cloud = read_cloud(str(file))
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    assert cloud.metadata == {
        "source": {"path": str(file), "sha256": digest, "points": 2},
        "crs_assumed": False,
    }
    assert cloud.origin.tolist() == [1, 2, 3]
    assert cloud.xyz.tolist() == [[0.5, 0.5, 0.5], [1, 1, 1]]


def test_rows_that_are_not_finite_stay(tmp_path: Path) -> None:
    file = tmp_path / "a.xyz"
    file.write_text("nan 2 3\n-1.5 2 3\ninf 2 3\n")
    cloud = read_cloud(file)
    assert cloud.origin.tolist() == [-2, 2, 3]
    assert np.isfinite(cloud.xyz[:, 0]).tolist() == [False, True, False]


@pytest.mark.parametrize("name", ["none.laz", "none.pdf", "none"])
def test_a_missing_file(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputMissingError, match=rf"{re.escape(name)}: there is no such file; check"):
        read_cloud(tmp_path / name)


def test_a_directory(tmp_path: Path) -> None:
    with pytest.raises(InputMissingError, match="is a directory; give the name of a file in it"):
        read_cloud(tmp_path)


def test_an_unknown_suffix_lists_the_known(tmp_path: Path) -> None:
    file = tmp_path / "tree.docx"
    file.write_text("1 2 3")
    with pytest.raises(UsageError, match=re.escape(" ".join(CLOUD_SUFFIXES))):
        read_cloud(file)


def test_a_model_is_no_cloud(tmp_path: Path) -> None:
    file = tmp_path / "oak.qsm.csv"
    file.write_text("1,2,3\n")
    with pytest.raises(InputFormatError, match="is a model of a tree, not a cloud"):
        read_cloud(file)


@pytest.mark.parametrize("suffix", CLOUD_SUFFIXES)
def test_an_empty_file(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"empty{suffix}"
    file.touch()
    with pytest.raises(InputFormatError, match=r"0 bytes.*copy or export it again"):
        read_cloud(file)


@pytest.mark.parametrize("suffix", [".las", ".laz", ".ply", ".pcd"])
def test_text_under_a_binary_suffix(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"wrong{suffix}"
    file.write_text("1 2 3\n" * 100)
    with pytest.raises(InputFormatError, match=rf"wrong{suffix}: .*copy or export it again"):
        read_cloud(file)


def test_e57_names_its_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pye57", None)
    file = tmp_path / "scan.e57"
    file.write_bytes(b"ASTM-E57")
    with pytest.raises(MissingExtraError, match=re.escape('pip install "treepipe[e57]"')):
        read_cloud(file)
