"""The turtle of 2021: symbols to nodes, and the arithmetic that its writer has to repeat.

The state is a position and two accumulated angles, `rot` and `roll`; the turtle starts along +X and
heads for ``(cos rot cos roll, cos rot sin roll, -sin rot)``, so that a stem begins with ``-(90)``.
"""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.lsystem import tokens
from pipeline.model import Floats, Ints

FORWARD, RIGHT, LEFT = tokens.FORWARD, tokens.RIGHT, tokens.LEFT
ROLL_RIGHT, ROLL_LEFT = tokens.ROLL_RIGHT, tokens.ROLL_LEFT
WIDTH, OPEN, CLOSE = tokens.WIDTH, tokens.OPEN, tokens.CLOSE


class Walk(NamedTuple):
    """What the turtle stored on its way, the root included.

    Parameters
    ----------
    xyz : (N, 3) array of float64
        Metres from the anchor.
    parent : (N,) array of int32
    bracketed : (N,) array of bool
        True where a bracket opened between the parent and the node.
    length : (N,) array of float64
        The value of each F in metres.
    width : (N,) array of float64
        The value of the last ``!`` before each F, NaN where there is none.
    stray : int
        Position of a bracket without its partner among the symbols, -1 where all match.
    """

    xyz: Floats
    parent: Ints
    bracketed: NDArray[np.bool_]
    length: Floats
    width: Floats
    stray: int


@compiled
def step(at: Floats, rot: float, roll: float, length: float, to: Floats) -> None:
    """Write into `to` the point that lies `length` ahead of `at`; angles in radians."""
    level = cos(rot)
    to[0] = at[0] + length * (level * cos(roll))
    to[1] = at[1] + length * (level * sin(roll))
    to[2] = at[2] - length * sin(rot)


@compiled
def walk(
    symbols: NDArray[np.uint8], values: Floats, radian: float
) -> tuple[Floats, Ints, NDArray[np.bool_], Floats, Floats, int]:
    """Follow an L-string; returns the fields of `Walk`.

    Parameters
    ----------
    symbols : (T,) array of uint8
    values : (T,) array of float64
        With the default dimensions filled in.
    radian : float
        One unit of angle in radians.
    """
    count = 1 + (symbols == FORWARD).sum()
    xyz, length = np.zeros((count, 3)), np.zeros(count)
    parent = np.full(count, -1, dtype=np.int32)
    bracketed, width = np.zeros(count, dtype=np.bool_), np.full(count, np.nan)
    room = 1 + (symbols == OPEN).sum()
    opened, nodes = np.zeros(room, dtype=np.int64), np.zeros(room, dtype=np.int32)
    flags, rots, rolls = np.zeros(room, dtype=np.bool_), np.zeros(room), np.zeros(room)
    here, last, depth, inside = 0, 0, 0, False
    rot, roll, wide = 0.0, 0.0, np.nan
    for t in range(len(symbols)):
        symbol, value = symbols[t], values[t]
        if symbol == FORWARD:
            last += 1
            step(xyz[here], rot * radian, roll * radian, value, xyz[last])
            parent[last], bracketed[last], length[last], width[last] = here, inside, value, wide
            here, inside, wide = last, False, np.nan
        elif symbol == RIGHT:
            rot += value
        elif symbol == LEFT:
            rot -= value
        elif symbol == ROLL_RIGHT:
            roll += value
        elif symbol == ROLL_LEFT:
            roll -= value
        elif symbol == WIDTH:
            wide = value
        elif symbol == OPEN:
            opened[depth], nodes[depth], flags[depth] = t, here, inside
            rots[depth], rolls[depth] = rot, roll
            depth, inside = depth + 1, True
        elif symbol == CLOSE:
            if depth == 0:
                return xyz, parent, bracketed, length, width, t
            depth -= 1
            here, inside, rot, roll = nodes[depth], flags[depth], rots[depth], rolls[depth]
    return xyz, parent, bracketed, length, width, (opened[depth - 1] if depth else -1)
