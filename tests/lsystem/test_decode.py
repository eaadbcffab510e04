"""Reading: the convention of 2021 by hand-computed trees, and errors that say where."""

from __future__ import annotations

from math import cos, radians, sin
from typing import Any

import numpy as np
import pytest

from pipeline.errors import InputFormatError
from pipeline.lsystem import decode, encode
from pipeline.model import PROPAGATED, TreeModel


def sheet(axiom: str, **keys: Any) -> dict[str, Any]:
    """Return a document of 2021 with this axiom."""
    return {
        "axiom": axiom,
        "rules": {},
        "recursions": 0,
        "trunk": {"anchor": [10, 20, 30], "radius": 0.5},
        "dimensions": {"forward": 3, "rotation": 22.5, "roll": 20},
        "degrees": True,
        **keys,
    }


def nodes(axiom: str, **keys: Any) -> np.ndarray:
    return decode(sheet(axiom, **keys)).skeleton.xyz


def test_the_turtle_starts_along_x() -> None:
    assert nodes("F(2)").tolist() == [[0, 0, 0], [2, 0, 0]]


def test_a_negative_rotation_goes_up() -> None:
    assert nodes("-(90)F(2)")[1] == pytest.approx([0, 0, 2])
    assert nodes("+(270)F(2)")[1] == pytest.approx([0, 0, 2])


def test_angles_accumulate_in_two_sums() -> None:
    expected = [cos(radians(-40)) * cos(radians(70)), cos(radians(-40)) * sin(radians(70)), sin(radians(40))]
    for axiom in ("-(40)>(70)F(1)", ">(70)-(40)F(1)", "+(10)>(100)-(50)<(30)F(1)"):
        assert nodes(axiom)[1] == pytest.approx(expected)


def test_symbols_without_a_value_take_the_dimensions() -> None:
    assert nodes("-F") == pytest.approx(nodes("-(22.5)F(3)"))
    assert nodes(">+F()") == pytest.approx(nodes(">(20)+(22.5)F(3)"))


def test_radians() -> None:
    assert nodes("-(0.5)F(1)", degrees=False)[1] == pytest.approx([cos(0.5), 0, sin(0.5)])


def test_brackets_restore_position_and_angles() -> None:
    xyz = nodes("F(1)[-(90)F(1)]F(1)")
    assert xyz == pytest.approx(np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 0, 1]]))


def test_what_stands_outside_brackets_continues_the_branch() -> None:
    skeleton = decode(sheet("F(1)[-(90)F(9)F(9)]F(1)")).skeleton
    assert skeleton.parent.tolist() == [-1, 0, 1, 1, 3]
    assert skeleton.branch.tolist() == [0, 0, 0, 1, 1]


def test_where_all_is_bracketed_the_longest_child_continues() -> None:
    skeleton = decode(sheet("F(1)[-(90)F(1)][F(1)[F(1)]]")).skeleton
    assert skeleton.parent.tolist() == [-1, 0, 1, 2, 1]
    assert skeleton.xyz[3] == pytest.approx([3, 0, 0])
    assert skeleton.branch.tolist() == [0, 0, 0, 0, 1]


def test_every_f_is_a_node() -> None:
    assert len(nodes("FFF")) == 4


def test_a_nesting_without_f_is_dropped() -> None:
    assert nodes("F(1)[X][+(90)[>]]F(1)").tolist() == nodes("F(1)F(1)").tolist()


def test_letters_that_move_nothing_are_passed_over() -> None:
    assert nodes("AF(1)B(3)F(1)").tolist() == nodes("F(1)F(1)").tolist()


def test_rules_of_2021_apply_once_where_recursions_is_0() -> None:
    assert len(nodes("F(1)[X][X]", rules={"X": "F(1)F(1)"})) == 6
    assert len(nodes("F(1)[X]", rules={"X": "F(1)"}, format={"name": "lsjson", "version": 1})) == 2
    assert len(nodes("F", rules={"F": "FF"}, recursions=3)) == 9


def test_radii_of_2021_follow_the_pipe_rule_from_the_trunk() -> None:
    tree = decode(sheet("F(1)[F(1)]F(2)"))
    # Carried: 4 m at the root and the first segment, 2 m on the stem above, 1 m in the branch.
    assert tree.radius == pytest.approx([0.5, 0.5, 0.5 * 0.5**0.5, 0.25])
    assert (tree.radius_source == PROPAGATED).all()
    assert np.isnan(tree.radius_rmse).all()


def test_a_written_radius_holds_for_what_it_carries() -> None:
    tree = decode(sheet("F(1)!(0.1)F(1)F(2)"))
    assert tree.radius == pytest.approx([0.5, 0.5, 0.1, 0.1 * (2 / 3) ** 0.5])


def test_the_anchor_is_the_origin() -> None:
    skeleton = decode(sheet("F")).skeleton
    assert skeleton.origin.tolist() == [10, 20, 30]
    assert skeleton.xyz[0].tolist() == [0, 0, 0]


@pytest.mark.parametrize(
    ("axiom", "words"),
    [
        ("F(1)F(1", r"'\(1' at character 5 is not part of an L-string"),
        ("F(1)7F(1)", "'7F' at character 4|'7F.1.' at character 4"),
        ("F(1)&(3)F", "at character 4 is not part"),
        ("F(1)+(abc)F(1)", r"the value of '\+\(abc\)F\(1\)' at character 4 is not a finite number"),
        ("F(nan)", "at character 0 is not a finite number"),
        ("F(1)+(inf)F", "at character 4 is not a finite number"),
        ("F(1)]F(1)", r"the bracket '\]F\(1\)' at character 4 has no partner; balance"),
        ("F(1)[F(1)[F(1)]", r"bracket '\[F\(1\)\[F\(1\)\]' at character 4 has no partner"),
        ("F(1)!F(1)", r"'!F\(1\)' at character 4 is no radius; write !\(r\)"),
        ("F(1)!(-2)F(1)", "at character 4 is no radius"),
        ("F(1e308)F(1e308)", "add up to more than a number holds"),
        ("[(3)F]", "at character 0 is not part"),
    ],
)
def test_errors_say_where(axiom: str, words: str) -> None:
    with pytest.raises(InputFormatError, match=words):
        decode(sheet(axiom))


def test_sources_must_count_the_nodes(bush: TreeModel) -> None:
    document = encode(bush)
    document["radius"]["source"] = "m12"
    with pytest.raises(
        InputFormatError, match="counts 12 nodes where the L-string has 20000; write the file anew"
    ):
        decode(document)
    document["radius"]["source"] = "x12"
    with pytest.raises(InputFormatError, match="runs of m, p and a"):
        decode(document)
