"""How well straight lines through the points stand out from what surrounds them, as wood does."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.geometry.voxels import cell_keys

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Lengths of a line, in cells.
REACH = 10.0  # it runs this far to either side of its point
CORE = 0.6  # points this near lie on it
RING = 2.5  # points from the core to here tell how dense the foliage is
NEAR_END = 4.0  # a point nearer than this gives no direction

SURE = 0.85  # chance that a cell's length of real wood holds a point
FLOOR = -2.0  # score of a point that no line passes
CANDIDATES = 24  # directions that are tried for a line, on a sample of its surroundings
SAMPLED = 100  # points of that sample
FINALISTS = 3  # directions of these that are scored on all points
EVERY = 4  # every fourth point draws lines; all points on a line have its score


def line_scores(xyz: Floats, cell: float) -> Floats:
    """Evidence for the best straight line that passes each point.

    Parameters
    ----------
    xyz : (P, 3) array
        Points thinned to one a cell, metres.
    cell : float
        Side of the cells, metres.

    Returns
    -------
    (P,) array
        Log likelihood ratio of wood against foliage as dense as around the line, in nats for each
        cell of its length; 0 tells nothing.
    """
    keys = cell_keys(xyz, REACH * cell)
    order = np.argsort(keys, kind="stable")
    boxes, first = np.unique(keys[order], return_index=True)
    score = np.empty(len(xyz))
    score[order] = _draw_lines(xyz[order] / cell, boxes, np.append(first, len(xyz)))
    return score


@compiled
def _draw_lines(xyz: Floats, boxes: Ints, first: Ints) -> Floats:
    score = np.full(len(xyz), FLOOR)
    ball, member = np.empty((64, 4)), np.empty(64, dtype=np.int64)
    runs = np.empty((27, 2), dtype=np.int64)
    for box in range(len(boxes)):
        found, most = _neighbouring(box, boxes, first, runs)
        if most > len(ball):
            ball, member = np.empty((2 * most, 4)), np.empty(2 * most, dtype=np.int64)
        start = first[box] + (EVERY - 1 - first[box] % EVERY)
        for i in range(start, first[box + 1], EVERY):
            count = _gather(i, xyz, runs[:found], ball, member)
            _draw_best(ball[:count], member, score)
    return score


@compiled
def _neighbouring(box: int, boxes: Ints, first: Ints, runs: Ints) -> tuple[int, int]:
    """Runs of points in the 27 boxes around one: how many runs, and points in all."""
    found, points = 0, 0
    for dx in range(-1, 2):
        for dy in range(-1, 2):
            for dz in range(-1, 2):
                key = boxes[box] + (dx << 42) + (dy << 21) + dz
                at = np.searchsorted(boxes, key)
                if at < len(boxes) and boxes[at] == key:
                    runs[found, 0], runs[found, 1] = first[at], first[at + 1]
                    points += first[at + 1] - first[at]
                    found += 1
    return found, points


@compiled
def _gather(i: int, xyz: Floats, runs: Ints, ball: Floats, member: Ints) -> int:
    """Offsets and squared distances of all points within reach of point `i`; return how many."""
    count = 0
    for k in range(len(runs)):
        for j in range(runs[k, 0], runs[k, 1]):
            x, y, z = xyz[j, 0] - xyz[i, 0], xyz[j, 1] - xyz[i, 1], xyz[j, 2] - xyz[i, 2]
            square = x * x + y * y + z * z
            if square <= REACH * REACH:
                ball[count, 0], ball[count, 1], ball[count, 2], ball[count, 3] = x, y, z, square
                member[count] = j
                count += 1
    return count


@compiled
def _draw_best(ball: Floats, member: Ints, score: Floats) -> None:
    """Score the most promising lines through the middle of a ball; the points on them share it."""
    way, promise = np.empty((CANDIDATES + 1, 3)), np.empty(CANDIDATES + 1)
    tried = 0
    for c in range(CANDIDATES):
        k = c * len(ball) // CANDIDATES
        if ball[k, 3] >= NEAR_END * NEAR_END:
            way[tried] = ball[k, :3] / np.sqrt(ball[k, 3])
            promise[tried] = _promise(ball, way[tried])
            tried += 1
    for _ in range(min(FINALISTS, tried)):
        best = np.argmax(promise[:tried])
        promise[best] = -np.inf
        value = _evidence(ball, way[best])
        for j in range(len(ball)):
            if _off(ball[j], way[best]) < CORE * CORE:
                score[member[j]] = max(score[member[j]], value)


@compiled
def _off(row: Floats, way: Floats) -> float:
    """Squared distance of a point from the line."""
    along = row[0] * way[0] + row[1] * way[1] + row[2] * way[2]
    return float(row[3] - along * along)


@compiled
def _promise(ball: Floats, way: Floats) -> float:
    """How well a line stands out, from a sample of the ball."""
    core, ring = 0, 0
    for j in range(0, len(ball), 1 + len(ball) // SAMPLED):
        off = _off(ball[j], way)
        core += off < 1.0
        ring += off < RING * RING
    return core - ring / (RING * RING)


@compiled
def _evidence(ball: Floats, way: Floats) -> float:
    """Score of one line: which cells of its length hold a point, and how many would by chance."""
    cells, ring = 0, 0
    for j in range(len(ball)):
        along = ball[j, 0] * way[0] + ball[j, 1] * way[1] + ball[j, 2] * way[2]
        off = ball[j, 3] - along * along
        if off < CORE * CORE:
            cells |= 1 << int(along + REACH)
        elif off < RING * RING:
            ring += 1
    held = 0
    while cells:
        cells &= cells - 1
        held += 1
    length = 2.0 * REACH
    expected = (ring + 1.0) / length * CORE * CORE / (RING * RING - CORE * CORE)
    chance = min(1.0 - np.exp(-expected), SURE)
    gain = held * np.log(SURE / chance) + (length - held) * np.log((1.0 - SURE) / (1.0 - chance))
    return float(gain / length)
