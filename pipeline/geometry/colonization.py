"""Space colonization: nodes grow towards the points that are nearest to them, and use them up.

The points never move, so they are binned once. Every point remembers the nearest node that perceives it and
how near any node came; each iteration shows it the *new* nodes alone, which gives what a search among all
nodes would give, also where the kill distance rises or falls.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

from pipeline.errors import UsageError
from pipeline.geometry.attraction import (
    Floats,
    Ints,
    Mask,
    binned,
    meet,
    planted,
    sprout,
    survivors,
    unseen,
    with_room,
)

StopReason = Literal["exhausted", "out_of_reach", "stalled", "max_iter"]

ALL_ROUND_DEG = 360.0


class Rules(NamedTuple):
    """How nodes grow.

    Attributes
    ----------
    step_m : float
        Length of a new segment, metres.
    influence_m : float
        Farthest that a point attracts a node from, metres.
    perception_deg : float
        Full angle of the cone ahead of a node in which it perceives points; 360 is all round.
    tropism : (float, float, float)
        Vector that bends every direction.
    tropism_on : {"sum", "unit"}
        Whether the vector is added to the sum of the unit vectors to the points, so that many points
        outweigh it, or to the direction of that sum.
    """

    step_m: float
    influence_m: float
    perception_deg: float = ALL_ROUND_DEG
    tropism: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tropism_on: Literal["sum", "unit"] = "sum"


class Progress(NamedTuple):
    """How far the growth is.

    Attributes
    ----------
    done, iterations : int
        Iterations done and asked for.
    nodes, points_left : int
        Nodes so far, and points that none of them has come near to.
    xyz : (nodes, 3) array
    parent : (nodes,) array of int
        The nodes so far, as in `Colony`; they stay as they are while the growth goes on.
    """

    done: int
    iterations: int
    nodes: int
    points_left: int
    xyz: Floats
    parent: Ints


class Colony(NamedTuple):
    """What has grown.

    Attributes
    ----------
    xyz : (N, 3) array
        The first nodes and the new ones in the order of their birth, metres.
    parent : (N,) array of int
        Parents before children, -1 at the root.
    left : (P,) array of bool
        Points that no node came near to.
    reason : {"exhausted", "out_of_reach", "stalled", "max_iter"}
        Why it ended: no point left, none within the influence distance of a node that perceives it, only
        nodes that are there already, or all iterations done.
    iterations : int
        Iterations that brought new nodes.
    """

    xyz: Floats
    parent: Ints
    left: Mask
    reason: StopReason
    iterations: int


def colonize(
    points: Floats,
    first: tuple[Floats, Ints],
    *,
    rules: Rules,
    kill_m: Floats,
    progress: Callable[[Progress], None] | None = None,
) -> Colony:
    """Grow nodes into a set of points.

    Parameters
    ----------
    points : (P, 3) array
        Attraction points, metres. Sums run in their order within a cell.
    first : ((M, 3) array, (M,) array of int)
        The nodes to start from and their parents, parents first, -1 at node 0.
    rules : Rules
    kill_m : (I,) array
        Distance within which a node uses points up, by iteration, metres.
    progress : callable, optional
        Is told after every iteration.

    Raises
    ------
    UsageError
        If a length is not positive, or a kill distance is not below the influence distance.

    References
    ----------
    Runions, Lane & Prusinkiewicz (2007), "Modeling trees with a space colonization algorithm"; the cone of
    perception is of Palubicki et al. (2009). Changed: nearest nodes are found incrementally, a direction
    beyond the cone is turned back to its edge, and a node does not grow the same child twice.
    """
    _check(rules, kill_m)
    grid, order = binned(points, rules.influence_m)
    seen = unseen(points[order])
    half = np.radians(min(rules.perception_deg, ALL_ROUND_DEG)) / 2.0
    how = (rules.step_m, rules.influence_m**2, half, rules.tropism_on == "unit")
    nodes, count = planted(*first), len(first[0])
    pull_of = np.array(rules.tropism, dtype=np.float64)
    live = np.arange(len(points))
    meet((0, count), grid, how, nodes, seen)
    reason: StopReason = "max_iter"
    done = 0
    for kill in kill_m:
        if not len(live):
            break
        nodes = with_room(nodes, count, count + min(count, len(live)))
        grown, attracted = sprout(count, live, how, pull_of, nodes, seen)
        if grown == count:
            reason = "stalled" if attracted else "out_of_reach"
            break
        meet((count, grown), grid, how, nodes, seen)
        live = survivors(live, kill**2, seen)
        count, done = grown, done + 1
        if progress is not None:
            so_far = nodes[0][:count], nodes[1][:count]
            progress(Progress(done, len(kill_m), count, len(live), *so_far))
    left = np.zeros(len(points), dtype=bool)
    left[order[live]] = True
    return Colony(nodes[0][:count], nodes[1][:count], left, reason if len(live) else "exhausted", done)


def _check(rules: Rules, kill_m: Floats) -> None:
    most = float(kill_m.max()) if len(kill_m) else 0.0
    if not (rules.step_m > 0.0 and rules.perception_deg > 0.0 and (kill_m > 0.0).all()):
        msg = "step, perception angle and kill distances must be above 0"
        raise UsageError(msg)
    if not most < rules.influence_m:
        msg = (
            f"kill distance of {most:g} m is not below the influence distance of {rules.influence_m:g} m; "
            "points would vanish before they attract a node; lower the one or raise the other"
        )
        raise UsageError(msg)
