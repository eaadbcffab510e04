"""Which points are leaves and branches: a vote among neighbours on how round a neighbourhood is.

A wall, a roof, a pole or a wire spreads in two directions or one; a crown spreads in three. Every
cube of the cloud and the cubes that touch it have a sphericity, the smallest variance over the
largest. One cube alone is a poor judge (a wall with a balcony, a lone branch), so the share of round
points is spread from cube to touching cube a few times: a vote of what hangs together, as far as the
rounds reach. A vote of whole components would hang on points far away, and a crown that touches a
roof would be lost with it, or the roof won.
"""

from __future__ import annotations

import itertools

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from pipeline.airborne.raster import Mask
from pipeline.airborne.voxels import TOUCHING, gathered, spreads, voxels
from pipeline.geometry.compiled import compiled
from pipeline.model import Floats
from pipeline.options import Options


class VegetationOptions(Options):
    """When a point is taken for vegetation."""

    voxel_m: float = Field(default=0.5, ge=0.1, le=2, description="side of the cubes of the vote in metres")
    min_sphericity: float = Field(
        default=0.05, ge=0, le=1, description="smallest over largest variance above which points are round"
    )
    min_share: float = Field(
        default=0.5, ge=0, le=1, description="share of round points above which a neighbourhood is vegetation"
    )
    vote_rounds: int = Field(default=4, ge=0, le=8, description="how many cubes far the vote reaches")
    min_points: int = Field(
        default=20, ge=1, le=1000, description="fewest points that hang together within the reach of the vote"
    )


STRIP_POINTS = 2_000_000
"""Points of a strip, about: cubes and what is known of them are held for one strip at a time."""

STRIP_M = 25.0
"""No strip is narrower: below, the points read on both sides would be most of it."""


def vegetation(
    xyz: Floats, origin: Floats, options: VegetationOptions, asked: NDArray[np.int64] | None = None
) -> Mask:
    """(N,) mask of the points that are vegetation by their shape.

    Parameters
    ----------
    xyz : (P, 3) array
        Snapped points in metres from `origin`.
    origin : (3,) array
        Whole metres.
    options : VegetationOptions
    asked : (N,) array of int, optional
        Positions of those that are well above the ground and no buildings; the others take no part.
        All of them if not given.
    """
    asked = np.arange(len(xyz)) if asked is None else asked
    out = np.zeros(len(asked), dtype=bool)
    margin = (options.vote_rounds + 2) * options.voxel_m  # what a vote hangs on, and a cube that is cut
    y = xyz[asked, 1]
    for south, north in itertools.pairwise(_strips(y)):
        near = np.flatnonzero((y >= south - margin) & (y < north + margin))
        own = (y[near] >= south) & (y[near] < north)
        out[near[own]] = _voted(xyz[asked[near]], origin, options)[own]
    return out


def _strips(y: Floats) -> list[float]:
    """Edges of strips with about as many points each, from south to north; the result does not show them."""
    count = -(-len(y) // STRIP_POINTS)
    if count <= 1:
        return [-np.inf, np.inf]
    places = len(y) * np.arange(1, count) // count
    edges, south = [-np.inf], float(y.min())
    for edge in np.partition(y, places)[places].tolist():
        if edge - max(edges[-1], south) >= STRIP_M:
            edges.append(edge)
    return [*edges, np.inf]


def _voted(xyz: Floats, origin: Floats, options: VegetationOptions) -> Mask:
    """(P,) mask of the points whose neighbourhood is vegetation; those near the edge lack neighbours."""
    cubes = voxels(xyz, origin, options.voxel_m)
    spread = spreads(gathered(cubes.moments, cubes.near, cubes.side))
    with np.errstate(invalid="ignore"):  # points that span no ellipsoid are not round
        is_round = spread[:, 2] > options.min_sphericity * spread[:, 0]
    count = cubes.count.astype(np.float64)
    share = _spread_out(np.where(is_round, count, 0.0), count, cubes.near, options.vote_rounds)
    asked = share > options.min_share
    return _company(asked, cubes.count, cubes.near, options.min_points, options.vote_rounds)[cubes.of_point]


@compiled
def _spread_out(yes: Floats, count: Floats, near: NDArray[np.int32], rounds: int) -> Floats:
    """(V,) share of round points about every cube: each round, a cube takes the sum over those it touches."""
    yes, count = yes.copy(), count.copy()
    for _ in range(rounds):
        more_yes, more = yes.copy(), count.copy()
        for v in range(len(count)):
            for slot in range(TOUCHING):
                other = near[v, slot]
                if other >= 0:
                    more_yes[v] += yes[other]
                    more[v] += count[other]
        yes, count = more_yes, more
    return yes / count


@compiled
def _company(asked: Mask, count: NDArray[np.int64], near: NDArray[np.int32], least: int, rounds: int) -> Mask:
    """(V,) which of the cubes asked for have so many points that hang together within so many cubes."""
    out = np.zeros(len(count), dtype=np.bool_)
    seen = np.full(len(count), -1, dtype=np.int32)
    queue = np.empty(len(count), dtype=np.int32)
    for v in range(len(count)):
        if not asked[v]:
            continue
        total, begin, end = count[v], 0, 1
        queue[0], seen[v] = v, v
        for _ in range(rounds):
            if total >= least or begin == end:
                break
            last = end
            for at in range(begin, last):
                for slot in range(TOUCHING):
                    other = near[queue[at], slot]
                    if other >= 0 and seen[other] != v:
                        seen[other] = v
                        queue[end] = other
                        end += 1
                        total += count[other]
            begin = last
        out[v] = total >= least
    return out
