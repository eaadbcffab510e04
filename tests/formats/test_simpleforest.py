"""SimpleForest's cylinders: columns by name, round trips, its limbs, broken tables, a real one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.formats import simpleforest
from pipeline.model import TreeModel
from tests.formats.exchanged import assert_named, assert_same, damaged, junk, random_tree, scored

TABLE = """\
ID,parentID,branchID,branchOrder,startX,startY,startZ,endX,endY,endZ,radius,length,segmentID,parentSegmentID
0,-1,0,0,0,0,0,0,0,1,0.2,1,0,-1
1,0,0,0,0,0,1,0,0,2,0.1,1,1,0
2,0,1,1,0,0,1,1,0,1,0.05,1,2,0
3,2,1,2,1,0,1,1,0,2,0.02,1,3,2
"""


def test_columns_stand_by_their_names(tree: TreeModel, tmp_path: Path) -> None:
    simpleforest.write(tree, tmp_path / "t.csv")
    head, *rows = (tmp_path / "t.csv").read_text().splitlines()
    assert head.startswith(TABLE.splitlines()[0])
    table = dict(zip(head.split(","), np.array([r.split(",") for r in rows], dtype=float).T, strict=True))
    assert table["parentID"].tolist() == [-1, 0, 0, 2, 0]
    assert table["branchID"].tolist() == [0, 0, 1, 1, 2]
    assert table["branchOrder"].tolist() == [0, 0, 1, 1, 1]
    assert table["segmentID"].tolist() == [0, 1, 2, 2, 3]
    assert table["parentSegmentID"].tolist() == [-1, 0, 0, 0, 0]
    assert table["endZ"].tolist() == pytest.approx(tree.skeleton.world[1:, 2])
    volume = np.pi * (table["radius"] ** 2 * table["length"]).sum()
    assert volume == pytest.approx(tree.volume.sum(), rel=1e-4)


def test_a_tree_comes_back(tree: TreeModel, tmp_path: Path) -> None:
    simpleforest.write(tree, tmp_path / "t.csv")
    assert_same(simpleforest.read(tmp_path / "t.csv"), tree)


def test_shoots_share_the_number_of_their_limb(tmp_path: Path) -> None:
    (tmp_path / "t.csv").write_text(TABLE)
    read = simpleforest.read(tmp_path / "t.csv")
    assert read.skeleton.parent.tolist() == [-1, 0, 1, 1, 3]
    assert read.skeleton.branch.tolist() == [0, 0, 0, 1, 1]  # a branch ends where nothing goes on
    assert read.radius.tolist() == pytest.approx([0.2, 0.15, 0.1, 0.05, 0.02])


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_order_spaces_and_marks_do_not_matter(tmp_path: Path, end: str) -> None:
    (tmp_path / "a.csv").write_text(TABLE)
    rows = [[*reversed(line.split(","))] for line in TABLE.splitlines()]
    turned = end.join(" " + ", ".join(row) for row in [rows[0], *reversed(rows[1:])])
    (tmp_path / "b.csv").write_bytes(b"\xef\xbb\xbf" + turned.encode())
    one, other = (simpleforest.read(tmp_path / name) for name in ("a.csv", "b.csv"))
    assert one.skeleton.world.tolist() == other.skeleton.world.tolist()
    assert one.radius.tolist() == other.radius.tolist()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is empty"),
        (TABLE.splitlines()[0], "line 1 is the header, and no cylinder follows"),
        (TABLE.replace("branchID", "branch"), "line 1 lacks the columns branchID"),
        (TABLE.replace(",", ";"), "line 1 lacks the columns .*separate columns by commas"),
        (TABLE.replace("0.05,1,2", '0,05,1,2'), "line 4 has 15 columns, expected 14"),
        (TABLE.replace("0.05,", "thick,"), "line 4 has the radius 'thick'"),
        (TABLE.replace("0.05,", "nan,"), "line 4 has the radius nan"),
        (TABLE.replace("0.05,", "-1,"), "line 4 has the radius -1"),
        (TABLE.replace("\n2,0,", "\n2,9,"), "line 4 names the parent 9"),
        (TABLE.replace("\n2,0,", "\n2,-1,"), "line 4 has no parent, but neither has line 2"),
        (TABLE.replace("\n2,0,", "\n2,3,"), "line 4 is its own ancestor"),
        (TABLE.replace("\n2,0,", "\n1,0,"), "line 4 has the number 1"),
        (TABLE.replace("\n2,0,", "\n2.5,0,"), "line 4 has the ID 2.5, which is not whole"),
        (TABLE + "4," + "7" * 1_000_000, "line 6 has 2 columns"),
    ],
)  # fmt: skip
def test_broken_tables_are_named_with_line_and_remedy(tmp_path: Path, text: str, says: str) -> None:
    assert_named(simpleforest.read, tmp_path / "t.csv", text, says)


@settings(max_examples=50)
@given(drawn=st.lists(st.integers(0, 50), min_size=1, max_size=30), wide=st.integers(1, 6))
def test_any_tree_comes_back(tmp_path_factory: pytest.TempPathFactory, drawn: list[int], wide: int) -> None:
    path, tree = tmp_path_factory.mktemp("sf") / "t.csv", random_tree(drawn, wide)
    simpleforest.write(tree, path)
    assert_same(simpleforest.read(path), tree)


@settings(max_examples=100)
@given(junk=junk, place=st.integers(0, 300))
def test_damage_gives_an_error_or_a_tree(
    tmp_path_factory: pytest.TempPathFactory, junk: bytes, place: int
) -> None:
    path = tmp_path_factory.mktemp("sf") / "t.csv"
    path.write_text(TABLE)
    damaged(simpleforest.read, path, junk, place)


def test_a_model_of_simpleforest(shared_data: Path, tmp_path: Path) -> None:
    """The sums of its own columns: 29.97 L, 31.43 m; 68 branches start on another."""
    tree = simpleforest.read(shared_data / "trees" / "rtwig_coffeetree.simpleforest.csv")
    assert len(tree) == 1150
    assert len(tree.skeleton.paths) == 69
    assert 1000 * tree.volume.sum() == pytest.approx(29.97, rel=0.01)
    assert tree.skeleton.length.sum() == pytest.approx(31.426, rel=1e-4)
    told = scored(tree, shared_data / "trees" / "rtwig_coffeetree.txt", tmp_path)
    assert told["surface_mean_mm"] < 4
