"""Robust circles through the points of a slab, in plan: the first one by vote, the next near a guess."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled

Floats = NDArray[np.float64]
Circle = tuple[float, float, float, float]  # centre (two), radius, score

INLIER = 2.5  # noises within which a point is on the bark
LEAST_POINTS = 7  # on the bark of a slab
LEAST_ARC = 0.4  # share of the circle's sectors that hold bark
SECTORS = 8
EMPTY = 0.2  # most points inside a circle, as a share of those on it
THINNEST = 1.5  # noises below which a radius cannot be seen
TINY = 1e-9  # square metres by which rounding might mistake a place for another


@compiled
def first_circle(slab: Floats, chosen: Floats, noise: float, widest: float) -> Circle:
    """Vote among all circles through three points; radius 0 where none has bark enough."""
    best = (0.0, 0.0, 0.0, 0.0)
    beside, reach = 4.0 * widest**2, (2.0 * widest + 2.0 * INLIER * noise) ** 2
    for i in range(len(chosen)):
        x, y, later = chosen[i, 0], chosen[i, 1], chosen[i + 1 :]
        near = slab[(slab[:, 0] - x) ** 2 + (slab[:, 1] - y) ** 2 <= reach]  # no circle's points lie beyond
        others = later[(later[:, 0] - x) ** 2 + (later[:, 1] - y) ** 2 <= beside]
        for j in range(len(others)):
            for k in range(j + 1, len(others)):
                a, b, r = _through(chosen[i], others[j], others[k])
                if r < 2.0 * THINNEST * noise or r > widest:
                    continue
                score = _score(near, (a, b, r), noise)
                if score > best[3]:
                    best = (a, b, r, score)
    if best[3] > 0.0:
        a, b, r = _refine(slab, best[:3], noise, best[:3], 10.0)
        if _is_bark(slab, (a, b, r), noise):
            return a, b, r, best[3]
    return 0.0, 0.0, 0.0, 0.0


@compiled
def next_circle(slab: Floats, radius: float, noise: float) -> tuple[float, float, float]:
    """Vote over centres and radii about the predicted circle, then refine."""
    best, most = (0.0, 0.0, radius), -np.inf
    for k in range(-3, 4):
        r = radius * (1.0 + 0.08 * k)
        for i in range(-4, 5):
            for j in range(-4, 5):
                a, b = 0.15 * i * radius, 0.15 * j * radius
                value = _score(slab, (a, b, r), noise)
                value -= 1.5 * (a * a + b * b) / (0.4 * radius) ** 2 + 0.5 * ((r / radius - 1.0) / 0.15) ** 2
                if value > most:
                    best, most = (a, b, r), value
    return _refine(slab, best, noise, (best[0], best[1], radius), 0.3)


@compiled
def _through(p: Floats, q: Floats, s: Floats) -> tuple[float, float, float]:
    """Circle through three points, in plan; radius 0 where they lie on a line."""
    bx, by, cx, cy = q[0] - p[0], q[1] - p[1], s[0] - p[0], s[1] - p[1]
    d = 2.0 * (bx * cy - by * cx)
    if abs(d) < 1e-9:
        return 0.0, 0.0, 0.0
    x = (cy * (bx * bx + by * by) - by * (cx * cx + cy * cy)) / d
    y = (bx * (cx * cx + cy * cy) - cx * (bx * bx + by * by)) / d
    return p[0] + x, p[1] + y, np.sqrt(x * x + y * y)


@compiled
def _score(points: Floats, circle: tuple[float, float, float], noise: float) -> float:
    """Bark on the circle, less what lies inside it; near misses count in part."""
    a, b, r = circle
    total, reach = 0.0, INLIER * noise
    outside, inside = (r + reach) ** 2 + TINY, max(r - reach, 0.0) ** 2 - TINY
    for i in range(len(points)):
        x, y = points[i, 0] - a, points[i, 1] - b
        square = x * x + y * y
        if square > outside:
            continue
        if square < inside:
            total -= 1.0
            continue
        off = (np.sqrt(square) - r) / reach
        if abs(off) < 1.0:
            total += (1.0 - off * off) ** 2
        elif off < 0.0:
            total -= 1.0
    return total


@compiled
def _refine(
    points: Floats,
    start: tuple[float, float, float],
    noise: float,
    prior: tuple[float, float, float],
    loose: float,
) -> tuple[float, float, float]:
    """Least squares on the points near the circle (Tukey's weights), drawn to `prior`.

    `loose` is the prior's standard deviation, in radii.
    """
    a, b, r = start
    for _ in range(12):
        lhs, rhs = np.zeros((3, 3)), np.zeros(3)
        hold = (noise / (loose * prior[2])) ** 2
        goal = (prior[0] - a, prior[1] - b, prior[2] - r)
        for k in range(3):
            lhs[k, k], rhs[k] = hold, hold * goal[k]
        for i in range(len(points)):
            x, y = points[i, 0] - a, points[i, 1] - b
            away = np.sqrt(x * x + y * y)
            off = away - r
            u = off / (2.0 * INLIER * noise)
            if abs(u) >= 1.0 or away < 1e-9:
                continue
            w = (1.0 - u * u) ** 2
            row = np.array([x / away, y / away, 1.0])
            for k in range(3):
                rhs[k] += w * row[k] * off
                for m in range(3):
                    lhs[k, m] += w * row[k] * row[m]
        step = np.linalg.solve(lhs, rhs)
        a, b, r = a + step[0], b + step[1], max(r + step[2], 0.5 * noise)
    return a, b, r


@compiled
def _is_bark(points: Floats, circle: tuple[float, float, float], noise: float) -> bool:
    """Whether enough points lie on the circle, all round enough, and few inside."""
    on, inside, arc, _ = tally(points, circle, noise)
    return on >= LEAST_POINTS and arc >= LEAST_ARC and inside <= EMPTY * on


@compiled
def tally(points: Floats, circle: tuple[float, float, float], noise: float) -> tuple[int, int, float, float]:
    """Points on and inside the circle, share of the sectors with bark, robust misfit."""
    a, b, r = circle
    seen = np.zeros(SECTORS)
    off = np.empty(len(points))
    on, inside = 0, 0
    for i in range(len(points)):
        x, y = points[i, 0] - a, points[i, 1] - b
        away = np.sqrt(x * x + y * y) - r
        if abs(away) < INLIER * noise:
            seen[int((np.arctan2(y, x) + np.pi) / (2.0 * np.pi) * SECTORS) % SECTORS] = 1.0
            off[on] = abs(away)
            on += 1
        elif away < 0.0:
            inside += 1
    misfit = 1.4826 * float(np.median(off[:on])) if on else np.inf
    return on, inside, float(seen.mean()), misfit
