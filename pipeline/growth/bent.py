"""Where the nodes of a tree are after axes of its metamers have been bent."""

from __future__ import annotations

import numpy as np

from pipeline.growth.conversion import Conversion
from pipeline.growth.state import Metamers
from pipeline.model import Floats, Ints

BACK = -1.0 + 1e-9
"""Cosine from which on a turn is one right round."""


def unbent(xyz: Floats, origin: Conversion, metamers: Metamers, row: Ints) -> Floats:
    """Return the nodes of a tree; those of bent metamers move, each with its metamer as a stiff rod.

    Parameters
    ----------
    xyz : (N, 3) array
        As they were; the very same array comes back where nothing has been bent.
    origin : Conversion
    metamers : Metamers
        As they are now.
    row : (K,) array
        The number that each metamer of then has now, -1 where it is gone.
    """
    then, now, stations = origin.metamers.held(), metamers.held(), origin.stations
    moved = (then["end"] != now["end"][row]).any(axis=1) | (then["begin"] != now["begin"][row]).any(axis=1)
    moved &= row >= 0
    if not moved.any():
        return xyz
    out = xyz.copy()
    for node in np.flatnonzero(moved[stations.holder]).tolist():
        metamer = int(stations.holder[node])
        here = int(row[metamer])
        if stations.segment[metamer] == node and stations.share[metamer] >= 1.0:
            out[node] = now["end"][here]
            continue
        off = xyz[node] - then["begin"][metamer]
        out[node] = now["begin"][here] + turn(off, then["direction"][metamer], now["direction"][here])
    return out


def turn(vector: Floats, before: Floats, after: Floats) -> Floats:
    """Turn a vector as the shortest turn takes one unit vector to another.

    Examples
    --------
    >>> turn(np.array([0.0, 0.0, 2.0]), np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])).tolist()
    [2.0, 0.0, 0.0]
    """
    axis, cosine = np.cross(before, after), float(before @ after)
    if cosine < BACK:
        return -vector
    across = np.cross(axis, vector)
    return np.asarray(cosine * vector + across + axis * float(axis @ vector) / (1.0 + cosine))
