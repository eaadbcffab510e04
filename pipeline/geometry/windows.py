"""One estimate of centre and radius at every node, from the points in a window along its branch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.axes import Axes
from pipeline.geometry.compiled import compiled
from pipeline.geometry.estimates import FEW, Estimate, estimate
from pipeline.geometry.levenberg import frame
from pipeline.geometry.surface import nearest_tube

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ENOUGH = 60  # points that a window grows for where noise is as wide as the wood
SHARP, FEWEST = 0.06, 16  # with less noise fewer will do: those that give the radius to this share
LONG_M = 0.15  # a window is about as long as the branch is thick, but no longer than this unasked
PLENTY = 120  # points beyond which a window is thinned


@dataclass(frozen=True, eq=False)
class Windows:
    """What the points say at every node.

    Parameters
    ----------
    kind : (M,) array of int
        NONE, CYLINDER or MOMENTS.
    shift : (M, 3) array
        From the node to the estimated centre, in metres.
    square : (M,) array
        Estimated squared radius, noise subtracted; may be negative.
    variance : (M,) array
        Predicted variance of `square` (not from the estimate itself), in m^4.
    centre_variance : (M,) array
        Predicted variance of the centre, in square metres.
    count : (M,) array of int
    spread : (M,) array
        Robust standard deviation of the residuals, in metres.
    arc : (M,) array
        Part of the circle that the points cover, in radians.
    evidence : (M,) array
        0 to 1: how much the points look like the shell of a branch, and not like leaves or a
        bundle of twigs.
    facing : (M, 3) array
        Mean of the unit vectors from the axis to the points of a fitted cylinder: nothing for bark seen
        all round, 0.64 long towards the scanner for bark seen from one side.
    """

    kind: Ints
    shift: Floats
    square: Floats
    variance: Floats
    centre_variance: Floats
    count: Ints
    spread: Floats
    arc: Floats
    evidence: Floats
    facing: Floats


@dataclass(frozen=True, eq=False)
class Shared:
    """The points shared out to the branches, each sorted along its branch.

    Parameters
    ----------
    xyz : (P, 3) array
    arc : (P,) array
        Position along the branch, in metres from its foot.
    first : (B + 1,) array of int
        Where each branch's points begin, and the end of the last.
    node_arc : (M,) array
        Position of every node along its branch, in metres.
    away : (P,) array
        Distance from the surface, in metres; below zero inside.
    """

    xyz: Floats
    arc: Floats
    first: Ints
    node_arc: Floats
    away: Floats


def share_out(xyz: Floats, axes: Axes) -> Shared:
    """Give every point to the branch whose surface is nearest (at first, whose axis is).

    Parameters
    ----------
    xyz : (P, 3) array
    axes : Axes
    """
    tubes, end = axes.tubes()
    near = nearest_tube(xyz, tubes)
    step = np.linalg.norm(np.diff(axes.xyz, axis=0, prepend=axes.xyz[:1]), axis=1)
    step[axes.first[:-1]] = 0.0
    total = np.cumsum(step)
    node_arc = total - np.repeat(total[axes.first[:-1]], np.diff(axes.first))
    at = end[near.segment]
    arc = node_arc[at] - (1.0 - near.share) * step[at]
    branch = axes.branch[at]
    order = np.lexsort((arc, branch))
    first = np.searchsorted(branch[order], np.arange(len(axes.foot) + 1))
    return Shared(np.ascontiguousarray(xyz[order]), arc[order], first, node_arc, near.surface[order])


def measure(axes: Axes, shared: Shared, noise: float, window_m: float) -> Windows:
    """Estimate centre and squared radius at every node.

    Where the branch is thick against the noise, a cylinder is fitted by Levenberg-Marquardt and
    the outward bias of a noisy circle, the noise squared, is taken off. Where it is thin, the mean
    square distance from the local mean line stands for the squared radius, less twice the noise
    squared.

    Parameters
    ----------
    axes : Axes
    shared : Shared
    noise : float
        Range noise (one standard deviation), metres.
    window_m : float
        Least length of a window, metres.
    """
    count = len(axes.xyz)
    out = Windows(
        np.zeros(count, dtype=np.int64),
        np.zeros((count, 3)),
        np.zeros(count),
        np.full(count, np.inf),
        np.full(count, np.inf),
        np.zeros(count, dtype=np.int64),
        np.zeros(count),
        np.zeros(count),
        np.zeros(count),
        np.zeros((count, 3)),
    )
    _measure(
        (axes.xyz, axes.frames(), axes.square, axes.first),
        (shared.xyz, shared.arc, shared.first, shared.node_arc),
        (noise, window_m),
        (out.kind, out.count),
        (out.shift, out.facing, out.square, out.variance, out.centre_variance),
        (out.spread, out.arc, out.evidence),
    )
    return out


@compiled
def _measure(
    axes: tuple[Floats, Floats, Floats, Ints],
    shared: tuple[Floats, Floats, Ints, Floats],
    settings: tuple[float, float],
    counts: tuple[Ints, Ints],
    out: tuple[Floats, Floats, Floats, Floats, Floats],
    looks: tuple[Floats, Floats, Floats],
) -> None:
    nodes, directions, squares, first = axes
    points, arcs, begin, node_arc = shared
    noise, window = settings
    kind, count = counts
    shift, facing, square, variance, centre_variance = out
    spread, arc, evidence = looks
    for b in range(len(first) - 1):
        run = arcs[begin[b] : begin[b + 1]]
        for i in range(first[b], first[b + 1]):
            radius = np.sqrt(max(squares[i], 0.0))
            least, most = max(window, min(radius, LONG_M)), max(3.0 * window, 2.0 * radius)
            needed = min(max(2.0 * (noise / max(SHARP * radius, 1e-6)) ** 2, FEWEST), ENOUGH)
            low, high = _window(run, node_arc[i], least, most, needed)
            count[i] = high - low
            if high - low < FEW:
                continue
            stride = 1 + (high - low) // PLENTY
            basis = frame(directions[i])
            local = _to_frame(points[begin[b] + low : begin[b] + high : stride], nodes[i], basis)
            found = estimate(local, radius, noise)
            kind[i] = int(found[0])
            shift[i] = found[1] * basis[0] + found[2] * basis[1]
            square[i], variance[i], centre_variance[i] = found[3], found[4], found[5]
            spread[i], arc[i], evidence[i] = found[6], found[7], found[8]
            facing[i] = found[9] * basis[0] + found[10] * basis[1]


@compiled
def _window(run: Floats, at: float, least: float, most: float, needed: float) -> tuple[int, int]:
    """Positions in `run` within a window around `at` that grows until it holds enough points."""
    half = 0.5 * least
    while True:
        low, high = np.searchsorted(run, at - half), np.searchsorted(run, at + half)
        if high - low >= needed or half >= 0.5 * most:
            return int(low), int(high)
        half *= 1.3


@compiled
def _to_frame(points: Floats, centre: Floats, basis: Floats) -> Floats:
    local = np.empty((len(points), 3))
    for i in range(len(points)):
        for k in range(3):
            total = 0.0
            for d in range(3):
                total += (points[i, d] - centre[d]) * basis[k, d]
            local[i, k] = total
    return local


@compiled
def estimate_window(
    points: Floats, centre: Floats, direction: Floats, radius: float, noise: float
) -> Estimate:
    """One window on its own: points around a centre on the axis.

    Returns
    -------
    tuple
        kind, centre shift (two), square, variance of the square, variance of the centre, spread,
        arc, evidence, facing (two); as in `Windows`.
    """
    return estimate(_to_frame(points, centre, frame(direction)), radius, noise)
