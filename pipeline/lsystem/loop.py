"""The closed loop: every turn and step is taken from where the reader will stand.

The open loop of 2021 rounded relative angles and let the error of one node turn everything behind
it. Here each length, rotation and roll is computed from the position that has already been decoded
and the angles that have already been rounded, is rounded itself and decoded again; an error lives
for one node and never adds up.
"""

from __future__ import annotations

from math import atan2, cos, pi, sin

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.lsystem.turtle import step
from pipeline.model import Floats, Ints

ANGLE_SLACK_M = 0.0002
"""How far rounding an angle may move a node sideways; with 0.5 mm along it stays below 0.6 mm."""
NO_ROLL_M = 0.00001
"""A roll that moves a node by less is not worth its characters; on a vertical heading none is."""
MOST_DECIMALS = 4
RADIAN = pi / 180


@compiled
def decimals_for(length: float) -> int:
    """Return the fewest decimals of a degree that keep a node within `ANGLE_SLACK_M`."""
    decimals, quantum = 0, 1.0
    while decimals < MOST_DECIMALS and length * quantum * RADIAN / 2 > ANGLE_SLACK_M:
        decimals += 1
        quantum /= 10
    return decimals


@compiled
def folded(angle: float, scale: int, half_turn: int) -> int:
    """Round an angle to units of 1/scale and fold it into (-half_turn, half_turn]."""
    units = int(np.rint(angle * scale)) % (2 * half_turn)
    return units - 2 * half_turn if units > half_turn else units


@compiled
def rotation_to(ahead: float, up: float, rot: float, scale: int) -> int:
    """Return the rounded rotation from `rot` towards a point `ahead` and `up` in the roll's plane."""
    return folded(atan2(-up, ahead) / RADIAN - rot, scale, 180 * scale)


@compiled
def turn(offset: Floats, rot: float, roll: float, length: float, scale: int) -> tuple[int, int]:
    """Find the rounded rotation and roll that head for a point.

    Parameters
    ----------
    offset : (3,) array of float64
        From where the reader stands to where it should go, in metres.
    rot, roll : float
        Accumulated angles in degrees.
    length : float
        The rounded length of the step.
    scale : int
        Units in a degree.

    Returns
    -------
    rotation, roll : int
        In units of 1/scale degree. The roll is the smaller one of the two that reach the plane of
        the point, and nothing where it would move the point less than `NO_ROLL_M`. The choice is
        made on rounded angles alone, so that encoding a decoded tree makes it again.
    """
    across = folded(atan2(offset[1], offset[0]) / RADIAN - roll, scale, 90 * scale)
    for rolled in (across, 0):
        azimuth = (roll + rolled / scale) * RADIAN
        ahead = offset[0] * cos(azimuth) + offset[1] * sin(azimuth)
        rotated = rotation_to(ahead, offset[2], rot, scale)
        level = length * cos((rot + rotated / scale) * RADIAN)
        if rolled == 0 or abs(level * sin(rolled / scale * RADIAN)) > NO_ROLL_M:
            break
    return rotated, rolled


@compiled
def close_loop(
    xyz: Floats, parent: Ints, length_scale: int, least_decimals: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Encode every node from its decoded parent.

    Parameters
    ----------
    xyz : (N, 3) array of float64
        Nodes in metres from the stored anchor, parents first.
    parent : (N,) array of int32
    length_scale : int
        Units in a metre.
    least_decimals : int
        Decimals of a degree, unless a length asks for more.

    Returns
    -------
    steps, rotations, rolls : (N,) array of int64
        Lengths in units of 1/length_scale metre, turns in units of 1/angle_scale degree.
    angle_scale : (N,) array of int64
    """
    count = len(xyz)
    steps, rotations = np.zeros(count, dtype=np.int64), np.zeros(count, dtype=np.int64)
    rolls, angle_scale = np.zeros(count, dtype=np.int64), np.ones(count, dtype=np.int64)
    at, rot, roll = np.zeros((count, 3)), np.zeros(count), np.zeros(count)
    for i in range(1, count):
        p = parent[i]
        offset = xyz[i] - at[p]
        steps[i] = int(np.rint(np.sqrt((offset * offset).sum()) * length_scale))
        length = steps[i] / length_scale
        if steps[i] > 0:
            scale = 10 ** max(least_decimals, decimals_for(length))
            rotations[i], rolls[i] = turn(offset, rot[p], roll[p], length, scale)
            angle_scale[i] = scale
        rot[i] = rot[p] + rotations[i] / angle_scale[i]
        roll[i] = roll[p] + rolls[i] / angle_scale[i]
        step(at[p], rot[i] * RADIAN, roll[i] * RADIAN, length, at[i])
    return steps, rotations, rolls, angle_scale
