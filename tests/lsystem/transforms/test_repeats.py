"""Repeats: what is the same within a tolerance is told once, and nothing leaves the tolerance."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.lsystem import LsystemOptions, decode, encode, expand, max_error, read_lsjson, write_lsjson
from pipeline.lsystem.document import checked
from pipeline.lsystem.transforms.factoring import Classes, factored, written_bytes
from pipeline.lsystem.transforms.generalise import GeneraliseOptions, deviation, generalise
from pipeline.lsystem.transforms.repeats import RepeatsOptions, repeats
from pipeline.lsystem.transforms.subtrees import rewritten, told_in
from pipeline.model import Skeleton, TreeModel
from tests.lsystem.test_encode import hostile_trees
from tests.lsystem.test_twins_of_2021 import read_twin
from tests.lsystem.transforms.test_generalise import document_of, expanded
from tests.pace import first_nodes, slowdown

Maker = Callable[..., TreeModel]
RECURSIVE = document_of("F", rules={"F": "F[+F]F[-F]F"}, recursions=4)
"""The recursive example of 2021."""


def size_of(document: dict[str, Any]) -> int:
    return written_bytes(document["axiom"], document.get("rules", {}))


@st.composite
def repetitive_trees(draw: st.DrawFn) -> TreeModel:
    """Hostile trees that carry copies of one another, shaken by a few millimetres."""
    seed = draw(st.integers(0, 2**32 - 1))
    shake = draw(st.sampled_from((0.0, 0.001, 0.01)))
    twig, rng = draw(hostile_trees()), np.random.default_rng(seed)
    xyz, parent, radius = [np.zeros((1, 3))], [np.array([-1])], [np.array([0.05])]
    for copy in range(draw(st.integers(2, 5))):
        foot = copy * (len(twig) - 1)
        places = (twig.skeleton.xyz - twig.skeleton.xyz[0])[1:]
        xyz.append(xyz[0][0] + places + rng.normal(0, shake, places.shape))
        parent.append(np.where(twig.skeleton.parent[1:] == 0, 0, twig.skeleton.parent[1:] + foot))
        radius.append(twig.radius[1:])
    count = sum(map(len, xyz))
    skeleton = Skeleton(np.vstack(xyz), np.concatenate(parent), np.array([1e5, 4e5, 1.0]))
    source = rng.integers(0, 3, count).astype(np.uint8)
    return TreeModel(skeleton, np.concatenate(radius), source, np.full(count, np.nan))


@settings(max_examples=200)
@given(
    st.one_of(hostile_trees(), repetitive_trees()),
    st.sampled_from((0.0, 1e-6, 0.001, 0.005, 0.1, 1.0)),
    st.sampled_from(("none", "exceptions", "all")),
)
def test_no_node_and_no_radius_leaves_its_tolerance(tree: TreeModel, tolerance: float, radii: str) -> None:
    before = encode(tree, options=LsystemOptions(radii=radii))
    after = repeats(before, options=RepeatsOptions(tolerance_m=tolerance))
    checked(after)
    assert size_of(after) <= size_of(before)
    one, two = decode(before), decode(after)
    assert max_error(one, after) <= tolerance + 1e-9
    assert np.array_equal(one.skeleton.branch, two.skeleton.branch)
    assert np.array_equal(one.radius_source, two.radius_source)
    if radii != "none":
        assert np.abs(one.radius - two.radius).max() <= 0.001 + 1e-9


@settings(max_examples=100)
@given(st.one_of(hostile_trees(), repetitive_trees()))
def test_without_a_tolerance_the_text_is_the_same(tree: TreeModel) -> None:
    before = encode(tree)
    assert expanded(repeats(before, options=RepeatsOptions(tolerance_m=0))) == before["axiom"]


@settings(max_examples=50)
@given(repetitive_trees())
def test_rules_pay(tree: TreeModel) -> None:
    told = told_in(encode(tree))
    classes = Classes(told)
    axiom, rules = factored(classes, classes.of_node[0])
    for name in rules:
        spelled = [text.replace(name, rules[name]) for text in (axiom, *rules.values())]
        kept = {n: t for n, t in zip(rules, spelled[1:], strict=True) if n != name}
        assert written_bytes(axiom, rules) < written_bytes(spelled[0], kept)


@pytest.mark.parametrize("tolerance", [0, 0.005])
def test_a_tree_made_by_rules_is_seen_through(tolerance: float) -> None:
    before = encode(decode(RECURSIVE))
    after = repeats(before, options=RepeatsOptions(tolerance_m=tolerance))
    assert size_of(after) < 0.2 * size_of(before)
    assert after["recursions"] > 1  # rules within rules
    assert deviation(before, after)["deviation_m"]["max"] == 0
    deeper = encode(decode({**RECURSIVE, "recursions": 6}))
    assert size_of(repeats(deeper)) < 0.05 * size_of(deeper)


def test_forked_sub_trees_by_hand() -> None:
    limb = "[+(30)F(1)[+(40)F(0.2)]-(10)F(0.7)]"
    before = document_of(f"-(90)F(2){limb}>(90)F(1){limb}<(40)F(1){limb}")
    after = repeats(before, options=RepeatsOptions(tolerance_m=0))
    assert after["axiom"] == "-(90)F(2)[X]>(90)F(1)[X]<(40)F(1)[X]"
    assert (after["rules"], after["recursions"]) == ({"X": limb[1:-1]}, 1)


def test_sub_trees_that_are_alike_share_a_rule() -> None:
    near = document_of("-(90)F(2)" + "".join(f"[+(30)F(1)-(10)F(0.70{i})]" for i in range(6)) + "F(2)")
    after = repeats(near, options=RepeatsOptions(tolerance_m=0.003))
    assert len(after["rules"]) in (1, 2)
    assert 0 < deviation(near, after)["deviation_m"]["max"] <= 0.003
    assert repeats(near, options=RepeatsOptions(tolerance_m=0))["rules"] == {}


def test_other_radii_make_another_sub_tree() -> None:
    twigs = [f"[+(30)>(20)!(0.00{i})F(1)]" for i in (3, 4, 5, 6)]
    before = document_of("-(90)F(2)" + "".join(twigs))
    assert repeats(before)["rules"] == {}
    assert repeats(document_of("-(90)F(2)" + twigs[0] * 4))["rules"] == {"X": twigs[0][1:-1]}


def test_a_document_that_cannot_be_shortened_stays() -> None:
    after = repeats({**RECURSIVE, "id": "a"})
    assert (after["axiom"], after["rules"]) == (RECURSIVE["axiom"], RECURSIVE["rules"])
    assert (after["recursions"], after["id"]) == (4, "a")
    old = {key: value for key, value in RECURSIVE.items() if key != "format"} | {"recursions": 0}
    assert repeats(old)["recursions"] == 1  # 0 says once in a file of 2021


def test_sources_follow_where_weight_decides() -> None:
    # In brackets the longest child goes on: the second before, after it the first of equals.
    before = document_of("F(1)[+(90)F(1.001)][-(90)F(1.002)]", radius={"source": "m2p1a1"})
    after = repeats(before, options=RepeatsOptions(tolerance_m=0.0))
    assert decode(before).radius_source.tolist() == [0, 0, 1, 2]
    told = told_in(before)
    other = rewritten(before, told, "F(1)[+(90)F(1.001)][-(90)F(1.001)]", {}, np.zeros(4, dtype=bool))
    assert decode(after).radius_source.tolist() == [0, 0, 1, 2]
    assert decode(other).radius_source.tolist() == [0, 0, 2, 1]


@pytest.mark.parametrize(
    "axiom",
    ["F(1)!(0.3)[F(1)][F(1)]!(0.2)[F(1)][F(1)]F(1)", "F [ [+F] ][Q][-F]\n[F[F[+(1)Q]F]] F F", "!(1)", ""],
)
def test_odd_texts(axiom: str) -> None:
    before = document_of(axiom)
    after = repeats(before, options=RepeatsOptions(tolerance_m=0.1))
    assert max_error(decode(before), after) <= 0.1
    assert np.array_equal(decode(before).radius, decode(after).radius)


def test_one_after_the_other(bush: TreeModel, tmp_path: Path) -> None:
    document = encode(bush, options=LsystemOptions(radii="none"))
    averaged = generalise(document, options=GeneraliseOptions(steps=1, rules=8))
    both = repeats(averaged, options=RepeatsOptions(tolerance_m=0.005))
    assert size_of(both) <= size_of(averaged)
    assert deviation(averaged, both)["deviation_m"]["max"] <= 0.005 + 1e-9
    again = generalise(repeats(document), options=GeneraliseOptions(steps=1, rules=8))
    assert len(decode(again)) == len(bush)
    write_lsjson(both, tmp_path / "both.ls.json")
    assert read_lsjson(tmp_path / "both.ls.json") == both


@pytest.mark.parametrize(("name", "most"), [("in_a", 1.0), ("Lille_2_lsystem", 0.85)])
def test_documents_of_2021(name: str, most: float, shared_data: Path) -> None:
    before = read_lsjson(shared_data / "ls2021" / f"{name}.json")
    after = repeats(before, options=RepeatsOptions(tolerance_m=0.02))
    assert size_of(after) <= most * size_of(before)
    assert deviation(before, after)["deviation_m"]["max"] <= 0.02 + 1e-9


def test_a_twin_of_2021(shared_data: Path) -> None:
    before = encode(read_twin(shared_data / "ls2021" / "Lille_2_skeleton.ply"))
    after = repeats(before, options=RepeatsOptions(tolerance_m=0.02))
    assert size_of(after) < 0.85 * size_of(before)
    assert expand(after["axiom"], after["rules"], 1).count("F") == 19_501


def test_the_cost_follows_the_nodes(shared_data: Path) -> None:
    twin = read_twin(shared_data / "ls2021" / "Lille_2_skeleton.ply")
    small, large = (encode(first_nodes(twin, count)) for count in (2400, 9600))
    options = RepeatsOptions(tolerance_m=0.02)
    ratio = slowdown(lambda document: repeats(document, options=options), small, large)
    assert ratio < 12  # four times the nodes; 16 where it is quadratic
