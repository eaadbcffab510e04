"""Moves: sub-trees as seen from their feet, and how far a rule would draw their nodes off.

The angles of the turtle are sums, so the nodes that a rule draws lie, in the frame of the roll at its
foot, linearly in (cos rot, sin rot) of the rotation there. A rule therefore comes down to six
coefficients a node, and the squared distance to the nodes of any other sub-tree to a dot product.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.lsystem.transforms.subtrees import Told
from pipeline.model import Floats


class Moves(NamedTuple):
    """Sub-trees of one shape, each seen from its foot in the frame of the roll there.

    Parameters
    ----------
    rot : (M,) array of float64
        Rotation at the foot in radians.
    place : (M, K, 3) array of float64
        Nodes relative to the foot in metres.
    draw : (M, K, 6) array of float64
        What the text of each draws at a foot of any rotation r, by `drawn`: with c = cos r and
        s = sin r a node at (c X1 - s X2, c Y1 - s Y2, -s Z1 - c Z2), in this order.
    """

    rot: Floats
    place: Floats
    draw: Floats


def moves(told: Told, starts: NDArray[np.int64], count: int) -> Moves:
    """Look at the sub-trees of `count` nodes that begin at the nodes `starts`, all of one shape."""
    path, index = told.path, starts[:, None] + np.arange(count)
    foot = told.foot[starts][:, None, :]
    place = turned(path.xyz[index] - path.xyz[path.parent[starts]][:, None, :], -foot[..., 1])
    angle = told.aim[index] - foot
    draw = steps_drawn(angle[..., 0], angle[..., 1], path.length[index])
    local = (path.parent[index[0]] - starts[0]).tolist()
    for node in range(1, count):
        draw[:, node] += draw[:, local[node]]
    return Moves(foot[:, 0, 0], place, draw)


def turned(offset: Floats, roll: Floats) -> Floats:
    """Turn (..., 3) offsets about the vertical by (...) radians."""
    x, y = offset[..., 0], offset[..., 1]
    level = x * np.cos(roll) - y * np.sin(roll), x * np.sin(roll) + y * np.cos(roll)
    return np.stack([*level, offset[..., 2]], axis=-1)


def steps_drawn(rotation: Floats, roll: Floats, length: Floats) -> Floats:
    """Return the (..., 6) coefficients of single steps, turned in sum since the foot; see `Moves`."""
    c, s = length * np.cos(rotation), length * np.sin(rotation)
    ahead, aside = np.cos(roll), np.sin(roll)
    return np.stack([c * ahead, s * ahead, c * aside, s * aside, c, s], axis=-1)


def nodes_drawn(draw: Floats, rot: Floats) -> Floats:
    """Return the (..., 3) nodes that coefficients draw at a foot of rotation `rot`, in radians."""
    c, s = np.cos(rot), np.sin(rot)
    x1, x2, y1, y2, z1, z2 = np.moveaxis(draw, -1, 0)
    return np.stack([c * x1 - s * x2, c * y1 - s * y2, -s * z1 - c * z2], axis=-1)


def drawing(draw: Floats) -> Floats:
    """Return the (K, R, 10) half of `squared_distances` that R rules of K nodes make; see `Moves.draw`."""
    x1, x2, y1, y2, z1, z2 = np.moveaxis(draw, (2, 1), (0, 1))
    square = x1**2 + y1**2 + z2**2, x2**2 + y2**2 + z1**2, 2 * (z1 * z2 - x1 * x2 - y1 * y2)
    return np.stack([*square, x1, x2, y1, y2, z1, z2, np.ones_like(x1)], axis=-1)


def seeing(to: Moves) -> Floats:
    """Return the (K, 10, M) half of `squared_distances` that M sub-trees of K nodes make."""
    c, s = np.cos(to.rot), np.sin(to.rot)
    x, y, z = 2 * to.place.T
    away = (to.place.T**2).sum(axis=0)
    c, s = np.broadcast_to(c, away.shape), np.broadcast_to(s, away.shape)
    return np.stack([c * c, s * s, c * s, -c * x, s * x, -c * y, s * y, s * z, c * z, away], axis=1)


def squared_distances(drawing: Floats, seeing: Floats) -> Floats:
    """Return the (..., R, M) squared distances of nodes from where R rules draw them, in square metres."""
    return np.maximum(drawing @ seeing, 0)
