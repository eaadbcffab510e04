"""What a step of space colonization does: points meet new nodes, nodes sprout, points are used up."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

STALL = 1e-3  # a new node this near to a child of its parent, in steps, is that child again
MOST_CELLS = 4_000_000  # far strays make the cells larger, not more

Grid = tuple[Floats, float, Ints, Ints]  # lowest corner, side of a cell, cells along x, y, z, first points
Seen = tuple[Floats, Floats, Ints, Floats, Mask]  # points, best and its node, nearest squared distance, live
Nodes = tuple[Floats, Ints, Floats, Ints, Ints]  # positions, parents, headings, last child, its elder sibling
How = tuple[float, float, float, bool]  # step, squared influence, half cone, tropism on the unit vector


def binned(points: Floats, influence: float) -> tuple[Grid, Ints]:
    """Sort the points by cell; a cell is half the influence distance wide."""
    low = points.min(axis=0) if len(points) else np.zeros(3)
    extent = points.max(axis=0) - low if len(points) else np.zeros(3)
    size = influence / 2.0
    while np.prod(np.floor(extent / size) + 1.0) > MOST_CELLS:
        size *= 1.5
    shape = (np.floor(extent / size) + 1.0).astype(np.int64)
    cell = np.floor((points - low) / size).astype(np.int64)
    key = (cell[:, 0] * shape[1] + cell[:, 1]) * shape[2] + cell[:, 2]
    order = np.argsort(key, kind="stable").astype(np.int64)
    starts = np.zeros(int(shape.prod()) + 1, dtype=np.int64)
    np.cumsum(np.bincount(key, minlength=len(starts) - 1), out=starts[1:])
    return (low, size, shape, starts), order


def unseen(points: Floats) -> Seen:
    """Return the points before any node has met them."""
    count = len(points)
    far = np.full(count, np.inf)
    return points, far, np.full(count, -1, dtype=np.int64), far.copy(), np.ones(count, dtype=bool)


def planted(xyz: Floats, parent: Ints) -> Nodes:
    """Return the first nodes with their headings (up at the root) and children."""
    above = parent.astype(np.int64)
    run = xyz - xyz[np.maximum(above, 0)]
    size = np.linalg.norm(run, axis=1, keepdims=True)
    heading = np.where(size > 0.0, run / np.where(size > 0.0, size, 1.0), [0.0, 0.0, 1.0])
    child, elder = np.full(len(xyz), -1, dtype=np.int64), np.full(len(xyz), -1, dtype=np.int64)
    for i, p in enumerate(above.tolist()):
        if p >= 0:
            elder[i], child[p] = child[p], i
    return xyz.astype(np.float64), above, heading, child, elder


def with_room(nodes: Nodes, count: int, wanted: int) -> Nodes:
    """Return arrays for at least `wanted` nodes that begin with the first `count`."""
    if len(nodes[1]) >= wanted:
        return nodes
    room = 2 * wanted

    def wide(held: NDArray[np.generic]) -> NDArray[np.generic]:
        out = np.empty((room, *held.shape[1:]), dtype=held.dtype)
        out[:count] = held[:count]
        return out

    return tuple(wide(held) for held in nodes)  # type: ignore[return-value]  # five arrays as before


@compiled
def meet(span: tuple[int, int], grid: Grid, how: How, nodes: Nodes, seen: Seen) -> None:
    """Show the nodes of a span to the live points around them; ties fall to the earlier node."""
    low, size, shape, starts = grid
    reach = np.sqrt(how[1])
    edge = np.cos(how[2])
    points, best, via, near, is_live = seen
    xyz, heading = nodes[0], nodes[2]
    a, b = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64)
    for q in range(span[0], span[1]):
        for k in range(3):
            a[k] = max(int(np.floor((xyz[q, k] - reach - low[k]) / size)), 0)
            b[k] = min(int(np.floor((xyz[q, k] + reach - low[k]) / size)), shape[k] - 1)
        for cx in range(a[0], b[0] + 1):
            for cy in range(a[1], b[1] + 1):
                row = (cx * shape[1] + cy) * shape[2]
                if a[2] > b[2]:
                    continue
                for i in range(starts[row + a[2]], starts[row + b[2] + 1]):
                    if not is_live[i]:
                        continue
                    x, y, z = points[i, 0] - xyz[q, 0], points[i, 1] - xyz[q, 1], points[i, 2] - xyz[q, 2]
                    square = x * x + y * y + z * z
                    if square > how[1]:
                        continue
                    near[i] = min(near[i], square)
                    if square < best[i]:
                        ahead = x * heading[q, 0] + y * heading[q, 1] + z * heading[q, 2]
                        if ahead >= edge * np.sqrt(square) - 1e-12:
                            best[i], via[i] = square, q


@compiled
def sprout(count: int, live: Ints, how: How, tropism: Floats, nodes: Nodes, seen: Seen) -> tuple[int, bool]:
    """Let every attracted node grow by one; the count of nodes then, and whether any was attracted."""
    points, best, via, _, _ = seen
    xyz, parent, heading, child, elder = nodes
    pull, chosen = np.zeros((count, 3)), np.zeros(count, dtype=np.bool_)
    attracted = False
    for i in live:
        q = via[i]
        if q >= 0 and best[i] > 0.0:
            size = np.sqrt(best[i])
            chosen[q] = attracted = True
            for k in range(3):
                pull[q, k] += (points[i, k] - xyz[q, k]) / size
    last = count
    for q in range(count):
        if not chosen[q] or not _aim(pull[q], heading[q], tropism, how):
            continue
        for k in range(3):
            xyz[last, k] = xyz[q, k] + how[0] * pull[q, k]
        if _is_known(q, last, how[0] * STALL, nodes):
            continue
        parent[last], heading[last] = q, pull[q]
        child[last], elder[last], child[q] = -1, child[q], last
        last += 1
    return last, attracted


@compiled
def _aim(pull: Floats, heading: Floats, tropism: Floats, how: How) -> bool:
    """Make a sum of pulls the unit direction to grow in; False where they cancel out."""
    size = np.sqrt((pull * pull).sum())
    if how[3] and size > 1e-9:
        pull /= size
    pull += tropism
    size = np.sqrt((pull * pull).sum())
    if size < 1e-9:
        return False
    pull /= size
    along = (pull * heading).sum()
    if along < np.cos(how[2]) - 1e-12:
        side = pull - along * heading
        size = np.sqrt((side * side).sum())
        if size < 1e-9:
            return False
        pull[:] = np.cos(how[2]) * heading + np.sin(how[2]) * side / size
    return True


@compiled
def _is_known(q: int, new: int, near: float, nodes: Nodes) -> bool:
    """Whether node `q` has a child where the new one would stand."""
    xyz, child, elder = nodes[0], nodes[3], nodes[4]
    c = child[q]
    while c >= 0:
        if ((xyz[c] - xyz[new]) ** 2).sum() < near * near:
            return True
        c = elder[c]
    return False


@compiled
def survivors(live: Ints, kill: float, seen: Seen) -> Ints:
    """Drop the points that a node came too near to."""
    near, is_live = seen[3], seen[4]
    kept = np.empty_like(live)
    count = 0
    for i in live:
        if near[i] < kill:
            is_live[i] = False
        else:
            kept[count] = i
            count += 1
    return kept[:count]
