"""Where branches start and end: a foot on the parent's axis, a tip at the last point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.axes import Axes, resample, stand
from pipeline.geometry.compiled import compiled
from pipeline.geometry.windows import Shared

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

INSIDE = 1.15  # nodes within so many parent radii are the parent's wood
NEAR_TIP_M = 0.15  # points so near to a tip tell how far apart they lie there
LEAD_M = 0.10  # length over which a branch's way out of its parent is taken


def anchor(axes: Axes, *, step_m: float) -> Axes:
    """Rebuild the start of every branch from the part that lies outside its parent.

    Nodes within 1.15 parent radii of the parent's axis are dropped, the first 10 cm outside are
    extrapolated back, and the parent's node nearest to that line becomes the foot.

    Parameters
    ----------
    axes : Axes
        With radii.
    step_m : float
        Spacing of the nodes of the result, metres.
    """
    xyz, foot = axes.xyz.copy(), axes.foot.copy()
    keep = np.ones(len(xyz), dtype=bool)
    _anchor((xyz, axes.radius), axes.first, foot, keep)
    return _rebuild(axes, xyz, foot, keep, step_m)


def set_foot(axes: Axes, shared: Shared) -> Axes:
    """Let the stem start where its lowest points are, straight below its first sound metre.

    The lowest slices of a stem are half rings and roots; the axis above them knows better.

    Parameters
    ----------
    axes : Axes
        With radii.
    shared : Shared
        The points of each branch; branch 0 is the stem.
    """
    low, high = int(axes.first[0]), int(axes.first[1])
    points = shared.xyz[shared.first[0] : shared.first[1]]
    if high - low < 4 or len(points) < 20:
        return axes
    arc = shared.node_arc[low:high]
    radius = float(np.median(axes.radius[low:high][arc <= arc[0] + 1.0]))
    start = min(int(np.searchsorted(arc, max(radius, 0.1))), high - low - 3)
    ahead = min(int(np.searchsorted(arc, arc[start] + max(0.3, 2.0 * radius))), high - low - 1)
    way = axes.xyz[low + ahead] - axes.xyz[low + start]
    way /= max(float(np.linalg.norm(way)), 1e-9)
    near = points[shared.arc[shared.first[0] : shared.first[1]] <= arc[start]]
    if len(near) < 10 or way[2] < 0.3:
        return axes
    along = (near - axes.xyz[low + start]) @ way
    reach = float(np.quantile(along, 0.005))
    xyz = axes.xyz.copy()
    share = np.linspace(1.0, 0.0, start + 1)[:-1, None]
    xyz[low : low + start] = xyz[low + start] + share * reach * way
    return axes.at(xyz)


def _rebuild(axes: Axes, xyz: Floats, foot: Ints, keep: NDArray[np.bool_], step_m: float) -> Axes:
    """Resample the kept nodes, and find the feet again among the parents' new nodes."""
    count = np.add.reduceat(keep.astype(np.int64), axes.first[:-1])
    first = np.concatenate([[0], np.cumsum(count)])
    held = np.column_stack([xyz, axes.square])[keep]
    nodes, begin = resample(held, first, step_m)
    new = np.full(len(foot), -1, dtype=np.int64)
    stand(nodes, begin, (axes.parent_branch, xyz[np.maximum(foot, 0)]), new)
    return Axes(np.ascontiguousarray(nodes[:, :3]), begin, new, np.ascontiguousarray(nodes[:, 3]))


@compiled
def _anchor(geometry: tuple[Floats, Floats], first: Ints, foot: Ints, keep: NDArray[np.bool_]) -> None:
    xyz, radius = geometry
    branch = np.zeros(len(xyz), dtype=np.int64)
    for b in range(len(first) - 1):
        branch[first[b] : first[b + 1]] = b
    for b in range(1, len(first) - 1):
        low, high = first[b], first[b + 1]
        p = branch[foot[b]]
        start = low + 1
        while start < high - 1 and _inside(xyz[start], foot[b], (first[p], first[p + 1]), xyz, radius):
            start += 1
        far, gone = start, 0.0
        while far < high - 1 and gone < LEAD_M:
            far += 1
            gone += np.sqrt(((xyz[far] - xyz[far - 1]) ** 2).sum())
        way = xyz[start] - xyz[far]
        norm = np.sqrt((way * way).sum())
        if norm > 1e-6:
            foot[b] = _meeting(xyz[start], way / norm, foot[b], (first[p], first[p + 1]), xyz, radius)
        xyz[low] = xyz[foot[b]]
        keep[low + 1 : start] = False


def inside_parent(axes: Axes) -> NDArray[np.bool_]:
    """(M,) nodes that lie in the wood of the branch that theirs stands on."""
    out = np.zeros(len(axes.xyz), dtype=bool)
    _mark_inside((axes.xyz, axes.radius), axes.first, axes.foot, axes.branch, out)
    return out


def clearance(axes: Axes) -> Floats:
    """(M,) how far every node stands outside 1.25 radii of the branch that its branch stands on."""
    out = np.zeros(len(axes.xyz))
    _clearances((axes.xyz, axes.radius), axes.first, axes.foot, axes.branch, out)
    return out


@compiled
def _clearances(geometry: tuple[Floats, Floats], first: Ints, foot: Ints, branch: Ints, out: Floats) -> None:
    xyz, radius = geometry
    for b in range(1, len(first) - 1):
        p = branch[foot[b]]
        for i in range(first[b], first[b + 1]):
            away = np.sqrt(((xyz[i] - xyz[foot[b]]) ** 2).sum())
            low, high = _near(foot[b], (first[p], first[p + 1]), xyz, away + 0.1)
            out[i] = np.inf
            for j in range(low, high + 1):
                x, y, z = xyz[i, 0] - xyz[j, 0], xyz[i, 1] - xyz[j, 1], xyz[i, 2] - xyz[j, 2]
                out[i] = min(out[i], np.sqrt(x * x + y * y + z * z) - 1.25 * radius[j])


@compiled
def _mark_inside(
    geometry: tuple[Floats, Floats], first: Ints, foot: Ints, branch: Ints, out: NDArray[np.bool_]
) -> None:
    xyz, radius = geometry
    for b in range(1, len(first) - 1):
        p = branch[foot[b]]
        for i in range(first[b], first[b + 1]):
            out[i] = _inside(xyz[i], foot[b], (first[p], first[p + 1]), xyz, radius)
            if not out[i] and i > first[b] + 1:
                break


@compiled
def _near(i: int, run: tuple[int, int], xyz: Floats, reach: float) -> tuple[int, int]:
    """Nodes of a run within `reach` along the axis of node `i`."""
    low, gone = i, 0.0
    while low > run[0] and gone < reach:
        gone += _step(xyz, low)
        low -= 1
    high, gone = i, 0.0
    while high < run[1] - 1 and gone < reach:
        gone += _step(xyz, high + 1)
        high += 1
    return low, high


@compiled
def _step(xyz: Floats, i: int) -> float:
    """Length from the node before to node `i`."""
    x, y, z = xyz[i, 0] - xyz[i - 1, 0], xyz[i, 1] - xyz[i - 1, 1], xyz[i, 2] - xyz[i - 1, 2]
    return float(np.sqrt(x * x + y * y + z * z))


@compiled
def _inside(x: Floats, foot: int, run: tuple[int, int], xyz: Floats, radius: Floats) -> bool:
    low, high = _near(foot, run, xyz, 4.0 * radius[foot] + 0.1)
    for j in range(low, high + 1):
        a, b, c = x[0] - xyz[j, 0], x[1] - xyz[j, 1], x[2] - xyz[j, 2]
        if a * a + b * b + c * c < (INSIDE * radius[j]) ** 2:
            return True
    return False


@compiled
def _meeting(start: Floats, way: Floats, foot: int, run: tuple[int, int], xyz: Floats, radius: Floats) -> int:
    """The parent's node that lies nearest to the line back from a branch's start."""
    low, high = _near(foot, run, xyz, 3.0 * radius[foot] + 0.1)
    best, found = np.inf, foot
    for j in range(low, high + 1):
        off = xyz[j] - start
        along = max((off * way).sum(), 0.0)
        miss = off - along * way
        # a long way back counts a little, so that a nearly parallel branch does not slide down
        value = np.sqrt((miss * miss).sum()) + 0.1 * along
        if value < best:
            best, found = value, j
    return found


def extend_tips(axes: Axes, shared: Shared, *, most_m: float) -> Axes:
    """Move the last node of every branch on to where its wood ends.

    That is its last point and as much again as the points near the tip lie apart along the branch: the
    last of evenly strewn points falls short of the end by that on average.

    Parameters
    ----------
    axes : Axes
    shared : Shared
        The points of each branch.
    most_m : float
        Largest extension to the last point, and largest beyond it, metres.
    """
    xyz = axes.xyz.copy()
    _extend(xyz, axes.first, axes.radius, shared.xyz, shared.first, most_m)
    return axes.at(xyz)


@compiled
def _extend(xyz: Floats, first: Ints, radius: Floats, points: Floats, begin: Ints, most: float) -> None:
    for b in range(len(first) - 1):
        tip, back = first[b + 1] - 1, max(first[b + 1] - 4, first[b])
        way = xyz[tip] - xyz[back]
        norm = np.sqrt((way * way).sum())
        if norm < 1e-9:
            continue
        way = way / norm
        reach, last, count = 0.0, -NEAR_TIP_M, 0
        for k in range(begin[b + 1] - 1, begin[b] - 1, -1):
            off = points[k] - xyz[tip]
            along = (off * way).sum()
            if along < -0.2:
                break
            across = np.sqrt(max((off * off).sum() - along * along, 0.0))
            if across < max(2.0 * radius[tip], 0.02) and along <= most:
                reach = max(reach, along)
                if along > -NEAR_TIP_M:
                    last, count = max(last, along), count + 1
        if count > 1:
            reach = max(reach, last + min((last + NEAR_TIP_M) / count, most))
        xyz[tip] = xyz[tip] + reach * way
