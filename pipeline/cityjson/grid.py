"""Points on a grid of whole steps, each once."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Floats

Whole = NDArray[np.int64]


def steps(local: Floats, origin: Floats, translate: Floats, step: float) -> Whole:
    """Round local coordinates to whole steps from `translate`.

    Parameters
    ----------
    local : (P, 3) array of float64
        Metres from `origin`.
    origin, translate : (3,) array of float64
        World coordinates of both zeros.
    step : float
        Metres.

    Returns
    -------
    (P, 3) array of int64
    """
    return np.rint((local + (origin - translate)) / step).astype(np.int64)


def merged(points: Whole) -> tuple[Whole, Whole]:
    """Make one of the points that stand in one place.

    Parameters
    ----------
    points : (P, 3) array of int64

    Returns
    -------
    vertices : (V, 3) array of int64
        Every place once, in the order of its first point.
    number : (P,) array of int64
        The vertex of each point.
    """
    order = np.lexsort(points.T)
    first = np.ones(len(order), dtype=bool)
    first[1:] = (points[order[1:]] != points[order[:-1]]).any(axis=1)
    group = np.empty(len(order), dtype=np.int64)
    group[order] = np.cumsum(first) - 1
    speaker = np.full(int(first.sum()), len(order), dtype=np.int64)
    np.minimum.at(speaker, group, np.arange(len(order)))
    rank = np.empty(len(speaker), dtype=np.int64)
    rank[np.argsort(speaker)] = np.arange(len(speaker))
    return points[np.sort(speaker)], rank[group]


def only_used(vertices: Whole, parts: list[Whole]) -> tuple[Whole, list[Whole]]:
    """Drop the vertices that no part names, and renumber.

    Parameters
    ----------
    vertices : (V, 3) array of int64
    parts : list of array of int64
        Numbers of vertices, of any shape.

    Returns
    -------
    vertices : (U, 3) array of int64
    parts : list of array of int64
        The parts in the new numbers.
    """
    used = np.zeros(len(vertices), dtype=bool)
    for part in parts:
        used[part] = True
    number = np.cumsum(used) - 1
    return vertices[used], [number[part] for part in parts]
