"""A tree as the L-string that other programs read: ABOP, L-Py, GroIMP and Houdini.

Their turtles turn in their own frame (heading, left, up), where ours adds up two angles, so every
turn is derived anew from where that turtle will stand and how it will be turned: a closed loop, as
in `loop`. Headings are reached by a turn about up and a pitch about left, never by a roll: programs
agree on the former and not on which way ``/`` rolls. `docs/lstring.md` states each convention.

References
----------
Prusinkiewicz, P. and Lindenmayer, A. (1990), The algorithmic beauty of plants, section 1.5. Changed:
angles are exact where the reader stands, not those of rules.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import atan2, cos, hypot, sin
from types import MappingProxyType
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from pipeline.errors import UsageError
from pipeline.geometry.compiled import compiled
from pipeline.lsystem.encode import ANCHOR_DECIMALS, RADIUS_DECIMALS, nested
from pipeline.lsystem.loop import NO_ROLL_M, RADIAN, decimals_for, folded
from pipeline.lsystem.numbering import canonical
from pipeline.lsystem.tokens import number
from pipeline.model import Floats, Ints, Skeleton, TreeModel
from pipeline.options import Options

Profile = Literal["abop", "lpy", "groimp", "houdini"]
PROFILES: tuple[Profile, ...] = get_args(Profile)
VERSION = 1


class LstringOptions(Options):
    """How a tree is written for another L-system program."""

    profile: Profile = Field(default="abop", description="whose convention a .lstring keeps")


LENGTH_SCALE = 1000
"""Units in a metre: lengths have 3 decimals."""
THINNEST_M = 0.0001
"""The least radius that is written: L-Py draws a radius of 0 as no tube, cpfg has a least width."""

FORWARD, TURN, PITCH, ROLL, WIDTH, OPEN, CLOSE = range(7)
HEADING, LEFT, UP = range(3)

Symbols = Mapping[str, tuple[int, float]]


class Convention(NamedTuple):
    """What a program's turtle does.

    Parameters
    ----------
    start : (3, 3) tuple of float
        Heading, left and up at the start, in the axes of the tree (x east, y north, z up).
    symbols : mapping of str to (int, float)
        What each symbol does and the factor on its value: angles become right-handed about up, left
        and heading, widths become radii in metres.
    thickness : float or None
        Factor that makes the second value of ``F`` a radius in metres; None where it has none.
    tapers : bool
        Whether a segment starts as wide as the turtle stands, so that a branch must say so first.
    wrapping : str
        What stands around the string in a file.
    comment : str
        What begins a comment line.
    """

    start: tuple[tuple[float, float, float], ...]
    symbols: Symbols
    thickness: float | None
    tapers: bool = False
    wrapping: str = "{}\n"
    comment: str = "#"


def _symbols(turns: str, **widths: float) -> Symbols:
    """Return the one-letter symbols; `turns` are those of positive and negative turn, pitch and roll."""
    actions = [(action, sign) for action in (TURN, PITCH, ROLL) for sign in (1.0, -1.0)]
    table = {"F": (FORWARD, 1.0), "[": (OPEN, 1.0), "]": (CLOSE, 1.0)}
    table |= dict(zip(turns, actions, strict=True))
    return MappingProxyType(table | {name: (WIDTH, factor) for name, factor in widths.items()})


_FROM_SOUTH = ((0, 0, 1), (-1, 0, 0), (0, -1, 0))
"""Upright, seen from the south: what a reader whose y axis points up draws as (x, z, -y)."""

CONVENTIONS: Mapping[Profile, Convention] = MappingProxyType(
    {
        "abop": Convention(_FROM_SOUTH, _symbols("+-&^\\/", **{"!": 0.5}), None),
        "lpy": Convention(
            ((0, 0, 1), (0, -1, 0), (1, 0, 0)),
            _symbols("+-&^/\\", **{"_": 1, "!": 1}),
            1,
            True,
            "Axiom: {}\nderivation length: 1\nproduction:\nendlsystem\n",
        ),
        "groimp": Convention(
            ((0, 0, 1), (1, 0, 0), (0, 1, 0)),
            MappingProxyType(
                {
                    **{"F": (FORWARD, 1.0), "[": (OPEN, 1.0), "]": (CLOSE, 1.0), "D": (WIDTH, 0.5)},
                    **{"RU": (TURN, 1.0), "RL": (PITCH, 1.0), "RH": (ROLL, 1.0)},
                }
            ),
            0.5,
            False,
            "protected void init()\n[\nAxiom ==> {};\n]\n",
            "//",
        ),
        "houdini": Convention(_FROM_SOUTH, _symbols("-+^&\\/"), 0.5, False, "A={}\n"),
    }
)


def to_lstring(tree: TreeModel, profile: Profile) -> str:
    """Write a tree as a file that another L-system program reads.

    Parameters
    ----------
    tree : TreeModel
        In any numbering; of a document, what `decode` gives.
    profile : {"abop", "lpy", "groimp", "houdini"}
        Whose convention to follow; docs/lstring.md says how each program opens the file.

    Returns
    -------
    str
        Local metres and degrees: the string starts at 0, which is `anchor` in the tree's reference
        system. Every node comes back within 0.6 mm of it, every radius within 0.1 mm. The anchor
        stands in the leading comment; Houdini has no radius for the root.

    Raises
    ------
    UsageError
        If there is no such profile.
    """
    convention = convention_of(profile)
    tree = canonical(tree)
    skeleton = tree.skeleton
    local = skeleton.xyz + (skeleton.origin - np.array(anchor(tree)))
    start = np.array(convention.start, dtype=np.float64)
    steps, turns, pitches, scale = close_frames(local, skeleton.parent, start, LENGTH_SCALE)
    radius = np.maximum(np.round(tree.radius, RADIUS_DECIMALS), THINNEST_M)
    parts = zip(
        _turned(turns / scale, TURN, convention.symbols),
        _turned(pitches / scale, PITCH, convention.symbols),
        _drawn(skeleton, steps / LENGTH_SCALE, radius, convention),
        strict=True,
    )
    text = _base(radius[0], convention) + nested(skeleton, ["".join(part) for part in parts])
    return _heading(tree, profile) + convention.wrapping.format(text)


def anchor(tree: TreeModel) -> tuple[float, float, float]:
    """Return where the L-string of a tree starts, in the tree's reference system, to 0.1 mm."""
    x, y, z = (np.round(tree.skeleton.world[0], ANCHOR_DECIMALS) + 0.0).tolist()  # no minus zero
    return x, y, z


def convention_of(profile: str) -> Convention:
    """Return the convention of a profile.

    Raises
    ------
    UsageError
        If there is no such profile, listing those there are.
    """
    for known in PROFILES:
        if known == profile:
            return CONVENTIONS[known]
    msg = f"unknown L-string profile {profile!r}; choose one of {', '.join(PROFILES)}"
    raise UsageError(msg)


@compiled
def rotate(frame: Floats, action: int, angle: float) -> None:
    """Turn a frame in place, right-handed about up (turn), left (pitch) or heading (roll).

    Parameters
    ----------
    frame : (3, 3) array of float64
        Heading, left and up, one a row, with heading x left = up.
    action : int
        `TURN`, `PITCH` or `ROLL`.
    angle : float
        Degrees. A positive turn is to the left, a positive pitch is down, a positive roll lifts the left.
    """
    first, second = (HEADING, LEFT) if action == TURN else (UP, HEADING) if action == PITCH else (LEFT, UP)
    c, s = cos(angle * RADIAN), sin(angle * RADIAN)
    for k in range(3):
        a, b = frame[first, k], frame[second, k]
        frame[first, k], frame[second, k] = c * a + s * b, c * b - s * a


@compiled
def close_frames(
    xyz: Floats, parent: Ints, start: Floats, length_scale: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Find the steps and turns that lead a turtle with a frame to every node.

    Each is taken from the position and the frame in which the reader will stand, rounded, and done
    again as the reader will do it; an error lives for one node.

    Parameters
    ----------
    xyz : (N, 3) array of float64
        Nodes in metres from the anchor, parents first.
    parent : (N,) array of int32
    start : (3, 3) array of float64
        Heading, left and up at the root, one a row.
    length_scale : int
        Units in a metre.

    Returns
    -------
    steps, turns, pitches : (N,) array of int64
        Lengths in units of 1/length_scale metre, angles in units of 1/angle_scale degree.
    angle_scale : (N,) array of int64
    """
    count = len(xyz)
    steps, turns = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    pitches, angle_scale = np.zeros(count, dtype=np.int64), np.ones(count, dtype=np.int64)
    at, frames = np.zeros((count, 3)), np.empty((count, 3, 3))
    frames[0] = start
    for i in range(1, count):
        offset = xyz[i] - at[parent[i]]
        frame = frames[parent[i]].copy()
        steps[i] = int(np.rint(np.sqrt((offset * offset).sum()) * length_scale))
        length = steps[i] / length_scale
        if steps[i] > 0:
            scale = 10 ** decimals_for(length)
            ahead, aside = (frame[HEADING] * offset).sum(), (frame[LEFT] * offset).sum()
            if hypot(ahead, aside) > NO_ROLL_M:  # else straight up or down: no turn tells from another
                turns[i] = folded(atan2(aside, ahead) / RADIAN, scale, 180 * scale)
            rotate(frame, TURN, turns[i] / scale)
            ahead, above = (frame[HEADING] * offset).sum(), (frame[UP] * offset).sum()
            pitches[i] = folded(atan2(-above, ahead) / RADIAN, scale, 180 * scale)
            rotate(frame, PITCH, pitches[i] / scale)
            angle_scale[i] = scale
        frames[i] = frame
        at[i] = at[parent[i]] + length * frame[HEADING]
    return steps, turns, pitches, angle_scale


def _turned(angles: Floats, action: int, symbols: Symbols) -> list[str]:
    """Return the text of each turn, with the symbol of its sign where there is one; nothing for 0."""
    names = {sign: name for name, (does, sign) in symbols.items() if does == action}
    left, right = f"{names[1]}(", f"{names[-1]}(" if -1 in names else f"{names[1]}(-"
    return [f"{left if a > 0 else right}{number(abs(a))})" if a else "" for a in angles.tolist()]


def _drawn(skeleton: Skeleton, length: Floats, radius: Floats, convention: Convention) -> list[str]:
    """Return the width and ``F`` of each node.

    Where ``F`` has no width, one is set before it that differs from the parent's; where the width is
    that of its end (L-Py), one is set where a branch starts, which has a radius of its own.
    """
    widen = _widener(convention)
    factor = convention.thickness
    before = radius != radius[np.maximum(skeleton.parent, 0)]
    if factor is not None:
        before &= skeleton.branch_start & convention.tapers
    widths = [f"{widen}({_width(r, convention)})" for r in radius.tolist()]
    ends = ["" if factor is None else f",{number(r / factor)}" for r in radius.tolist()]
    rows = zip(before.tolist(), widths, length.tolist(), ends, strict=True)
    return [f"{width if is_set else ''}F({number(step)}{end})" for is_set, width, step, end in rows]


def _base(radius: float, convention: Convention) -> str:
    """Return what states the radius of the root: the first width that is set."""
    widen = _widener(convention)
    return f"{widen}({_width(radius, convention)})" if widen else ""


def _widener(convention: Convention) -> str:
    return next((name for name, (does, _) in convention.symbols.items() if does == WIDTH), "")


def _width(radius: float, convention: Convention) -> str:
    widen = _widener(convention)
    return number(radius / convention.symbols[widen][1]) if widen else ""


def _heading(tree: TreeModel, profile: Profile) -> str:
    """Return the comment lines: which convention this is and where the string starts."""
    convention = CONVENTIONS[profile]
    crs = " ".join((tree.skeleton.crs or "unknown").split())
    x, y, z = (f"{value:.{ANCHOR_DECIMALS}f}" for value in anchor(tree))
    heading, left, up = (" ".join(f"{value:g}" for value in axis) for axis in convention.start)
    lines = (
        f"treepipe L-string, profile {profile}, version {VERSION}",
        f"origin {x} {y} {z} crs {crs}",
        "metres and degrees, local to the origin; x east, y north, z up",
        f"start: heading {heading}, left {left}, up {up}; angles are relative to the turtle",
        _thickness(convention),
    )
    return "".join(f"{convention.comment} {line}\n" for line in lines)


def _thickness(convention: Convention) -> str:
    """Say how a segment's thickness is written."""
    if convention.thickness is None:
        return "F(length), !(diameter)"
    return f"F(length, {'radius' if convention.tapers else 'diameter'} at its end)"
