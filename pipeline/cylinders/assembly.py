"""From dense, measured axes to the final tree model: few nodes, close to the points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.axes import Axes
from pipeline.geometry.compiled import compiled
from pipeline.geometry.noise import ROBUST
from pipeline.geometry.polyline import douglas_peucker
from pipeline.geometry.windows import Shared

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


FINER = 0.6  # radii are kept more closely than positions: volumes hang on them
SPEAKS_FOR = 30.0  # points
THIN_SCATTER = 1.75  # what noise alone makes of the points of a thin twig, over its standard deviation
LEAST_M = 0.0002  # no tolerance is finer than this


@dataclass(frozen=True)
class Tolerance:
    """How far the final nodes may leave the dense ones.

    Parameters
    ----------
    share, radius_share : float
        Tolerances of position and radius as shares of the local radius.
    cap_m, radius_cap_m : float
        Largest tolerances where the points are sharp, metres.
    """

    share: float
    radius_share: float
    cap_m: float
    radius_cap_m: float


def chosen_nodes(axes: Axes, tolerance: Tolerance, least: Floats, always: Ints) -> Ints:
    """Nodes that stay after Douglas-Peucker on position and radius.

    Parameters
    ----------
    axes : Axes
    tolerance : Tolerance
    least : (M,) array
        Least tolerance at every node, metres: what the points leave open need not be drawn.
    always : (K,) array of int
        Nodes that stay in any case, as the feet of branches do.
    """
    least = np.maximum(least, LEAST_M)
    radius = axes.radius
    place = np.maximum(np.minimum(tolerance.share * radius, tolerance.cap_m), least)
    width = np.maximum(np.minimum(tolerance.radius_share * radius, tolerance.radius_cap_m), FINER * least)
    keep = np.zeros(len(axes.xyz), dtype=bool)
    keep[axes.foot[1:]] = keep[always] = keep[axes.first[:-1]] = keep[axes.first[1:] - 1] = True
    _keep_more(axes.xyz, axes.first, (radius, width, place), keep)
    return np.flatnonzero(keep)


@compiled
def _keep_more(
    xyz: Floats, first: Ints, told: tuple[Floats, Floats, Floats], keep: NDArray[np.bool_]
) -> None:
    """Add the nodes that Douglas-Peucker keeps between two kept ones of a branch."""
    radius, width, place = told
    for b in range(len(first) - 1):
        fixed = np.flatnonzero(keep[first[b] : first[b + 1]]) + first[b]
        for k in range(len(fixed) - 1):
            low, high = fixed[k], fixed[k + 1] + 1
            values = np.empty((high - low, 4))
            values[:, :3] = xyz[low:high]
            values[0, 3] = 0.0
            for i in range(1, high - low):
                values[i, 3] = values[i - 1, 3] + (radius[low + i] - radius[low + i - 1]) / width[low + i]
            chosen = douglas_peucker(values, place[low:high])
            for i in range(high - low):
                keep[low + i] |= chosen[i]


def looseness(axes: Axes, shared: Shared, noise: float) -> Floats:
    """(M,) how far the points of each branch scatter about its surface beyond the noise, metres.

    Parameters
    ----------
    axes : Axes
    shared : Shared
        The points of each branch.
    noise : float
        Range noise, metres.
    """
    away = np.abs(shared.away)
    count = np.diff(shared.first)
    own = _medians(away, shared.first)
    # a branch of few points fits them too well: the tree speaks for it as so many points
    scatter = (count * own + SPEAKS_FOR * np.median(away)) / (count + SPEAKS_FOR)
    excess = (ROBUST * scatter) ** 2 - (THIN_SCATTER * noise) ** 2
    return np.asarray(np.sqrt(np.maximum(excess, 0.0))[axes.branch])


@compiled
def _medians(values: Floats, first: Ints) -> Floats:
    """Median of every run, 0 where it is empty."""
    out = np.zeros(len(first) - 1)
    for b in range(len(out)):
        run = np.sort(values[first[b] : first[b + 1]])
        if len(run):
            out[b] = (run[(len(run) - 1) // 2] + run[len(run) // 2]) / 2.0
    return out


def assemble(axes: Axes, nodes: Ints) -> tuple[Ints, Ints]:
    """Return which dense node stands at each final node, and the final parents.

    A branch's foot is its parent's node, so it is not repeated.

    Parameters
    ----------
    axes : Axes
    nodes : (K,) array of int
        Dense nodes that stay, sorted; every branch's first and last are among them.
    """
    is_foot = np.zeros(len(axes.xyz), dtype=bool)
    is_foot[axes.first[1:-1]] = True
    body = nodes[~is_foot[nodes]]
    number = np.full(len(axes.xyz), -1, dtype=np.int64)
    number[body] = np.arange(len(body))
    for start, foot in zip(axes.first[1:-1], axes.foot[1:], strict=True):
        number[start] = number[foot]  # parents come first, so a foot on a foot is resolved already
    parent = np.arange(len(body)) - 1
    branch = axes.branch[body]
    fresh = np.flatnonzero(np.diff(branch)) + 1
    parent[fresh] = number[axes.foot[branch[fresh]]]
    return body, parent
