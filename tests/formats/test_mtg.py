"""MTG: the lines by hand, round trips, other programs' graphs, broken ones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.formats import mtg
from pipeline.model import Skeleton, TreeModel
from tests.formats.exchanged import assert_named, assert_same, damaged, draws, junk, random_tree

GRAPH = """\
MTG:
ENTITY-CODE		XX	YY	ZZ	TopDia
/P1
^/N0		121913.500000	487434.900000	-0.300000	0.200000
	+N5	121913.700000	487434.900000	-0.100000	0.004000
^<N1		121913.500000	487434.900000	0.700000	0.180000
	+N3	121914.100000	487434.900000	1.000000	0.060000
	^<N4	121913.733333	487435.300000	1.000000	0.006667
^<N2		121913.600000	487434.900000	1.700000	0.020000
"""

FOREIGN = """\
# digitised
CODE :	FORM-A
CLASSES :
SYMBOL	SCALE	DECOMPOSITION	INDEXATION	DEFINITION
$	0	FREE	FREE	IMPLICIT
P	1	FREE	FREE	EXPLICIT
A	2	<-LINEAR	FREE	EXPLICIT
U	3	NONE	FREE	EXPLICIT   # growth units
DESCRIPTION :
LEFT	RIGHT	RELTYPE	MAX
U	U	+	?
FEATURES :
NAME	TYPE
XX	REAL
YY	REAL
ZZ	REAL
radius	REAL
MTG :
ENTITY-CODE				XX	YY	ZZ	radius
/P1
	/A1
	^/U1			0	0	0	.3
	^<U2			0	0	1	.2
		+A2
		^/U1		1	0	1	.1
		^<U2		1	0	5	.1
	^<U3			0	0	2	.1

# the end
"""


def test_every_line_is_as_described(tree: TreeModel, tmp_path: Path) -> None:
    mtg.write(tree, tmp_path / "t.mtg")
    text = (tmp_path / "t.mtg").read_text()
    assert text.endswith(GRAPH)
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    titles = [line.split(":")[0] for line in lines if ":" in line]
    assert titles == ["CODE", "CLASSES", "DESCRIPTION", "FEATURES", "MTG"]
    assert lines[0] == "CODE:\tFORM-A"


def test_a_tree_comes_back(tree: TreeModel, tmp_path: Path) -> None:
    mtg.write(tree, tmp_path / "t.mtg")
    again = mtg.read(tmp_path / "t.mtg")
    assert_same(again, tree)
    assert again.skeleton.crs == "EPSG:28992"  # type: ignore[union-attr]


def test_a_graph_with_axes_between_plant_and_node(tmp_path: Path) -> None:
    """The stem goes on as its ``<`` say, though the branch is longer; indices that repeat say nothing."""
    (tmp_path / "t.mtg").write_text(FOREIGN)
    read = mtg.read(tmp_path / "t.mtg")
    assert isinstance(read, TreeModel)
    assert read.skeleton.world[:, 2].tolist() == [0, 1, 2, 1, 5]
    assert read.skeleton.parent.tolist() == [-1, 0, 1, 1, 3]
    assert read.radius.tolist() == [0.3, 0.2, 0.1, 0.1, 0.1]


def test_without_a_thickness_it_is_a_skeleton(tmp_path: Path) -> None:
    (tmp_path / "t.mtg").write_text(FOREIGN.replace("radius", "leaves"))
    read = mtg.read(tmp_path / "t.mtg")
    assert isinstance(read, Skeleton)
    assert np.array_equal(read.parent, [-1, 0, 1, 1, 3])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is empty"),
        ("CODE: FORM-A\n", "ends without the sections CLASSES, FEATURES, MTG"),
        (FOREIGN.replace("FORM-A", "FORM-B"), "line 2 names another form"),
        (FOREIGN.replace("ENTITY-CODE", "CODES"), "line 18 is not followed by ENTITY-CODE"),
        (FOREIGN.replace("ZZ\tradius", "Z\tradius"), "line 19 lacks the features ZZ"),
        (FOREIGN[: FOREIGN.index("/P1")], "line 19 is the last of the header, and no vertex"),
        (FOREIGN.replace("^<U3", "<<<U3"), "line 27 has the entity '<<<U3'"),
        (FOREIGN.replace("^<U3", "^<<U3"), "line 27 has '\\^<<U3', several nodes"),
        (FOREIGN.replace("^<U3", "^<U3<U4"), "line 27 has '\\^<U3<U4', several nodes"),
        (FOREIGN.replace("^<U3\t\t\t0", "^<U3\t\t\teast"), "line 27 has the XX 'east'"),
        (FOREIGN.replace("^<U3\t\t\t0", "^<U3\t\t\t0,5"), "line 27 has the XX '0,5'.*with a point"),
        (FOREIGN.replace("^<U3\t\t\t0", "^<U3\t\t\tnan"), "line 27 has the XX nan"),
        (FOREIGN.replace("0\t0\t2\t.1", "0\t0"), "line 27 has the ZZ ''"),
        (FOREIGN.replace("0\t0\t2\t.1", "0\t0\t2\t-1"), "line 27 has the radius -1"),
        (FOREIGN.replace("^<U3", "/U3"), "line 27 has no parent, but neither has line 22"),
        (
            FOREIGN.replace("1\tFREE", "one\tFREE").replace("2\t<", "two\t<").replace("3\tN", "x\tN"),
            "no class",
        ),
    ],
)
def test_broken_graphs_are_named_with_line_and_remedy(tmp_path: Path, text: str, says: str) -> None:
    assert_named(mtg.read, tmp_path / "t.mtg", text, says)


@settings(max_examples=50)
@given(drawn=draws, wide=st.integers(1, 6))
def test_any_tree_comes_back(tmp_path_factory: pytest.TempPathFactory, drawn: list[int], wide: int) -> None:
    path, tree = tmp_path_factory.mktemp("mtg") / "t.mtg", random_tree(drawn, wide)
    mtg.write(tree, path)
    assert_same(mtg.read(path), tree)


@settings(max_examples=100)
@given(junk=junk, place=st.integers(0, 700))
def test_damage_gives_an_error_or_a_tree(
    tmp_path_factory: pytest.TempPathFactory, junk: bytes, place: int
) -> None:
    path = tmp_path_factory.mktemp("mtg") / "t.mtg"
    path.write_text(FOREIGN)
    damaged(mtg.read, path, junk, place)
