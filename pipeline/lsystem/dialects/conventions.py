"""What the turtles of other programs do: ABOP, L-Py, GroIMP and Houdini; `docs/lstring.md` states each.

References
----------
Prusinkiewicz, P. and Lindenmayer, A. (1990), The algorithmic beauty of plants, section 1.5.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal, NamedTuple, get_args

from pydantic import Field

from pipeline.choosing import named
from pipeline.options import Options

Profile = Literal["abop", "lpy", "groimp", "houdini"]
PROFILES: tuple[Profile, ...] = get_args(Profile)

FORWARD, TURN, PITCH, ROLL, WIDTH, OPEN, CLOSE = range(7)
"""What a symbol does."""

Symbols = Mapping[str, tuple[int, float]]


class LstringOptions(Options):
    """How a tree is written for another L-system program."""

    profile: Profile = Field(default="abop", description="whose convention a .lstring keeps")


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

CONVENTIONS: Mapping[str, Convention] = MappingProxyType(
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


def convention_of(profile: str) -> Convention:
    """Return the convention of a profile.

    Raises
    ------
    UsageError
        If there is no such profile, listing those there are.
    """
    return named(profile, CONVENTIONS, "L-string profile")
