"""Encoding is a closed loop: whatever the tree, it comes back, node by node and byte by byte."""

from __future__ import annotations

import json
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import ModelError
from pipeline.lsystem import LsystemOptions, canonical, decode, encode, expand, max_error
from pipeline.model import Skeleton, TreeModel, Trunk
from tests.pace import first_nodes, slowdown

Maker = Callable[..., TreeModel]
UP, DOWN, EAST = np.array([0, 0, 1.0]), np.array([0, 0, -1.0]), np.array([1.0, 0, 0])


@st.composite
def hostile_trees(draw: st.DrawFn) -> TreeModel:
    """Forks anywhere; steps up, down, back, of no length, of any length in any direction."""
    count = draw(st.integers(1, 40))
    seed = draw(st.integers(0, 2**32 - 1))
    kinds = draw(st.lists(st.sampled_from("udbznxyl"), min_size=count, max_size=count))
    onward = draw(st.sampled_from((0.0, 0.5, 0.9, 1.0)))
    origin = draw(
        st.sampled_from(((0, 0, 0), (121913.8412, 487434.1236, -1.25), (-114.788, -257.8456, 42.6642)))
    )
    rng = np.random.default_rng(seed)
    xyz, step, parent = np.zeros((count, 3)), np.zeros((count, 3)), np.full(count, -1)
    for i in range(1, count):
        parent[i] = i - 1 if rng.random() < onward else rng.integers(0, i)
        direction = rng.normal(size=3)
        length = 10 ** rng.uniform(-4, 1.3)
        step[i] = {
            "u": UP * length,
            "d": DOWN * length,
            "b": -step[parent[i]],
            "z": np.zeros(3),
            "n": UP * length + direction * 1e-6,
            "x": EAST * np.round(length, 3),
            "y": np.array([1, -1, 0]) * length,
            "l": direction * length,
        }[kinds[i]]
        xyz[i] = xyz[parent[i]] + step[i]
    local = rng.normal(size=3).round(3)
    return TreeModel(
        Skeleton(xyz + local, parent, np.array(origin), "EPSG:28992"),
        10 ** rng.uniform(-4, 0, count),
        rng.integers(0, 3, count).astype(np.uint8),
        np.full(count, np.nan),
        Trunk(0.25, 0.24, 0.26, 271.25, "measured", -0.0312) if seed % 2 else None,
    )


@settings(max_examples=300, deadline=None)
@given(hostile_trees(), st.sampled_from((0, 3)))
def test_every_node_comes_back_within_0_6_mm(tree: TreeModel, decimals: int) -> None:
    document = encode(tree, options=LsystemOptions(angle_decimals=decimals))
    assert max_error(tree, document) <= 0.0006
    ours, theirs = canonical(tree), decode(document)
    assert np.array_equal(ours.skeleton.parent, theirs.skeleton.parent)
    assert np.array_equal(ours.skeleton.branch, theirs.skeleton.branch)
    assert np.linalg.norm(ours.skeleton.world[0] - theirs.skeleton.world[0]) <= 0.0001
    assert np.array_equal(ours.radius_source, theirs.radius_source)
    assert theirs.skeleton.crs == "EPSG:28992"


@settings(max_examples=300, deadline=None)
@given(hostile_trees(), st.sampled_from((0, 3)), st.sampled_from(("none", "exceptions", "all")))
def test_encoding_what_was_decoded_gives_the_same_bytes(tree: TreeModel, decimals: int, radii: str) -> None:
    options = LsystemOptions(angle_decimals=decimals, radii=radii)
    document = encode(tree, options=options)
    assert json.dumps(encode(decode(document), options=options)) == json.dumps(document)


@settings(max_examples=100, deadline=None)
@given(hostile_trees())
def test_radii_come_back_within_their_tolerance(tree: TreeModel) -> None:
    ours = canonical(tree).radius
    theirs = decode(encode(tree)).radius
    rounding = 0.00005
    assert (np.abs(theirs - ours) <= 0.001 + rounding * 1.1).all()
    every = decode(encode(tree, options=LsystemOptions(radii="all"))).radius
    assert (np.abs(every - ours) <= rounding * 1.01).all()


def test_a_hand_made_tree_is_told_as_expected(tree_of: Maker) -> None:
    # A stem of two steps, a branch to the east at the first, then the top leans west.
    xyz = [[0, 0, 0], [0, 0, 1], [-1, 0, 2], [0.5, 0, 1]]
    tree = tree_of(xyz, [-1, 0, 1, 1], 0.0, origin=(100, 200, 3))
    document = encode(tree, options=LsystemOptions(radius_source=False))
    assert document["axiom"] == "-(90)F(1)[+(90)F(0.5)]-(45)F(1.414)"
    assert document["trunk"] == {"anchor": [100.0, 200.0, 3.0], "radius": 0.0}
    assert (document["rules"], document["recursions"], document["degrees"]) == ({}, 0, True)
    assert document["format"] == {"name": "lsjson", "version": 1}


def test_a_vertical_stem_keeps_its_roll(tree_of: Maker) -> None:
    # East, up, up, east again: no roll is needed, and none is written.
    tree = tree_of([[0, 0, 0], [1, 1, 0], [1, 1, 1], [1, 1, 2], [2, 2, 2]], [-1, 0, 1, 2, 3])
    axiom = encode(tree, options=LsystemOptions(radii="none"))["axiom"]
    assert axiom.count(">") == 1
    assert "<" not in axiom


def test_short_segments_cost_fewer_decimals(bush: TreeModel) -> None:
    adaptive, fixed = (
        encode(bush, options=LsystemOptions(angle_decimals=least, radii="none")) for least in (0, 3)
    )
    assert len(adaptive["axiom"]) < 0.9 * len(fixed["axiom"])


def test_errors_do_not_grow_along_a_branch(tree_of: Maker) -> None:
    rng = np.random.default_rng(5)
    xyz = np.cumsum(rng.normal((0, 0, 0.02), 0.05, (2_500, 3)), axis=0)
    chain = tree_of(xyz, np.arange(-1, 2_499))
    assert max_error(chain, encode(chain)) <= 0.0006


def test_2_500_branches_inside_each_other(tree_of: Maker) -> None:
    # At every fork the twig has the next number and goes on; the long way up starts a branch.
    count = 2_500
    xyz, parent = [[0.0, 0.0, 0.0]], [-1]
    foot = 0
    for i in range(count):
        xyz += [[0.01, 0.01 * i, 0.02 * i], [0.0, 0.01 * i, 0.02 * i + 0.02]]
        parent += [foot, foot]
        foot = 2 * i + 2
    tree = tree_of(xyz, parent)
    document = encode(tree)
    assert document["axiom"].count("[") == count
    assert int(tree.skeleton.order.max()) == count
    assert max_error(tree, document) <= 0.0006
    assert encode(decode(document)) == document


def test_a_fork_of_twenty(tree_of: Maker) -> None:
    angles = np.linspace(0, 2 * np.pi, 20, endpoint=False)
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.ones(20)])
    tree = tree_of(np.vstack([[0, 0, 0], ring]), [-1, *[0] * 20])
    document = encode(tree)
    assert document["axiom"].count("[") == 19
    assert max_error(tree, document) <= 0.0006


def test_a_lone_root(tree_of: Maker) -> None:
    tree = tree_of([[1, 2, 3]], [-1])
    document = encode(tree)
    assert document["axiom"] == ""
    assert decode(document).skeleton.world.tolist() == [[1, 2, 3]]


def test_coordinates_without_an_origin(tree_of: Maker) -> None:
    rng = np.random.default_rng(1)
    xyz = np.array([121913.84127, 487434.12361, 3.2]) + np.cumsum(rng.normal(0, 0.1, (50, 3)), axis=0)
    tree = tree_of(xyz, np.arange(-1, 49))
    assert max_error(tree, encode(tree)) <= 0.0006


def test_breast_height_travels_along(tree_of: Maker) -> None:
    bare = tree_of([[0, 0, 0.2], [0, 0, 2]], [-1, 0], origin=(0, 0, 5))
    trunk = Trunk(0.3125, 0.30, None, 271.0, "propagated", -0.1)
    tree = TreeModel(bare.skeleton, bare.radius, bare.radius_source, bare.radius_rmse, trunk)
    back = decode(encode(tree))
    assert back.trunk is not None
    assert back.skeleton.origin[2] + back.trunk.ground_z == pytest.approx(4.9)
    assert (back.trunk.dbh_m, back.trunk.lo_m, back.trunk.hi_m) == (0.3125, 0.30, None)
    assert (back.trunk.arc_deg, back.trunk.source) == (271.0, "propagated")


def test_an_id_travels_along(tree_of: Maker) -> None:
    bare = tree_of([[0, 0, 0], [0, 0, 2]], [-1, 0])
    tree = TreeModel(bare.skeleton, bare.radius, bare.radius_source, bare.radius_rmse, None, {"id": "oak-7"})
    assert encode(tree)["id"] == "oak-7"
    assert decode(encode(tree)).metadata["id"] == "oak-7"
    assert "id" not in encode(bare)


def test_max_error_refuses_another_tree(tree_of: Maker) -> None:
    one = tree_of([[0, 0, 0], [0, 0, 1]], [-1, 0])
    two = tree_of([[0, 0, 0], [0, 0, 1], [0, 1, 1]], [-1, 0, 0])
    with pytest.raises(ModelError, match="give the document that was encoded from this model"):
        max_error(one, encode(two))


def test_max_error_sees_a_shift(tree_of: Maker) -> None:
    tree = tree_of([[0, 0, 0], [0, 0, 1]], [-1, 0])
    document = encode(tree)
    document["trunk"]["anchor"] = [0, 0.25, 0]
    assert max_error(tree, document) == pytest.approx(0.25)


def test_the_axiom_is_its_own_expansion(bush: TreeModel) -> None:
    document = encode(bush)
    assert expand(document["axiom"], document["rules"], document["recursions"]) == document["axiom"]


def test_the_cost_follows_the_nodes(bush: TreeModel) -> None:
    small = first_nodes(bush, len(bush) // 4)
    assert slowdown(encode, small, bush) < 12  # four times the nodes; 16 where it is quadratic
    assert slowdown(decode, encode(small), encode(bush)) < 12
