"""Growing by scale: each option changes what it names, and nothing else."""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from pipeline.errors import InputFormatError, UsageError
from pipeline.lsystem import LsystemOptions, decode, encode, read_lsjson, write_lsjson
from pipeline.lsystem.transforms import growing as module
from pipeline.lsystem.transforms.growing import ScaleOptions, grow
from pipeline.lsystem.transforms.sprouting import frames, positions, shoots
from pipeline.model import MEASURED, PROPAGATED, Skeleton, TreeModel, Trunk
from tests.pace import first_nodes, slowdown

Maker = Callable[..., TreeModel]
Document = dict[str, Any]
TABLE_4_5 = [958, 611, 367, 234, 157]
"""New vertices at the sprout positions 1 to 5 on the tree1 of 2021."""


@st.composite
def hostile_trees(draw: st.DrawFn) -> TreeModel:
    """Forks anywhere; steps up, down, back and of no length, in national coordinates or about zero."""
    count = draw(st.integers(1, 30))
    kinds = draw(st.lists(st.sampled_from("udbzxl"), min_size=count, max_size=count))
    onward = draw(st.sampled_from((0.5, 0.9, 1.0)))
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    xyz, step, parent = np.zeros((count, 3)), np.zeros((count, 3)), np.full(count, -1)
    for i in range(1, count):
        parent[i] = i - 1 if rng.random() < onward else rng.integers(0, i)
        length = 10 ** rng.uniform(-4, 1)
        step[i] = {
            "u": np.array([0, 0, length]),
            "d": np.array([0, 0, -length]),
            "b": -step[parent[i]],
            "z": np.zeros(3),
            "x": np.array([length, 0, 0]),
            "l": rng.normal(size=3) * length,
        }[kinds[i]]
        xyz[i] = xyz[parent[i]] + step[i]
    origin = (121913.8412, 487434.1236, -1.25) if seed % 3 else (0, 0, 0)
    return TreeModel(
        Skeleton(xyz, parent, np.array(origin), "EPSG:28992"),
        10 ** rng.uniform(-4, 0, count),
        rng.integers(0, 3, count).astype(np.uint8),
        np.full(count, np.nan),
        Trunk(0.25, 0.24, 0.26, 271.25, "measured", -0.03) if seed % 2 else None,
    )


some_options = st.builds(
    ScaleOptions,
    sprout_position=st.integers(0, 5),
    speed=st.just(0.0) | st.floats(0.1, 1),
    ratio=st.just(0.0) | st.floats(1.5, 5),
    thickness=st.just(0.0) | st.floats(0.1, 0.8),
)


@pytest.fixture(scope="module")
def oak(bush: TreeModel) -> Document:
    """A document of 1,000 nodes, with a breast height and half of its radii measured."""
    skeleton, count = bush.skeleton, 1000
    return encode(
        TreeModel(
            Skeleton(skeleton.xyz[:count], skeleton.parent[:count], np.array([1e5, 4e5, 2.5]), "EPSG:28992"),
            bush.radius[:count],
            (np.arange(count) % 4 > 1).astype(np.uint8),
            np.full(count, np.nan),
            Trunk(0.20, 0.18, 0.24, 250.0, "measured", 0.0),
            {"id": "oak 7"},
        )
    )


@pytest.fixture(scope="module")
def tree1(shared_data: Path) -> Document:
    """The tree of the report's table 4.5, whose tips alone are generalised."""
    return read_lsjson(shared_data / "ls2021" / "tree1_lsystem_gen_1.json")


def grown(document: Document, years: int = 1, **options: float) -> TreeModel:
    return decode(grow(document, years=years, options=ScaleOptions.model_validate(options)))


def kept(before: TreeModel, after: TreeModel) -> np.ndarray:
    """Return the new number of each old node, from the root up: a shoot is the last child of its foot."""
    old, new = before.skeleton, after.skeleton
    place = np.zeros(len(old), dtype=int)
    for i, below in enumerate(old.children):
        place[list(below)] = new.children[place[i]][: len(below)]
    return place


def relative_positions(skeleton: Skeleton) -> list[int]:
    """Count nodes to the tip along each branch, the plain way; at forks the largest."""
    along = [0] * len(skeleton)
    for path in skeleton.paths:
        inner = path if path[0] == 0 else path[1:]
        for distance, node in enumerate(reversed(inner.tolist())):
            along[node] = distance
    return [max((along[c] + 1 for c in below), default=0) for below in skeleton.children]


def headings(skeleton: Skeleton) -> np.ndarray:
    step = skeleton.xyz[1:] - skeleton.xyz[skeleton.parent[1:]]
    return step / skeleton.length[1:, None]


# ---- what each option does, and does not


def test_nothing_grows_unless_it_is_asked_for(oak: Document) -> None:
    assert grow(oak, years=3) == oak
    assert grow(oak, years=0, options=ScaleOptions(sprout_position=1, speed=1, ratio=5, thickness=0.8)) == oak


def test_thickness_changes_radii_alone(oak: Document) -> None:
    before, document = decode(oak), grow(oak, years=2, options=ScaleOptions(thickness=0.3))
    after = decode(document)
    assert np.array_equal(after.skeleton.xyz, before.skeleton.xyz)
    assert np.array_equal(after.skeleton.parent, before.skeleton.parent)
    assert after.radius[0] == pytest.approx(before.radius[0] * 1.69, abs=1e-4)
    assert np.abs(after.radius - before.radius * 1.69).max() < 0.0011  # the tolerance of what is written
    assert (before.radius_source == MEASURED).any()
    assert (after.radius_source == PROPAGATED).all()


def test_speed_scales_the_whole_tree(oak: Document) -> None:
    before, after = decode(oak), grown(oak, speed=0.5)
    assert np.array_equal(after.skeleton.parent, before.skeleton.parent)
    assert np.linalg.norm(after.skeleton.xyz - 1.5 * before.skeleton.xyz, axis=1).max() <= 0.0006
    assert np.abs(after.radius - before.radius).max() < 0.0011
    assert np.array_equal(after.radius_source, before.radius_source)


def test_ratio_replaces_the_speed_near_tips(oak: Document) -> None:
    old = decode(oak).skeleton
    near = np.array(relative_positions(old))[old.parent[1:]] < 4
    assert 0.2 < near.mean() < 0.8
    for speed in (0.0, 0.2):
        new = grown(oak, speed=speed, ratio=2).skeleton
        assert np.array_equal(new.parent, old.parent)
        factor = new.length[1:] / old.length[1:]
        assert np.allclose(factor[near], 2, atol=0.1)
        assert np.allclose(factor[~near], 1 + speed, atol=0.1)


def test_ratio_leaves_radii_alone(oak: Document) -> None:
    before, after = decode(oak), grown(oak, ratio=5)
    assert np.abs(after.radius - before.radius).max() < 0.0011


def test_sprouting_changes_no_segment_that_was_there(oak: Document) -> None:
    before = decode(oak)
    for position in range(1, 6):
        after = grown(oak, sprout_position=position)
        place = kept(before, after)
        assert len(after) > len(before)
        assert len(set(place.tolist())) == len(before)
        offset = after.skeleton.xyz[place] - before.skeleton.xyz
        assert np.linalg.norm(offset, axis=1).max() <= 0.0006
        assert np.abs(after.radius[place] - before.radius).max() < 0.0011
        assert np.array_equal(after.radius_source[place], before.radius_source)
        new = np.setdiff1d(np.arange(len(after)), place)
        assert (after.radius_source[new] == PROPAGATED).all()
        assert (after.radius[new] < after.radius[after.skeleton.parent[new]]).all()
        assert after.trunk == before.trunk


def test_segments_keep_their_headings(oak: Document) -> None:
    before = decode(oak)
    after = grown(oak, years=3, sprout_position=2, speed=0.1, ratio=1.5, thickness=0.1)
    place = kept(before, after)
    cosine = (headings(before.skeleton) * headings(after.skeleton)[place[1:] - 1]).sum(axis=1)
    # a segment's two ends are off by up to 0.6 mm each
    assert (np.sqrt(np.maximum(0, 1 - cosine**2)) * before.skeleton.length[1:] * 1.3 < 0.0013).all()
    assert (cosine > 0.99).all()


def test_shoots_have_no_radius_of_their_own() -> None:
    document = encode(decode(chain_document("-(90)F(1)+(10)!(0.07)F(1)+(20)>(30)!(0.02)F(1)")))
    assert document["axiom"].count("!") == 2
    after = grow(document, years=1, options=ScaleOptions(sprout_position=1))
    assert after["axiom"].count("!") == document["axiom"].count("!")
    assert after["axiom"].count("F") == document["axiom"].count("F") + 1


def chain_document(axiom: str, **keys: Any) -> Document:
    return {
        "format": {"name": "lsjson", "version": 1},
        "trunk": {"anchor": [0, 0, 0], "radius": 0.1},
        "axiom": axiom,
        **keys,
    }


# ---- where shoots stand


def test_sprouts_stand_where_they_should(oak: Document) -> None:
    skeleton = decode(oak).skeleton
    counted, children = relative_positions(skeleton), [len(c) for c in skeleton.children]
    for position in range(1, 6):
        foot, _ = shoots(skeleton.xyz, skeleton.parent, skeleton.continuation, position)
        wanted = [i for i in range(1, len(skeleton)) if counted[i] == position and children[i] == 1 and i]
        assert foot.tolist() == wanted


def test_position_is_the_number_of_nodes_to_the_tip() -> None:
    #   0 - 1 - 2 - 3 - 4, and 2 - 5 - 6 - 7
    parent = np.array([-1, 0, 1, 2, 3, 2, 5, 6], dtype=np.int32)
    onward = np.array([1, 2, 3, 4, -1, 6, 7, -1], dtype=np.int32)
    position, tip = positions(parent, onward)
    assert position.tolist() == [4, 3, 3, 1, 0, 2, 1, 0]  # at the fork 2, the longer of both
    assert tip.tolist() == [4, 4, 4, 4, 4, 7, 7, 7]


def test_a_shoot_is_the_average_tip_of_its_kind() -> None:
    # From a level twig along +X: two tips turn up and left, at 20 and 40 degrees; one turns right.
    left = "[F(1)-(20)F(0.2)][F(1)-(40)F(0.4)]"
    document = chain_document(f"F(1){left}>(30)F(1)<(60)F(0.6)")
    tree = grown(document, sprout_position=1)
    old = decode(document).skeleton
    place = kept(decode(document), tree)
    new = np.setdiff1d(np.arange(len(tree)), place)
    assert len(new) == 3
    step = tree.skeleton.xyz[new] - tree.skeleton.xyz[tree.skeleton.parent[new]]
    assert len(old) == 8
    expected = [[np.cos(np.radians(30)) * 0.3, 0, np.sin(np.radians(30)) * 0.3]] * 2
    right = np.radians(-30)
    expected.append([np.cos(right) * 0.6, np.sin(right) * 0.6, 0])
    assert np.abs(np.sort(step, axis=0) - np.sort(expected, axis=0)).max() < 0.0012


def test_averages_do_not_wrap() -> None:
    # +(350) and +(10) are both some 10 degrees off: 2021 had them average to 180.
    document = chain_document("-(60)F(1)[F(1)+(350)>(5)F(1)][F(1)-(14)>(355)F(1)]F(1)F(1)+(720)>(9)F(1)")
    skeleton = decode(document).skeleton
    foot, step = shoots(skeleton.xyz, skeleton.parent, skeleton.continuation, 1)
    assert len(foot) == 3
    ahead = frames(skeleton.xyz, skeleton.parent)[foot, 0]
    assert ((step * ahead).sum(axis=1) / np.linalg.norm(step, axis=1) > np.cos(np.radians(20))).all()


def test_frames_are_those_of_the_turtle() -> None:
    document = chain_document("-(35)>(50)F(1)[+(0.01)F(1)][>(0.01)F(1)]F(0)F(1)")
    skeleton = decode(document).skeleton
    frame = frames(skeleton.xyz, skeleton.parent)
    assert np.allclose(frame @ frame.transpose(0, 2, 1), np.eye(3))
    assert np.allclose(frame[2], frame[1])  # a segment without length
    turns = [np.linalg.multi_dot([frame[1], skeleton.xyz[i] - skeleton.xyz[1]]) for i in (4, 5)]
    assert turns[0] == pytest.approx([1, np.radians(0.01), 0], abs=1e-6)
    assert turns[1] == pytest.approx([1, 0, np.cos(np.radians(35)) * np.radians(0.01)], abs=1e-6)


def test_no_node_forks_in_three(oak: Document) -> None:
    before = decode(oak)
    after = grown(oak, sprout_position=2)
    place = kept(before, after)
    counts = np.array([len(c) for c in after.skeleton.children])[place]
    were = np.array([len(c) for c in before.skeleton.children])
    assert (counts[were != 1] == were[were != 1]).all()
    assert set(counts[were == 1].tolist()) == {1, 2}


def test_small_trees_have_nowhere_to_sprout() -> None:
    for axiom in ("", "-(90)F(2)", "-(90)F(2)[F][F]"):
        document = chain_document(axiom)
        for position in range(1, 6):
            tree = grown(document, sprout_position=position)
            assert len(tree) == len(decode(document))
    single = grown(chain_document("-(90)F(2)"), years=2, speed=0.5, thickness=0.5, sprout_position=1)
    assert single.skeleton.xyz[1] == pytest.approx([0, 0, 4.5])
    assert single.radius[0] == pytest.approx(0.225)
    assert len(grown(chain_document("-(90)F(2)"), ratio=3).skeleton.xyz) == 2


def test_tips_that_point_nowhere_give_no_shoot() -> None:
    assert len(grown(chain_document("-(90)F(1)F(1)F(0)"), sprout_position=1)) == 4
    back_and_forth = chain_document("-(90)F(1)[+(90)F(1)F(1)]-(90)F(1)+(180)F(1)")
    assert len(grown(back_and_forth, sprout_position=1)) == len(decode(back_and_forth))


# ---- years


def test_years_follow_each_other(oak: Document) -> None:
    options = ScaleOptions(sprout_position=2, speed=0.1, ratio=1.5, thickness=0.1)
    at_once = decode(grow(oak, years=2, options=options))
    one_by_one = decode(grow(grow(oak, years=1, options=options), years=1, options=options))
    assert np.array_equal(at_once.skeleton.parent, one_by_one.skeleton.parent)
    assert np.array_equal(at_once.radius_source, one_by_one.radius_source)
    assert np.abs(at_once.radius - one_by_one.radius).max() < 0.004
    # the first year's rounding grows with the second, and adds up along a branch only there
    offset = at_once.skeleton.xyz - one_by_one.skeleton.xyz
    assert np.linalg.norm(offset, axis=1).max() < 0.02


def test_shoots_come_once(oak: Document) -> None:
    counts = [len(grown(oak, years=years, sprout_position=3)) for years in range(4)]
    assert counts[0] < counts[1] == counts[2] == counts[3]


def test_error_does_not_add_up_over_years(oak: Document) -> None:
    before = decode(oak)
    after = grown(oak, years=10, speed=0.1)
    assert np.linalg.norm(after.skeleton.xyz - 1.1**10 * before.skeleton.xyz, axis=1).max() <= 0.0006


# ---- what the document says


def test_keys_are_kept(oak: Document) -> None:
    written = {"rule": "pipe", "exponent": 0.7, "written": "all", "tolerance": 0.02}
    document = encode(
        decode(oak), options=LsystemOptions(radii="all", radius_exponent=0.7, radius_tolerance_m=0.02)
    )
    after = grow(document, years=1, options=ScaleOptions(sprout_position=1, speed=0.3))
    assert after["id"] == "oak 7"
    assert after["crs"] == "EPSG:28992"
    assert after["format"] == {"name": "lsjson", "version": 1}
    assert {key: after["radius"][key] for key in written} == written
    assert after["trunk"]["anchor"] == document["trunk"]["anchor"]
    plain = encode(decode(oak), options=LsystemOptions(radii="none"))
    after = grow(plain, years=1, options=ScaleOptions(sprout_position=1, thickness=0.3))
    assert after["radius"] == plain["radius"]
    assert "!" not in after["axiom"]


def test_breast_height_is_no_longer_measured(oak: Document) -> None:
    known = oak["trunk"]["breast_height"]
    for options in (ScaleOptions(speed=0.1), ScaleOptions(ratio=2)):
        after = grow(oak, years=1, options=options)["trunk"]["breast_height"]
        assert after == {**known, "source": "propagated", "arc": 0.0}
    after = grow(oak, years=2, options=ScaleOptions(thickness=0.5))["trunk"]["breast_height"]
    sizes = {"diameter": 0.45, "low": 0.405, "high": 0.54}
    assert after == {**known, "source": "propagated", "arc": 0.0, **sizes}
    unknown = {**known, "diameter": None, "low": None, "high": None, "source": None}
    document = {**oak, "trunk": {**oak["trunk"], "breast_height": unknown}}
    after = grow(document, years=2, options=ScaleOptions(thickness=0.5))["trunk"]["breast_height"]
    assert after["diameter"] is None
    assert after["source"] is None


def test_the_grown_document_is_read_and_written(oak: Document, tmp_path: Path) -> None:
    document = grow(oak, years=1, options=ScaleOptions(sprout_position=1, speed=0.1))
    write_lsjson(document, tmp_path / "grown.ls.json")
    assert read_lsjson(tmp_path / "grown.ls.json") == document
    assert grow(oak, years=1, options=ScaleOptions(sprout_position=1, speed=0.1)) == document


def test_rules_are_expanded_first() -> None:
    rules = {"X": "F(1)+(20)F(0.5)"}
    document = chain_document("-(90)F(2)[<(50)+(30)X]X", rules=rules, recursions=1)
    expanded = chain_document("-(90)F(2)[<(50)+(30)F(1)+(20)F(0.5)]F(1)+(20)F(0.5)")
    options = ScaleOptions(sprout_position=1, speed=0.2)
    assert grow(document, years=1, options=options) == grow(expanded, years=1, options=options)
    assert len(grown(document, sprout_position=1)) == 8


# ---- bounds


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("sprout_position", (-1, 6, 1.5)),
        ("speed", (-0.1, 0.05, 1.1)),
        ("ratio", (-1, 1, 1.4, 5.1)),
        ("thickness", (-0.1, 0.09, 0.81)),
    ],
)
def test_ranges(name: str, wrong: tuple[float, ...]) -> None:
    for value in wrong:
        with pytest.raises(ValidationError, match=name):
            ScaleOptions.model_validate({name: value})
    least = {"sprout_position": 1, "speed": 0.1, "ratio": 1.5, "thickness": 0.1}[name]
    for value in (0, least):
        assert getattr(ScaleOptions.model_validate({name: value}), name) == value


def test_growth_is_bounded(oak: Document, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UsageError, match="by -1 years; give 0 to 1000"):
        grow(oak, years=-1)
    with pytest.raises(UsageError, match=r"would reach \S+ m in year \d+, .*fewer years"):
        grow(oak, years=100, options=ScaleOptions(ratio=5))
    with pytest.raises(UsageError, match=r"would reach \S+ m in year \d+"):
        grow(oak, years=1000, options=ScaleOptions(thickness=0.8))
    with pytest.raises(UsageError, match=r"would reach 1e\+300 m in year 1"):
        grow(chain_document("F(1e300)F(1)F(1)"), years=1, options=ScaleOptions(sprout_position=1))
    thin = chain_document("F(1)")
    thin["trunk"]["radius"] = 0
    assert grow(thin, years=1000, options=ScaleOptions(thickness=0.8))["trunk"]["radius"] == 0
    count = len(grown(oak, sprout_position=1))
    monkeypatch.setattr(module, "MOST_NODES", count - 1)
    with pytest.raises(UsageError, match=rf"would reach {count:,} nodes in year 1, .*fewer years"):
        grow(oak, years=1, options=ScaleOptions(sprout_position=1))


def test_a_radius_block_that_cannot_be_kept_is_named() -> None:
    for key, value in (("written", "some"), ("tolerance", -1), ("exponent", 9.0)):
        with pytest.raises(InputFormatError, match=rf"radius\.{key}.*docs/lsystem\.md"):
            grow(chain_document("F(1)", radius={key: value}), years=1)


# ---- whatever the tree


@settings(max_examples=100)
@given(hostile_trees(), some_options, st.integers(0, 3))
def test_any_tree_grows(tree: TreeModel, options: ScaleOptions, years: int) -> None:
    document = encode(tree)
    before = decode(document)
    try:
        after = decode(grow(document, years=years, options=options))
    except UsageError:
        assert before.skeleton.length.max() * 5**years > 100  # steps of some 20 m, times 5 a year
        return
    place = kept(before, after)
    skeleton = before.skeleton
    position = np.array(relative_positions(skeleton))
    children = [len(c) for c in skeleton.children]
    here = [i for i in range(1, len(before)) if position[i] == options.sprout_position and children[i] == 1]
    sprouted = np.setdiff1d(np.arange(len(after)), place)
    assert set(after.skeleton.parent[sprouted].tolist()) <= set(place[here].tolist())
    near, far = options.ratio or 1 + options.speed, 1 + options.speed
    exact = np.zeros_like(skeleton.xyz)
    for i in range(1, len(before)):
        p = skeleton.parent[i]
        factor = (near if position[p] < 4 else far) ** years
        exact[i] = exact[p] + (skeleton.xyz[i] - skeleton.xyz[p]) * factor
    if skeleton.length.max() * near**years < 200:
        assert np.linalg.norm(after.skeleton.xyz[place] - exact, axis=1).max() <= 0.0006
    thick = (1 + options.thickness) ** years
    assert np.abs(after.radius[place] - before.radius * thick).max() < 0.0012
    json.dumps(grow(document, years=years, options=options), allow_nan=False)


# ---- the report of 2021


def test_table_4_5(tree1: Document) -> None:
    count = len(decode(tree1))
    ours = [len(grown(tree1, sprout_position=position)) - count for position in range(1, 6)]
    assert ours == TABLE_4_5


@pytest.mark.parametrize("name", ["LAS00_9", "Lille_11", "Lille_2"])
def test_shoots_fall_with_the_position(name: str, shared_data: Path) -> None:
    document = read_lsjson(shared_data / "ls2021" / f"{name}_lsystem.json")
    for source in (document, encode(decode(document))):
        skeleton = decode(source).skeleton
        onward = module._onward(source)
        counts = [len(shoots(skeleton.xyz, skeleton.parent, onward, p)[0]) for p in range(1, 6)]
        assert counts[-1] > 0
        assert all(a > b for a, b in pairwise(counts))


@pytest.mark.parametrize(
    "name", ["Lille_2_lsystem_gen", "in_a", *(f"tree1_lsystem_gen_{n}" for n in (1, 2, 3))]
)
def test_generalised_files_grow(name: str, shared_data: Path) -> None:
    document = read_lsjson(shared_data / "ls2021" / f"{name}.json")
    before = decode(document)
    after = grown(document, years=2, sprout_position=2, speed=0.1, ratio=1.5, thickness=0.1)
    assert len(after) >= len(before)
    assert after.radius[0] == pytest.approx(before.radius[0] * 1.21, abs=1e-4)
    assert len(kept(before, after)) == len(before)


def test_a_large_tree_grows_at_a_cost_in_proportion(bush: TreeModel) -> None:
    small, large = encode(first_nodes(bush, len(bush) // 4)), encode(bush)
    options = ScaleOptions(sprout_position=1, speed=0.1, ratio=1.5, thickness=0.1)
    ratio = slowdown(lambda document: grow(document, years=1, options=options), small, large)
    assert ratio < 12  # four times the nodes; 16 where it is quadratic
