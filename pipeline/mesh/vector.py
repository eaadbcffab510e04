"""Vectors of three, spelt out as tuples: a compiled loop keeps them in registers and makes no array."""

from __future__ import annotations

import math

from pipeline.geometry.compiled import compiled
from pipeline.model import Floats

Vector = tuple[float, float, float]


@compiled
def row(points: Floats, k: int) -> Vector:
    """Return row `k` of an (N, 3) array."""
    return points[k, 0], points[k, 1], points[k, 2]


@compiled
def put(vector: Vector, points: Floats, k: int) -> None:
    """Make a vector row `k` of an (N, 3) array; to assign the tuple takes seconds to compile."""
    points[k, 0], points[k, 1], points[k, 2] = vector


@compiled
def dot(a: Vector, b: Vector) -> float:
    """Return the inner product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def cross(a: Vector, b: Vector) -> Vector:
    """Return the outer product."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def mix(p: float, a: Vector, q: float, b: Vector) -> Vector:
    """Return ``p a + q b``."""
    return p * a[0] + q * b[0], p * a[1] + q * b[1], p * a[2] + q * b[2]


@compiled
def minus(a: Vector, b: Vector) -> Vector:
    """Return ``a - b``."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@compiled
def length(a: Vector) -> float:
    """Return the length."""
    return math.sqrt(dot(a, a))


@compiled
def unit(a: Vector) -> Vector:
    """Return `a` with length 1; straight up where it has none."""
    size = length(a)
    if size < 1e-12:
        return 0.0, 0.0, 1.0
    return a[0] / size, a[1] / size, a[2] / size


@compiled
def across(axis: Vector) -> Vector:
    """Return a unit vector at right angles to `axis`."""
    x, y, z = abs(axis[0]), abs(axis[1]), abs(axis[2])
    if z < min(x, y):
        return unit(cross(axis, (0.0, 0.0, 1.0)))
    if y < x:
        return unit(cross(axis, (0.0, 1.0, 0.0)))
    return unit(cross(axis, (1.0, 0.0, 0.0)))


@compiled
def turned(a: Vector, old: Vector, new: Vector) -> Vector:
    """Turn `a` by the smallest rotation that takes the unit vector `old` to `new`.

    The two are at most a right angle apart. The result is kept at right angles to `new`, length 1.
    """
    both = mix(1.0, old, 1.0, new)
    out = mix(1.0, a, -dot(both, a) / (1.0 + dot(old, new)), both)
    out = mix(1.0, out, 2.0 * dot(old, a), new)
    return unit(mix(1.0, out, -dot(out, new), new))
