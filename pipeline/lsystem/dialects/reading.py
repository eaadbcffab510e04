"""The turtles of other programs: an L-string in one of their conventions becomes a tree.

Reads what `writing` writes, and strings of others that keep to the turns, ``F``, widths and
brackets of a convention; `docs/lstring.md` states each.
"""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputFormatError
from pipeline.geometry.compiled import compiled
from pipeline.lsystem.dialects.conventions import (
    CLOSE,
    FORWARD,
    OPEN,
    PROFILES,
    WIDTH,
    Convention,
    Profile,
    convention_of,
)
from pipeline.lsystem.dialects.frames import HEADING, rotate
from pipeline.lsystem.numbering import carried, continued, numbered
from pipeline.lsystem.tokens import excerpt
from pipeline.model import PROPAGATED, Floats, Ints, Skeleton, TreeModel

_STATED = re.compile(r"treepipe L-string, profile (\w+)")
_ORIGIN = re.compile(r"^(?:#|//) origin (\S+) (\S+) (\S+) crs (.+)$", re.MULTILINE)
_COMMENT = re.compile(r"^\s*(?:#|//).*$", re.MULTILINE)
_BODIES: dict[Profile, re.Pattern[str]] = {
    "lpy": re.compile(r"Axiom:(.*)"),
    "groimp": re.compile(r"==>([^;]*);"),
    "houdini": re.compile(r"^A=(.*)", re.MULTILINE),
}


class Path(NamedTuple):
    """What a turtle drew, the root included.

    Parameters
    ----------
    xyz : (N, 3) array of float64
        Metres from the start.
    parent : (N,) array of int32
    bracketed : (N,) array of bool
        True where a bracket opened between the parent and the node.
    length, radius : (N,) array of float64
        Of each segment in metres; NaN for a radius that nothing states.
    stray : int
        Position of a bracket without its partner among the symbols, -1 where all match.
    """

    xyz: Floats
    parent: Ints
    bracketed: NDArray[np.bool_]
    length: Floats
    radius: Floats
    stray: int


def from_lstring(text: str, profile: Profile | None = None) -> TreeModel:
    """Read an L-string as a tree, numbered canonically.

    Parameters
    ----------
    text : str
        A whole file or a string alone.
    profile : {"abop", "lpy", "groimp", "houdini"}, optional
        Whose convention it keeps; by default what its comment states, else ABOP.

    Returns
    -------
    TreeModel
        At the origin that the comment states, else at 0; all radii count as propagated, those that
        nothing states are 0.

    Raises
    ------
    InputFormatError
        If a symbol, its value or a bracket is wrong, with the position in the string.
    UsageError
        If there is no such profile.
    """
    stated = profile or profile_of(text)
    convention = convention_of(stated)
    origin, crs = _origin(text)
    path = _walked(_body(text, stated), convention)
    wood = carried(path.parent, np.abs(path.length))
    order, parent = numbered(path.parent, continued(path.parent, path.bracketed, wood))
    count = len(parent)
    return TreeModel(
        Skeleton(path.xyz[order], parent, origin, crs),
        np.nan_to_num(path.radius[order]),
        np.full(count, PROPAGATED, dtype=np.uint8),
        np.full(count, np.nan),
    )


def profile_of(text: str) -> Profile:
    """Return the profile that the comment of an L-string states, ABOP where there is none."""
    stated = _STATED.search(text)
    names = [known for known in PROFILES if stated and known == stated[1]]
    return names[0] if names else "abop"


def _origin(text: str) -> tuple[Floats, str | None]:
    """Return the origin and reference system that the comment states, 0 and None without."""
    stated = _ORIGIN.search(text)
    if stated is None:
        return np.zeros(3), None
    try:
        origin = np.array([float(value) for value in stated.group(1, 2, 3)])
    except ValueError:
        origin = np.full(3, np.nan)
    if not np.isfinite(origin).all():
        msg = f"the origin of the L-string is no point: {stated[0]!r}; give three numbers in metres"
        raise InputFormatError(msg)
    return origin, None if stated[4] == "unknown" else stated[4]


def _body(text: str, profile: Profile) -> str:
    """Return the string alone, without comments and what stands around it."""
    bare = _COMMENT.sub("", text)
    wrapped = _BODIES[profile].search(bare) if profile in _BODIES else None
    return wrapped[1] if wrapped else bare


def _walked(text: str, convention: Convention) -> Path:
    """Follow a string in a convention."""
    places, actions, first, second = _tokenised(text, convention)
    path = Path(*follow(actions, first, second, np.array(convention.start, dtype=np.float64)))
    if path.stray >= 0:
        msg = f"the bracket {excerpt(text, places[path.stray])} has no partner; balance [ and ]"
        raise InputFormatError(msg)
    if (path.radius < 0).any():
        msg = f"a width of the L-string is negative ({path.radius[path.radius < 0][0]:g} m); mend it"
        raise InputFormatError(msg)
    if not np.isfinite(path.xyz).all():
        msg = "the lengths of the L-string add up to more than a number holds; mend its values"
        raise InputFormatError(msg)
    return path


def _tokenised(text: str, convention: Convention) -> tuple[list[int], NDArray[np.uint8], Floats, Floats]:
    """Split a string into places, actions and their two values, in the turtle's own senses.

    A second value is NaN where there is none.
    """
    names = "|".join(re.escape(name) for name in sorted(convention.symbols, key=len, reverse=True))
    token = re.compile(rf"\s*({names})(?:\(\s*([^(),\s]+)\s*(?:,\s*([^(),\s]+)\s*)?\))?")
    rows: list[tuple[int, int, float, float]] = []
    end, whole = 0, len(text.rstrip())
    while end < whole:
        found = token.match(text, end)
        try:
            if found is None:
                raise ValueError
            rows.append((found.start(1), *_read(found[1], found[2], found[3], convention)))
            end = found.end()
        except ValueError:
            at = found.start(1) if found else end + len(text[end:]) - len(text[end:].lstrip())
            msg = (
                f"{excerpt(text, at)} is not part of this L-string; it may hold "
                f"{' '.join(convention.symbols)}, all but brackets with finite values in parentheses"
            )
            raise InputFormatError(msg) from None
    table = np.array([row[1:] for row in rows], dtype=np.float64).reshape(-1, 3)
    return [row[0] for row in rows], table[:, 0].astype(np.uint8), table[:, 1].copy(), table[:, 2].copy()


def _read(
    name: str, first: str | None, second: str | None, convention: Convention
) -> tuple[int, float, float]:
    """Return what one symbol does and its values; ValueError where they are not as they must be."""
    action, factor = convention.symbols[name]
    values = [float(value) for value in (first, second) if value is not None]
    bracket = action in (OPEN, CLOSE)
    most = 0 if bracket else 2 if action == FORWARD and convention.thickness is not None else 1
    if len(values) > most or len(values) < (not bracket) or not np.isfinite(values).all():
        raise ValueError
    end = values[1] * (convention.thickness or 1.0) if len(values) > 1 else float("nan")
    return action, (values[0] * factor if values else 0.0), end


@compiled
def follow(
    actions: NDArray[np.uint8], first: Floats, second: Floats, start: Floats
) -> tuple[Floats, Ints, NDArray[np.bool_], Floats, Floats, int]:
    """Follow a string with a turtle that turns in its own frame; returns the fields of `Path`.

    Parameters
    ----------
    actions : (T,) array of uint8
    first : (T,) array of float64
        Metres, degrees (as `rotate` has them) or a radius.
    second : (T,) array of float64
        Radius at the end of a segment, NaN where it is that of the turtle.
    start : (3, 3) array of float64
        Heading, left and up, one a row.
    """
    count = 1 + (actions == FORWARD).sum()
    xyz, length = np.zeros((count, 3)), np.zeros(count)
    parent = np.full(count, -1, dtype=np.int32)
    bracketed, radius = np.zeros(count, dtype=np.bool_), np.full(count, np.nan)
    room = 1 + (actions == OPEN).sum()
    opened, nodes = np.zeros(room, dtype=np.int64), np.zeros(room, dtype=np.int32)
    flags, widths, frames = np.zeros(room, dtype=np.bool_), np.zeros(room), np.zeros((room, 3, 3))
    here, last, depth, inside = 0, 0, 0, False
    frame, wide = start.copy(), np.nan
    for t in range(len(actions)):
        action, value = actions[t], first[t]
        if action == FORWARD:
            last += 1
            wide = wide if np.isnan(second[t]) else second[t]
            xyz[last] = xyz[here] + value * frame[HEADING]
            parent[last], bracketed[last], length[last], radius[last] = here, inside, value, wide
            here, inside = last, False
        elif action == WIDTH:
            wide = value
        elif action == OPEN:
            opened[depth], nodes[depth], flags[depth] = t, here, inside
            widths[depth], frames[depth] = wide, frame
            depth, inside = depth + 1, True
        elif action == CLOSE:
            if depth == 0:
                return xyz, parent, bracketed, length, radius, t
            depth -= 1
            here, inside, wide = nodes[depth], flags[depth], widths[depth]
            frame = frames[depth].copy()
        else:
            rotate(frame, action, value)
        if last == 0 and np.isnan(radius[0]):  # the first width is that of the root
            radius[0] = wide
    if count > 1 and np.isnan(radius[0]):
        radius[0] = radius[1]
    return xyz, parent, bracketed, length, radius, (opened[depth - 1] if depth else -1)
