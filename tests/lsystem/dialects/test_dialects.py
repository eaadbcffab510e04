"""L-strings of other programs: their turtles by hand, then ours through their turtles and back."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.errors import InputFormatError, UsageError
from pipeline.lsystem import canonical, decode, read_lsjson
from pipeline.lsystem.dialects.conventions import CONVENTIONS, PITCH, PROFILES, ROLL, TURN, Profile
from pipeline.lsystem.dialects.frames import close_frames, rotate
from pipeline.lsystem.dialects.reading import follow, from_lstring, profile_of
from pipeline.lsystem.dialects.writing import anchor, to_lstring
from pipeline.model import Skeleton, TreeModel
from tests.pace import first_nodes, slowdown

Maker = Callable[..., TreeModel]
C, S = np.sqrt(3) / 2, 0.5  # cosine and sine of 30 degrees

# Two segments, 2 m and 1 m, roll 90 and pitch up 30 between them. A roll that is right-handed about the
# heading takes left to up and up to minus left; the pitch goes 0.5 towards up, 0.866 stays ahead.
#   abop    H = z, L = -x, U = -y. / is R_H(-90): up becomes L = -x.         Ends at (-0.5, 0, 2.866).
#   lpy     H = z, L = -y, U = x.  / is R_H(90):  up becomes -L = y.         Ends at (0, 0.5, 2.866).
#   groimp  H = z, L = x,  U = y.  RH(90):        up becomes -L = -x;
#           RL(-30) about the new left, y, takes z to (sin -30, 0, cos -30). Ends at (-0.5, 0, 2.866).
#   houdini H = z, L = -x, U = -y. \ rolls clockwise as seen from behind, R_H(90): up becomes -L = x,
#           & pitches up.                                                    Ends at (0.5, 0, 2.866).
ROLLED: dict[Profile, tuple[str, tuple[float, float, float]]] = {
    "abop": ("!(0.2)F(2)/(90)^(30)!(0.1)F(1)", (-S, 0, 2 + C)),
    "lpy": ("_(0.1)F(2,0.1)/(90)^(30)F(1,0.05)", (0, S, 2 + C)),
    "groimp": ("D(0.2) F(2, 0.2) RH(90) RL(-30) F(1, 0.1)", (-S, 0, 2 + C)),
    "houdini": ("F(2,0.2)\\(90)&(30)F(1,0.1)", (S, 0, 2 + C)),
}

# Turn left 90, 2 m, pitch down 30, 1 m: what our writer uses. The turn takes H to L and leaves U; the
# pitch goes 0.5 against U. So 2 L + 0.866 L - 0.5 U = 2.866 L - 0.5 U, with L and U as above.
TURNED: dict[Profile, tuple[str, tuple[float, float, float]]] = {
    "abop": ("!(0.2)+(90)F(2)&(30)!(0.1)F(1)", (-2 - C, S, 0)),
    "lpy": ("_(0.1)+(90)F(2,0.1)&(30)F(1,0.05)", (-S, -2 - C, 0)),
    "groimp": ("D(0.2)RU(90)F(2,0.2)RL(30)F(1,0.1)", (2 + C, -S, 0)),
    "houdini": ("-(90)F(2,0.2)^(30)F(1,0.1)", (-2 - C, S, 0)),
}


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("fixture", [ROLLED, TURNED])
def test_each_turtle_goes_where_a_hand_takes_it(
    fixture: dict[Profile, tuple[str, tuple[float, float, float]]], profile: Profile
) -> None:
    text, end = fixture[profile]
    tree = from_lstring(text, profile)
    assert tree.skeleton.parent.tolist() == [-1, 0, 1]
    np.testing.assert_allclose(tree.skeleton.xyz[2], end, rtol=0, atol=1e-12)
    np.testing.assert_allclose(tree.radius, [0.1, 0.1, 0.05], rtol=0, atol=1e-12)


@pytest.mark.parametrize("profile", PROFILES)
def test_what_is_written_by_hand_is_written_so(profile: Profile, tree_of: Maker) -> None:
    text, end = TURNED[profile]
    heading, left, _up = np.array(CONVENTIONS[profile].start, dtype=float)
    assert heading.tolist() == [0, 0, 1]
    tree = tree_of([(0, 0, 0), 2 * left, end], [-1, 0, 1], [0.1, 0.1, 0.05])
    assert text in to_lstring(tree, profile).replace(" ", "")


@pytest.mark.parametrize("profile", PROFILES)
def test_branches_stand_in_brackets_and_the_axis_outside(profile: Profile, tree_of: Maker) -> None:
    # A stem of 1 m, its axis goes on for 1 m, a branch of 0.5 m to the turtle's left.
    left = np.array(CONVENTIONS[profile].start[1])
    tree = tree_of(
        [(0, 0, 0), (0, 0, 1), (0, 0, 2), (0, 0, 1) + left / 2], [-1, 0, 1, 1], [0.1, 0.1, 0.1, 0.02]
    )
    body = {
        "abop": "!(0.2)F(1)[+(90)!(0.04)F(0.5)]F(1)\n",
        "lpy": "Axiom: _(0.1)F(1,0.1)[+(90)_(0.02)F(0.5,0.02)]F(1,0.1)\n",
        "groimp": "Axiom ==> D(0.2)F(1,0.2)[RU(90)F(0.5,0.04)]F(1,0.2);\n",
        "houdini": "A=F(1,0.2)[-(90)F(0.5,0.04)]F(1,0.2)\n",
    }[profile]
    assert body in to_lstring(tree, profile)


@pytest.mark.parametrize("profile", PROFILES)
def test_start_frames_are_right_handed(profile: Profile) -> None:
    heading, left, up = np.array(CONVENTIONS[profile].start, dtype=float)
    assert np.cross(heading, left).tolist() == up.tolist()


@st.composite
def hostile_trees(draw: st.DrawFn) -> TreeModel:
    """Forks anywhere; steps up, down, back, sideways, of no length, in any direction."""
    count = draw(st.integers(1, 40))
    kinds = draw(st.lists(st.sampled_from("udbzsnl"), min_size=count, max_size=count))
    onward = draw(st.sampled_from((0.0, 0.5, 0.9, 1.0)))
    origin = draw(st.sampled_from(((0, 0, 0), (121913.8412, 487434.1236, -1.25))))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    xyz, step, parent = np.zeros((count, 3)), np.zeros((count, 3)), np.full(count, -1)
    vertical = np.array([0, 0, 1.0])
    for i in range(1, count):
        parent[i] = i - 1 if rng.random() < onward else rng.integers(0, i)
        length, random = 10 ** rng.uniform(-4, 1.3), rng.normal(size=3)
        step[i] = {
            "u": vertical * length,
            "d": -vertical * length,
            "b": -step[parent[i]],
            "z": np.zeros(3),
            "s": np.roll(step[parent[i]], 1),
            "n": vertical * length + random * 1e-6,
            "l": random * length,
        }[kinds[i]]
        xyz[i] = xyz[parent[i]] + step[i]
    skeleton = Skeleton(xyz + rng.normal(size=3).round(3), parent, np.array(origin), "EPSG:28992")
    radius = np.where(rng.random(count) < 0.1, 0, 10 ** rng.uniform(-4, 0, count))
    return TreeModel(skeleton, radius, np.ones(count, dtype=np.uint8), np.full(count, np.nan))


def check_it_comes_back(tree: TreeModel, profile: Profile, within: float = 0.0006) -> None:
    ours, theirs = canonical(tree), from_lstring(to_lstring(tree, profile), profile)
    assert np.array_equal(ours.skeleton.parent, theirs.skeleton.parent)
    assert np.array_equal(ours.skeleton.branch, theirs.skeleton.branch)
    assert np.abs(theirs.skeleton.xyz[0]).max() == 0
    offset = theirs.skeleton.xyz - (ours.skeleton.xyz + (ours.skeleton.origin - anchor(tree)))
    assert np.linalg.norm(offset, axis=1).max() <= within
    rooted = slice(1, None) if profile == "houdini" else slice(None)  # F has no radius for the root
    assert np.abs(theirs.radius - ours.radius)[rooted].max(initial=0) <= 0.000101


@pytest.mark.parametrize("profile", PROFILES)
@settings(max_examples=60, deadline=None)
@given(tree=hostile_trees())
def test_every_node_comes_back_within_0_6_mm(profile: Profile, tree: TreeModel) -> None:
    check_it_comes_back(tree, profile)


@pytest.mark.parametrize("profile", PROFILES)
def test_the_origin_comes_back(profile: Profile, tree_of: Maker) -> None:
    tree = tree_of([(0.25, 0, 0), (0, 0, 1)], [-1, 0], origin=(121913.84126, 487434, -1.25), crs="EPSG:28992")
    text = to_lstring(tree, profile)
    skeleton = from_lstring(text).skeleton
    assert anchor(tree) == (121914.0913, 487434.0, -1.25)
    assert profile_of(text) == profile
    assert (tuple(skeleton.origin.tolist()), skeleton.crs) == (anchor(tree), "EPSG:28992")


def test_a_string_without_a_comment_starts_at_0() -> None:
    skeleton = from_lstring("!(0.2)F(1)", "abop").skeleton
    assert (skeleton.origin.tolist(), skeleton.crs) == ([0, 0, 0], None)


@pytest.mark.parametrize("profile", PROFILES)
def test_errors_do_not_grow_over_ten_thousand_steps(profile: Profile) -> None:
    rng = np.random.default_rng(7)
    count = 10_000
    t = np.arange(count) * 0.07
    coil = np.stack([np.cos(t), np.sin(t * 1.31), 0.4 * t], axis=1) + rng.normal(0, 0.02, (count, 3))
    parent = np.arange(-1, count - 1)
    tree = TreeModel(
        Skeleton(coil, parent), np.full(count, 0.02), np.ones(count, dtype=np.uint8), np.full(count, np.nan)
    )
    check_it_comes_back(tree, profile)


@pytest.mark.parametrize("profile", PROFILES)
def test_a_lone_root_and_two_stems(profile: Profile, tree_of: Maker) -> None:
    check_it_comes_back(tree_of([(1, 2, 3)], [-1]), profile)
    check_it_comes_back(tree_of([(0, 0, 0), (0, 0, 1), (0, 1, -1)], [-1, 0, 0], [0.1, 0.2, 0.3]), profile)


@pytest.mark.parametrize("profile", PROFILES)
def test_a_tree_of_2021(profile: Profile, shared_data: Path) -> None:
    tree = decode(read_lsjson(shared_data / "ls2021" / "Lille_11_lsystem.json"))
    check_it_comes_back(tree, profile)


@pytest.mark.parametrize("profile", PROFILES)
def test_twenty_thousand_nodes_at_a_cost_in_proportion(profile: Profile, bush: TreeModel) -> None:
    check_it_comes_back(bush, profile)
    ratio = slowdown(lambda tree: to_lstring(tree, profile), first_nodes(bush, len(bush) // 4), bush)
    assert ratio < 12  # four times the nodes; 16 where it is quadratic


@pytest.mark.parametrize("profile", PROFILES)
def test_no_symbol_means_context_elsewhere(profile: Profile, bush: TreeModel) -> None:
    assert not set("<>") & set(to_lstring(bush, profile).replace("==>", ""))


def test_compiled_loops_equal_their_python_originals(bush: TreeModel) -> None:
    start = np.array(CONVENTIONS["lpy"].start, dtype=float)
    arguments = bush.skeleton.xyz[:500], bush.skeleton.parent[:500], start, 1000
    for fast, slow in zip(close_frames(*arguments), close_frames.py_func(*arguments), strict=True):
        np.testing.assert_array_equal(fast, slow)
    actions = np.array([4, 0, 5, 1, 0, 6, 3, 2, 0], dtype=np.uint8)
    values = np.array([0.1, 2, 0, 30, 1, 0, 45, 60, 0.5]), np.full(9, np.nan)
    for fast, slow in zip(
        follow(actions, *values, start), follow.py_func(actions, *values, start), strict=True
    ):
        np.testing.assert_allclose(fast, slow, rtol=0, atol=1e-15)


@pytest.mark.parametrize(("action", "moved"), [(TURN, (0, 1)), (PITCH, (2, 0)), (ROLL, (1, 2))])
def test_rotations_are_right_handed(action: int, moved: tuple[int, int]) -> None:
    first, second = moved
    frame = np.eye(3)
    rotate(frame, action, 90.0)
    np.testing.assert_allclose(frame[first], np.eye(3)[second], atol=1e-15)
    np.testing.assert_allclose(frame[second], -np.eye(3)[first], atol=1e-15)


@pytest.mark.parametrize(
    ("text", "profile", "told"),
    [
        ("F(1)<(3)F(1)", "abop", "'<(3)F(1)' at character 4 is not part"),
        ("F(1,0.1)", "abop", "'F(1,0.1)' at character 0"),
        ("F(1)  +F(2)", "abop", "'+F(2)' at character 6"),
        ("F(1)+(nan)F(2)", "lpy", "'+(nan)F(2)' at character 4"),
        ("F(1)[(2)F(1)]", "lpy", "at character 4"),
        ("F(1)RX(3)", "groimp", "'RX(3)' at character 4"),
        ("F(1)]F(1)", "houdini", "has no partner"),
        ("[F(1)", "abop", "has no partner"),
        ("!(-1)F(1)", "abop", "is negative"),
        ("F(1e308)F(1e308)", "abop", "add up to more"),
        ("# origin 1 x 3 crs unknown\nF(1,1)", "lpy", "is no point"),
    ],
)
def test_what_cannot_be_read_is_told_with_its_place(text: str, profile: Profile, told: str) -> None:
    with pytest.raises(InputFormatError) as caught:
        from_lstring(text, profile)
    assert told in str(caught.value)


def test_an_unknown_profile_lists_those_there_are(bush: TreeModel) -> None:
    with pytest.raises(UsageError, match="abop, lpy, groimp, houdini"):
        to_lstring(bush, "maya")  # type: ignore[arg-type]


def test_a_string_without_widths_has_none() -> None:
    assert from_lstring("F(1)[+(30)F(1)]F(2)").radius.tolist() == [0, 0, 0, 0]
    assert from_lstring("").skeleton.xyz.tolist() == [[0, 0, 0]]
