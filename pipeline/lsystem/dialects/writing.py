"""A tree as the L-string that other programs read.

References
----------
Prusinkiewicz, P. and Lindenmayer, A. (1990), The algorithmic beauty of plants, section 1.5. Changed:
angles are exact where the reader stands, not those of rules.
"""

from __future__ import annotations

import numpy as np

from pipeline.lsystem.dialects.conventions import (
    CONVENTIONS,
    PITCH,
    TURN,
    WIDTH,
    Convention,
    Profile,
    Symbols,
    convention_of,
)
from pipeline.lsystem.dialects.frames import close_frames
from pipeline.lsystem.encode import ANCHOR_DECIMALS, RADIUS_DECIMALS, nested
from pipeline.lsystem.numbering import canonical
from pipeline.lsystem.tokens import number
from pipeline.model import Floats, Skeleton, TreeModel

VERSION = 1

LENGTH_SCALE = 1000
"""Units in a metre: lengths have 3 decimals."""
THINNEST_M = 0.0001
"""The least radius that is written: L-Py draws a radius of 0 as no tube, cpfg has a least width."""


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
