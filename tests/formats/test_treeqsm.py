"""TreeQSM's cylinders in text: 15 columns by hand, round trips, its own orders, broken tables, a real one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.formats import treeqsm
from pipeline.model import TreeModel
from tests.formats.exchanged import assert_named, assert_same, damaged, junk, random_tree, scored

ROW = ".2 1 0 0 0 0 0 1 0 2 0 .21 1 0 1"
NEXT = ".1 1 0 0 1 0 0 1 1 0 0 .11 1 0 2"
SIDE = ".05 1 .2 0 .5 1 0 0 1 0 0 .06 2 1 1"
TABLE = f"{ROW}\n{NEXT}\n{SIDE}\n".replace(" ", "\t")


def test_every_column_is_where_archi_expects_it(tree: TreeModel, tmp_path: Path) -> None:
    treeqsm.write(tree, tmp_path / "t.treeqsm.txt")
    rows = [line.split("\t") for line in (tmp_path / "t.treeqsm.txt").read_text().splitlines()]
    assert {len(row) for row in rows} == {15}
    table = np.array(rows, dtype=float)
    end = table[:, 2:5] + table[:, 1:2] * table[:, 5:8]
    assert np.abs(end - tree.skeleton.world[1:]).max() < 1e-6
    assert table[:, 8].tolist() == [0, 1, 1, 3, 1]  # parent
    assert table[:, 9].tolist() == [2, 0, 4, 0, 0]  # extension
    assert table[:, 11].tolist() == pytest.approx(tree.radius[1:], abs=1e-6)
    assert table[:, 12:].tolist() == [[1, 0, 1], [1, 0, 2], [2, 1, 1], [2, 1, 2], [3, 1, 1]]
    assert np.pi * (table[:, 0] ** 2 * table[:, 1]).sum() == pytest.approx(tree.volume.sum(), rel=1e-4)


def test_a_tree_comes_back(tree: TreeModel, tmp_path: Path) -> None:
    treeqsm.write(tree, tmp_path / "t.treeqsm.txt")
    assert_same(treeqsm.read(tmp_path / "t.treeqsm.txt"), tree, radius=5e-6)


def test_treeqsm_leaves_gaps_that_are_bridged(tmp_path: Path) -> None:
    (tmp_path / "t.txt").write_text(TABLE)
    tree = treeqsm.read(tmp_path / "t.txt")
    assert [0, 0, 0.5] in tree.skeleton.world.tolist()
    assert tree.skeleton.order.max() == 1
    assert tree.radius[0] == 0.2
    assert tree.skeleton.world[-1].tolist() == [1.2, 0, 0.5]


@pytest.mark.parametrize("own", [["radius (m)\tlength (m)\tstart_point"], []])
def test_the_orders_of_treeqsm_itself(tmp_path: Path, own: list[str]) -> None:
    """Version 2.3 writes 15 columns with the links before what was added, 2.4 adds mad and SurfCov."""
    (tmp_path / "a.txt").write_text(TABLE)
    want = treeqsm.read(tmp_path / "a.txt")
    for more in ([], ["0.001", "0.9"]):
        lines = [row.split() for row in (ROW, NEXT, SIDE)]
        turned = ["\t".join([*f[:10], *f[12:], *more, *f[10:12]]) for f in lines]
        (tmp_path / "b.txt").write_text("\n".join([*own, *turned]) + "\n")
        have = treeqsm.read(tmp_path / "b.txt")
        assert have.skeleton.world.tolist() == want.skeleton.world.tolist()
        assert have.skeleton.branch.tolist() == want.skeleton.branch.tolist()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is empty"),
        ("radius (m)\n", "is the last, and no cylinder came"),
        (TABLE + "1 2 3\n", "line 4 has 3 columns, expected 15"),
        (
            TABLE.replace(".2\t1", "0,2\t1"),
            "line 1 has the radius '0,2', which is no number; write decimals with a point",
        ),
        (TABLE.replace(".05\t1", "nan\t1"), "line 3 has the radius nan"),
        (TABLE.replace(".05\t1", "-.05\t1"), "line 3 has the radius -0.05"),
        (TABLE.replace(".05\t1", ".05\t-1"), "line 3 has the length -1"),
        (TABLE.replace("1\t0\t0\t1\t0\t0\t.06", "1\t0\t0\t9\t0\t0\t.06"), "line 3 names the parent 9"),
        (TABLE.replace("1\t0\t0\t1\t0\t0\t.06", "1\t0\t0\t0\t0\t0\t.06"), "line 3 has no parent"),
        (TABLE.replace("1\t0\t0\t1\t0\t0\t.06", "1\t0\t0\t3\t0\t0\t.06"), "line 3 is its own ancestor"),
        (TABLE.replace("1\t0\t0\t1\t0\t0\t.06", "5\t0\t0\t1\t0\t0\t.06"), "line 3 has an axis of length 5"),
    ],
)
def test_broken_tables_are_named_with_line_and_remedy(tmp_path: Path, text: str, says: str) -> None:
    path = tmp_path / "t.txt"
    path.write_text(text)
    assert_named(treeqsm.read, path, text, says)


@settings(max_examples=50)
@given(drawn=st.lists(st.integers(0, 50), min_size=1, max_size=30), wide=st.integers(1, 6))
def test_any_tree_comes_back(tmp_path_factory: pytest.TempPathFactory, drawn: list[int], wide: int) -> None:
    path, tree = tmp_path_factory.mktemp("treeqsm") / "t.treeqsm.txt", random_tree(drawn, wide)
    treeqsm.write(tree, path)
    again = treeqsm.read(path)
    assert_same(again, tree, radius=1e-3)  # that of the foot follows from a volume
    assert np.abs(again.radius - tree.radius)[1:].max() <= 1e-6


@settings(max_examples=100)
@given(junk=junk, place=st.integers(0, 200))
def test_damage_gives_an_error_or_a_tree(
    tmp_path_factory: pytest.TempPathFactory, junk: bytes, place: int
) -> None:
    path = tmp_path_factory.mktemp("treeqsm") / "t.txt"
    path.write_text(TABLE)
    damaged(treeqsm.read, path, junk, place)


def test_a_model_of_treeqsm(shared_data: Path, tmp_path: Path) -> None:
    """The figures that TreeQSM gives for it: 3.899 m3, stem 2.035 m3, 320.7 m, DBH 49.4 cm, 233 branches."""
    tree = treeqsm.read(shared_data / "trees" / "archi_tree1.treeqsm.txt")
    assert len(tree.skeleton.paths) == 233
    assert tree.volume.sum() == pytest.approx(3.899, rel=0.05)
    assert tree.volume[tree.skeleton.branch == 0].sum() == pytest.approx(2.035, rel=0.02)
    assert tree.skeleton.length.sum() == pytest.approx(320.7, rel=0.05)
    told = scored(tree, shared_data / "trees" / "archi_tree1.las", tmp_path)
    assert told["dbh_cm"] == pytest.approx(49.4, rel=0.03)
    assert told["surface_median_mm"] < 25
