"""SWC: a node a line by hand, round trips, other programs' files, broken ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import InputMissingError
from pipeline.formats import swc
from pipeline.model import TreeModel
from tests.formats.exchanged import assert_named, assert_same, damaged, draws, junk, random_tree

TEXT = """\
# treepipe: numbered path by path
# units: m
# crs: EPSG:28992
# origin: 121913.4 487434.9 -0.3
# id type x y z radius parent
1 0 0.100000 0.000000 0.000000 0.100000 -1
2 0 0.100000 0.000000 1.000000 0.090000 1
3 0 0.200000 0.000000 2.000000 0.010000 2
4 0 0.700000 0.000000 1.300000 0.030000 2
5 0 0.333333 0.400000 1.300000 0.003333 4
6 0 0.300000 0.000000 0.200000 0.002000 1
"""

FOREIGN = "# made elsewhere\n7 2 1 0 1 .1 3\n1 1 0 0 0 .3 -1\n3 2 0 0 1 .2 1\n9 2 0 0 3 .1 3\n"


def test_every_line_is_as_described(tree: TreeModel, tmp_path: Path) -> None:
    swc.write(tree, tmp_path / "t.swc")
    assert (tmp_path / "t.swc").read_text() == TEXT


def test_a_tree_comes_back(tree: TreeModel, tmp_path: Path) -> None:
    swc.write(tree, tmp_path / "t.swc")
    again = swc.read(tmp_path / "t.swc")
    assert_same(again, tree)
    assert again.skeleton.crs == "EPSG:28992"
    assert np.array_equal(again.skeleton.origin, tree.skeleton.origin)
    assert np.abs(again.skeleton.xyz - tree.skeleton.xyz).max() <= 0.5e-6


@pytest.mark.parametrize("end", ["\r\n", "\r"])
def test_marks_and_line_ends_do_not_matter(tree: TreeModel, tmp_path: Path, end: str) -> None:
    (tmp_path / "t.swc").write_bytes(b"\xef\xbb\xbf" + TEXT.replace("\n", end).encode())
    assert_same(swc.read(tmp_path / "t.swc"), tree)


def test_other_programs_number_as_they_like(tmp_path: Path) -> None:
    """Children may come first; the branch goes on along the longer child."""
    (tmp_path / "t.swc").write_text(FOREIGN)
    again = swc.read(tmp_path / "t.swc")
    assert again.skeleton.world.tolist() == [[0, 0, 0], [0, 0, 1], [0, 0, 3], [1, 0, 1]]
    assert again.skeleton.parent.tolist() == [-1, 0, 1, 1]
    assert again.radius.tolist() == [0.3, 0.2, 0.1, 0.1]
    assert again.skeleton.crs is None


def test_units_of_the_header_count(tmp_path: Path) -> None:
    (tmp_path / "t.swc").write_text("# units: mm\n1 0 0 0 0 5 -1\n2 0 0 0 1500 4 1\n")
    again = swc.read(tmp_path / "t.swc")
    assert again.skeleton.world[1].tolist() == [0, 0, 1.5]
    assert again.radius.tolist() == [0.005, 0.004]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is empty"),
        ("# only a header\n", "line 2 is the last, and no node came"),
        (TEXT.replace("\n3 0 ", "\n3 "), "line 8 has 6 fields, expected 7"),
        (TEXT.replace("2.000000", "2,000000"), "line 8 has the z '2,000000'.*with a point"),
        (TEXT.replace("2.000000", "nan"), "line 8 has the z nan"),
        (TEXT.replace("2.000000", "1e300"), "line 8 has the z 1e\\+300"),
        (TEXT.replace("2.000000", "x" * 1_000_000), "line 8 has the z 'xxx"),
        (TEXT.replace("0.090000 1", "-0.09 1"), "line 7 has the radius -0.09"),
        (TEXT.replace("0.090000 1", "0.090000 1.5"), "line 7 has the parent 1.5, which is not whole"),
        (TEXT.replace("0.010000 2", "0.010000 77"), "line 8 names the parent 77, which is not there"),
        (TEXT.replace("0.010000 2", "0.010000 -1"), "line 8 has no parent, but neither has line 6"),
        (TEXT.replace("0.090000 1", "0.090000 3"), "line 7 is its own ancestor"),
        (TEXT.replace("0.100000 -1", "0.100000 1"), "line 6 is its own ancestor"),
        (TEXT.replace("\n3 0", "\n2 0"), "line 8 has the number 2, which line 7 has already"),
        (TEXT.replace("# units: m", "# units: inch"), "line 2 names the unit 'inch'"),
        (TEXT.replace(" -0.3\n", "\n"), "line 4 names an origin of 2 numbers"),
        (TEXT.encode("utf-16"), "is no UTF-8 text"),
    ],
)
def test_broken_files_are_named_with_line_and_remedy(tmp_path: Path, text: str | bytes, says: str) -> None:
    assert_named(swc.read, tmp_path / "t.swc", text, says)


def test_an_absent_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputMissingError, match="no such file"):
        swc.read(tmp_path / "no.swc")


@settings(max_examples=50)
@given(drawn=draws, wide=st.integers(1, 6))
def test_any_tree_comes_back(tmp_path_factory: pytest.TempPathFactory, drawn: list[int], wide: int) -> None:
    path, tree = tmp_path_factory.mktemp("swc") / "t.swc", random_tree(drawn, wide)
    swc.write(tree, path)
    assert_same(swc.read(path), tree)


@settings(max_examples=100)
@given(junk=junk, place=st.integers(0, 400))
def test_damage_gives_an_error_or_a_tree(
    tmp_path_factory: pytest.TempPathFactory, junk: bytes, place: int
) -> None:
    path = tmp_path_factory.mktemp("swc") / "t.swc"
    path.write_text(TEXT)
    damaged(swc.read, path, junk, place)
