"""The tree file of raycloudtools: the line by hand, round trips, its variants, broken files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.formats import treefile
from pipeline.model import TreeModel
from tests.formats.exchanged import assert_named, assert_same, damaged, draws, junk, random_tree

HEAD = "x,y,z,radius,parent_id,section_id"
ROOT = "0,0,0,0.3,-1,0"
FOREIGN = f"# Tree file.\n{HEAD}\n{ROOT}, 0,0,1,0.3,0,1, 1,0,1,0.1,1,2, 0,0,3,0.2,1,3\n"


def test_one_tree_a_line_segments_after_commas(tree: TreeModel, tmp_path: Path) -> None:
    treefile.write(tree, tmp_path / "t.treefile.txt")
    *comments, head, line = (tmp_path / "t.treefile.txt").read_text().splitlines()
    assert all(comment.startswith("#") for comment in comments)
    assert "# crs: EPSG:28992" in comments
    assert head == HEAD
    segments = line.split(", ")
    assert segments[0] == "121913.500000,487434.900000,-0.300000,0.100000,-1,0"
    assert segments[3] == "121914.100000,487434.900000,1.000000,0.030000,1,3"
    assert [int(s.split(",")[4]) for s in segments] == tree.skeleton.parent.tolist()


def test_its_cylinders_have_our_volume(tree: TreeModel, tmp_path: Path) -> None:
    treefile.write(tree, tmp_path / "t.treefile.txt")
    line = (tmp_path / "t.treefile.txt").read_text().splitlines()[-1]
    rows = np.array([s.split(",") for s in line.split(", ")], dtype=float)
    length = np.linalg.norm(rows[1:, :3] - rows[rows[1:, 4].astype(int), :3], axis=1)
    assert np.pi * (rows[1:, 3] ** 2 * length).sum() == pytest.approx(tree.volume.sum(), rel=1e-4)


def test_a_tree_comes_back(tree: TreeModel, tmp_path: Path) -> None:
    treefile.write(tree, tmp_path / "t.treefile.txt")
    again = treefile.read(tmp_path / "t.treefile.txt")
    assert_same(again, tree)
    assert again.skeleton.crs == "EPSG:28992"
    assert np.array_equal(again.skeleton.origin, tree.skeleton.origin)


def test_radii_that_were_changed_since_are_those_of_the_cylinders(tree: TreeModel, tmp_path: Path) -> None:
    path = tmp_path / "t.treefile.txt"
    treefile.write(tree, path)
    path.write_text(path.read_text().replace("0.030000,1,3", "0.050000,1,3"))
    again = treefile.read(path)
    assert again.radius[3] == pytest.approx((0.05 + 0.018359) / 2)
    assert again.skeleton.parent.tolist() == tree.skeleton.parent.tolist()


def test_a_file_of_raycloudtools(tmp_path: Path) -> None:
    """Nodes come level by level; the branch goes on along the longer child."""
    (tmp_path / "t.txt").write_text(FOREIGN)
    again = treefile.read(tmp_path / "t.txt")
    assert again.skeleton.world.tolist() == [[0, 0, 0], [0, 0, 1], [0, 0, 3], [1, 0, 1]]
    assert again.radius.tolist() == pytest.approx([0.3, 0.25, 0.2, 0.1])


@pytest.mark.parametrize(
    "text",
    [
        "height,crown_radius, x,y,z,radius,parent_id,weight\n9,4, 0,0,0,0.3,-1,5, 0,0,1,0.3,0,6\n",
        "x,y,z,radius,height x,y,z,radius,parent_id\n0,0,0,0.3,9, 0,0,1,0.3,0,\n",
        "x,y,z,radius,section_id,parent_id\n0,0,0,0.3,0,-1, 0,0,1,0.3,1,0\n",
    ],
)
def test_what_more_is_told_is_passed_over(tmp_path: Path, text: str) -> None:
    (tmp_path / "t.txt").write_text(text)
    again = treefile.read(tmp_path / "t.txt")
    assert again.skeleton.world.tolist() == [[0, 0, 0], [0, 0, 1]]
    assert again.skeleton.parent.tolist() == [-1, 0]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is empty"),
        ("# Tree file\n", "does not name x,y,z,radius"),
        (f"{HEAD}\n", "line 1 is the header, and no tree follows"),
        ("x,y,z,radius\n0,0,0,1\n", "line 1 does not name x,y,z,radius,parent_id"),
        (f"{HEAD}\n{ROOT}\n{ROOT}\n", "line 3 begins a second tree"),
        (f"{HEAD}\n{ROOT}, 0,0,1,0.1,0\n", "line 2 has 11 fields"),
        (f"{HEAD}\n{ROOT}, 0,0,1,0.1,7,1\n", "line 2 names the parent 7, which is not there"),
        (f"{HEAD}\n{ROOT}, 0,0,1,0.1,-1,1\n", "line 2 has no parent"),
        (f"{HEAD}\n{ROOT}, 0,0,1,0.1,2,1, 0,0,2,0.1,1,2\n", "line 2 is its own ancestor"),
        (f"{HEAD}\n{ROOT}, 0,0,nan,0.1,0,1\n", "line 2 has the z nan"),
        (f"{HEAD}\n{ROOT}, 0,0,east,0.1,0,1\n", "line 2 has the z 'east'"),
        (f"{HEAD}\n{ROOT}, 0,0,1,-0.1,0,1\n", "line 2 has the radius -0.1"),
    ],
)
def test_broken_files_are_named_with_line_and_remedy(tmp_path: Path, text: str, says: str) -> None:
    assert_named(treefile.read, tmp_path / "t.txt", text, says)


@settings(max_examples=50)
@given(drawn=draws, wide=st.integers(1, 6))
def test_any_tree_comes_back(tmp_path_factory: pytest.TempPathFactory, drawn: list[int], wide: int) -> None:
    path, tree = tmp_path_factory.mktemp("treefile") / "t.treefile.txt", random_tree(drawn, wide)
    treefile.write(tree, path)
    assert_same(treefile.read(path), tree)


@settings(max_examples=100)
@given(junk=junk, place=st.integers(0, 200))
def test_damage_gives_an_error_or_a_tree(
    tmp_path_factory: pytest.TempPathFactory, junk: bytes, place: int
) -> None:
    path = tmp_path_factory.mktemp("treefile") / "t.txt"
    path.write_text(FOREIGN)
    damaged(treefile.read, path, junk, place)
