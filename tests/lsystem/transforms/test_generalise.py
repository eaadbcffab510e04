"""Generalising: tails alone are averaged, on the sphere, and everything before them stays."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from pipeline.errors import ModelError
from pipeline.lsystem import LsystemOptions, decode, encode, expand, read_lsjson, write_lsjson
from pipeline.lsystem.document import checked
from pipeline.lsystem.transforms.averages import best_turns
from pipeline.lsystem.transforms.generalise import GeneraliseOptions, deviation, generalise
from pipeline.lsystem.transforms.subtrees import symbols_beside, told_in
from pipeline.model import TreeModel
from tests.lsystem.test_encode import hostile_trees
from tests.lsystem.test_twins_of_2021 import read_twin
from tests.pace import first_nodes, slowdown

Maker = Callable[..., TreeModel]
OPTIONS = st.builds(
    GeneraliseOptions, steps=st.integers(1, 10), rules=st.sampled_from((1, 2, 5, 512)), seed=st.just(0)
)


def document_of(axiom: str, **keys: Any) -> dict[str, Any]:
    return {
        "format": {"name": "lsjson", "version": 1},
        "axiom": axiom,
        "trunk": {"anchor": [0, 0, 0], "radius": 0.1},
        **keys,
    }


def expanded(document: dict[str, Any]) -> str:
    sheet = checked(document)
    return expand(sheet.axiom, sheet.rules, sheet.applications)


@settings(max_examples=200)
@given(hostile_trees(), OPTIONS)
def test_all_but_the_tails_stays_where_it_was(tree: TreeModel, options: GeneraliseOptions) -> None:
    before = encode(tree)
    after = generalise(before, options=options)
    assert checked(after).recursions == 1
    one, two = told_in(before), told_in(after)
    assert np.array_equal(one.path.parent, two.path.parent)
    assert np.array_equal(decode(before).skeleton.parent, decode(after).skeleton.parent)
    moved = (one.path.xyz != two.path.xyz).any(axis=1)
    children = np.bincount(one.path.parent[1:], minlength=len(moved))
    depth = np.zeros(len(moved), dtype=int)  # steps to the tip of an unforked tail
    for node in range(len(moved) - 1, 0, -1):
        foot = one.path.parent[node]
        depth[foot] = depth[node] + 1 if children[foot] == 1 else 99
    assert (depth[moved] < options.steps).all()
    assert not moved[0]
    start = int(decode(before).skeleton.continuation[0]) if len(moved) > 1 else 0
    assert np.array_equal(decode(before).skeleton.world[start], decode(after).skeleton.world[start])


@settings(max_examples=100)
@given(hostile_trees(), OPTIONS)
def test_length_is_kept_and_the_file_is_no_longer(tree: TreeModel, options: GeneraliseOptions) -> None:
    before = encode(tree)
    after = generalise(before, options=options)
    lengths = [decode(document).skeleton.length for document in (before, after)]
    assert lengths[1].sum() == pytest.approx(lengths[0].sum(), abs=1e-6 * len(tree))
    size = len(after["axiom"].encode()) + sum(len(s.encode()) + len(t) + 8 for s, t in after["rules"].items())
    assert size <= len(before["axiom"])


@settings(max_examples=100)
@given(hostile_trees(), OPTIONS)
def test_it_does_not_matter_whether_it_is_done_once_or_twice(
    tree: TreeModel, options: GeneraliseOptions
) -> None:
    once = generalise(encode(tree), options=options)
    if options.rules == 1:
        again = generalise(once, options=options)
        assert deviation(once, again)["deviation_m"]["max"] <= 0.01
    assert once == generalise(encode(tree), options=options)


@settings(max_examples=100)
@given(hostile_trees(), OPTIONS)
def test_sources_follow_their_nodes(tree: TreeModel, options: GeneraliseOptions) -> None:
    before = encode(tree)
    after = generalise(before, options=options)
    one, two = decode(before), decode(after)
    changed = one.radius_source != two.radius_source
    assert (one.radius_source[changed] == 0).all()
    assert (two.radius_source[changed] == 1).all()
    if not after["rules"]:
        assert not changed.any()


def test_tails_of_one_length_become_one_symbol() -> None:
    before = document_of("-(90)F(2)[+(30)F(0.5)][+(30)F(0.7)]F(1)[+(30)F(0.6)]F(1)+(30)F(0.8)")
    after = generalise(before)
    assert after["rules"] == {"X": "+(30)F(0.65)"}
    assert after["axiom"] == "-(90)F(2)[X][X]F(1)[X]F(1)X"


def test_a_tail_shorter_than_the_steps_is_averaged_by_its_own_length() -> None:
    one, two, three = (f"{'+(30)F(0.5)+(10)F(0.4)+(10)F(0.3)'[:end]}" for end in (11, 22, 33))
    axis = "-(90)F(2)[{0}][{1}][{2}]F(1)[{0}][{1}]F(1)[{0}][{0}]"
    after = generalise(document_of(axis.format(one, two, three)), options=GeneraliseOptions(steps=10))
    assert after["rules"] == {"X": one, "Y": two}  # one tail of three steps is no average
    assert after["axiom"] == axis.format("X", "Y", three)


@pytest.mark.parametrize("steps", [1, 2, 3, 10])
def test_no_limb_is_turned(steps: int) -> None:
    # In 2021 such limbs turned at two steps, since a twig of one step sprouts from them.
    limbs = [f"[+(60)>({roll})F(5)[+(30)F(0.2)][+(30)>(90)F(0.2)]]" for roll in (0, 100, 250)]
    before = document_of("-(90)F(2)" + "".join(limbs))
    after = generalise(before, options=GeneraliseOptions(steps=steps))
    assert after["rules"]
    length = told_in(before).path.length
    apart = np.linalg.norm(told_in(before).path.xyz - told_in(after).path.xyz, axis=1)
    assert (apart[length > 1] == 0).all()
    assert 0 < apart.max() < 0.4


def test_the_main_axis_keeps_its_first_step() -> None:
    pole = "-(90)F(2)" + "+(1)F(1)" * 3
    assert generalise(document_of(pole), options=GeneraliseOptions(steps=10))["axiom"] == pole
    # Of stems on one foot the heaviest is the axis, and stays.
    stems = document_of("[-(90)F(1)][-(80)F(9)][-(95)F(1)][-(100)F(1)]")
    after = generalise(stems, options=GeneraliseOptions(steps=3))
    assert after["axiom"] == "[X][-(80)F(9)][X][X]"


@pytest.mark.parametrize(
    ("turns", "average"),
    [
        (("+(350)", "+(10)"), ""),
        (("+(170)", "-(170)"), "-(180)"),
        ((">(350)", ">(10)"), ""),
        ((">(100)", ">(80)"), ">(90)"),
        (("<(175)", ">(175)"), "-(180)"),  # the same as a roll of 180
        (("+(40)", "+(140)>(180)"), "+(40)"),  # past the vertical: another way to the same heading
    ],
)
def test_averages_wrap_around(turns: tuple[str, str], average: str) -> None:
    before = document_of("F(2)" + "".join(f"[{turn}F(1)]" for turn in turns * 4))
    assert list(generalise(before)["rules"].values()) == [f"{average}F(1)"]
    after = generalise(before, options=GeneraliseOptions(rules=2))
    assert deviation(before, after)["deviation_m"]["max"] < 1e-9  # two rules for two turns


def test_a_vertical_twig_needs_no_roll() -> None:
    axiom = "-(90)F(1)" + "[>(20)F(1)][>(70)F(1)]" * 5
    assert generalise(document_of(axiom))["rules"] == {"X": "F(1)"}


@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_the_best_turn_is_the_best(seed: int) -> None:
    random = np.random.default_rng(seed)
    rot, wish = random.uniform(-np.pi, np.pi, 6), random.normal(size=(6, 3))
    c, s = np.cos(rot), np.sin(rot)
    x, y, z = wish.T
    sums = np.array([part.sum() for part in (c * x, c * y, -s * x, -s * y, -s * z, -c * z)])

    def fit(rotation: Any, roll: Any) -> Any:
        angle = rot + np.asarray(rotation)[..., None]
        ahead = np.cos(np.asarray(roll))[..., None] * x + np.sin(np.asarray(roll))[..., None] * y
        return (np.cos(angle) * ahead - np.sin(angle) * z).sum(axis=-1)

    best = fit(*best_turns(sums[:, None])[0])
    grid = np.deg2rad(np.arange(0, 360, 3))
    assert best >= fit(*np.meshgrid(grid, grid)).max() - 1e-9


def test_more_rules_come_closer(bush: TreeModel) -> None:
    document = encode(bush, options=LsystemOptions(radii="none"))
    means = [
        deviation(document, generalise(document, options=GeneraliseOptions(steps=2, rules=rules)))
        for rules in (1, 4, 16, 64)
    ]
    spread = [figures["generalised_deviation_m"]["mean"] for figures in means]
    assert spread == sorted(spread, reverse=True)
    assert spread[-1] < 0.5 * spread[0]


def test_as_many_rules_as_can_be_have_their_own_symbols(bush: TreeModel, tmp_path: Path) -> None:
    document = generalise(encode(bush), options=GeneraliseOptions(steps=10, rules=256))
    assert len(document["rules"]) > 200
    assert all(len(symbol) == 1 and symbol not in "FeE" for symbol in document["rules"])
    write_lsjson(document, tmp_path / "many.ls.json")
    back = read_lsjson(tmp_path / "many.ls.json")
    assert back == document
    assert len(decode(back)) == len(bush)


def test_there_are_symbols_enough() -> None:
    letters = list(symbols_beside("F(1e-05)XYZ"))
    assert len(letters) == len(set(letters)) > 512 * 10
    assert not {"X", "Y", "Z", "e", "E", "F"} & set(letters)
    assert letters[0] == "A"


def test_radii_of_tails_are_averages_where_the_pipe_rule_is_far_off() -> None:
    twigs = "".join(f"[+(30)>({40 * i})!({0.004 + i / 10000:g})F(0.5)]" for i in range(9))
    after = generalise(document_of(f"-(90)!(0.1)F(2){twigs}"))
    assert after["rules"]["X"].endswith("!(0.0044)F(0.5)")
    assert decode(after).radius[2:] == pytest.approx(np.full(9, 0.0044))


def test_without_written_radii_none_are(bush: TreeModel) -> None:
    assert not any(
        "!" in text
        for text in generalise(encode(bush, options=LsystemOptions(radii="none")))["rules"].values()
    )


@pytest.mark.parametrize(
    "axiom",
    [
        "F(1)!(0.3)[F(1)][F(1)+(3)!(0.2)][ [F(1)] ]F(1)[+(2)]F(1)",
        "F [ [+F] ][Q][-F]\n[F[F[+(1)Q]F]] F F",
        "F(1)+(10)[F(1)[+(5)F(2)[-(3)F(1)]]][F(1)[+(5)F(2)[-(3)F(1)]]]-(4)F(2)",
        "F(1)[F(-1)][F(0)][+F(0)][F(-1)]F(1)",
        "!(0.1)",
        "",
    ],
)
def test_odd_texts(axiom: str) -> None:
    before = document_of(axiom)
    for steps in (1, 3):
        after = generalise(before, options=GeneraliseOptions(steps=steps))
        one, two = told_in(before), told_in(after)
        assert np.array_equal(one.path.parent, two.path.parent)
        assert len(decode(before)) == len(decode(after))
        assert decode(after).radius[0] == 0.1


def test_radians_and_rules_of_the_document() -> None:
    before = document_of("AAAA", rules={"A": "F(1)[+(0.5)F][-(0.5)F]"}, recursions=1, degrees=False)
    after = generalise(before, options=GeneraliseOptions(rules=2))
    assert deviation(before, after)["deviation_m"]["max"] < 1e-4
    assert after["degrees"] is False
    assert sorted(after["rules"].values()) == ["+(0.5)F(3)", "-(0.5)F(3)"]


def test_deviation_by_hand() -> None:
    before = document_of("-(90)F(1)[F(1)]F(2)")
    after = document_of("-(90)F(1)[X]F(2)", rules={"X": "F(1.3)"}, recursions=1)
    figures = deviation(before, after)
    assert (figures["nodes"], figures["generalised_nodes"]) == (4, 1)
    assert figures["generalised_deviation_m"] == pytest.approx(
        {"min": 0.3, "max": 0.3, "mean": 0.3, "median": 0.3, "stdev": 0}
    )
    assert figures["deviation_m"]["mean"] == pytest.approx(0.075)
    with pytest.raises(ModelError, match="4 and 2 nodes; give two documents of one tree"):
        deviation(before, document_of("F"))


def test_deviation_compares_nodes_as_told_whatever_branch_goes_on() -> None:
    before, after = document_of("F[+F(1)][-F(1.01)]"), document_of("F[+F(1.02)][-F(1.01)]")
    assert deviation(before, after)["deviation_m"]["max"] == pytest.approx(0.02)
    marked = document_of("A", rules={"A": "FB", "B": "F"}, recursions=2)
    assert deviation(marked, marked)["generalised_nodes"] == 2


def test_options_are_checked() -> None:
    for bad in ({"steps": 0}, {"steps": 11}, {"rules": 0}, {"rules": 513}):
        with pytest.raises(ValidationError):
            GeneraliseOptions(**bad)


@pytest.mark.parametrize(
    "name", ["Lille_2_lsystem", "Lille_11_lsystem", "Lille_2_lsystem_gen", "tree1_lsystem_gen_2", "in_a"]
)
def test_documents_of_2021(name: str, shared_data: Path) -> None:
    before = read_lsjson(shared_data / "ls2021" / f"{name}.json")
    after = generalise(before, options=GeneraliseOptions(steps=3, rules=4))
    assert len(decode(after)) == len(decode(before))
    assert len(after["axiom"]) < len(expanded(before))
    assert after["recursions"] == 1


def test_a_twin_of_2021(shared_data: Path) -> None:
    twin = read_twin(shared_data / "ls2021" / "Lille_2_skeleton.ply")
    before = encode(twin)
    after = generalise(before)
    assert len(after["axiom"]) <= 0.70 * len(before["axiom"])
    assert deviation(before, after)["deviation_m"]["median"] <= 0.005
    small = encode(first_nodes(twin, len(twin) // 4))
    assert slowdown(generalise, small, before) < 12  # four times the nodes; 16 where it is quadratic
