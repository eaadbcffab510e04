"""The frame of a turtle (heading, left, up) and the turns that lead it to every node.

Our own turtle adds up two angles; those of other programs turn in their own frame, so every turn is
derived anew from where that turtle will stand and how it will be turned: a closed loop, as in `loop`.
Headings are reached by a turn about up and a pitch about left, never by a roll: programs agree on the
former and not on which way ``/`` rolls.
"""

from __future__ import annotations

from math import atan2, cos, hypot, sin

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.lsystem.dialects.conventions import PITCH, TURN
from pipeline.lsystem.loop import NO_ROLL_M, RADIAN, decimals_for, folded
from pipeline.model import Floats, Ints

HEADING, LEFT, UP = range(3)
"""Rows of a frame."""


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
