"""Vectors of three, spelt out: quick to compile and free of a library's call for every product."""

from __future__ import annotations

import math

import numpy as np

from pipeline.geometry.compiled import compiled
from pipeline.model import Floats


@compiled
def dot(a: Floats, b: Floats) -> float:
    """Return the inner product."""
    return float(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


@compiled
def cross(a: Floats, b: Floats) -> Floats:
    """Return the outer product."""
    out = np.empty(3)
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]
    return out


@compiled
def mix(p: float, a: Floats, q: float, b: Floats) -> Floats:
    """Return ``p a + q b``."""
    out = np.empty(3)
    for k in range(3):
        out[k] = p * a[k] + q * b[k]
    return out


@compiled
def length(a: Floats) -> float:
    """Return the length."""
    return math.sqrt(dot(a, a))


@compiled
def unit(a: Floats) -> Floats:
    """Return `a` with length 1; straight up where it has none."""
    out = np.zeros(3)
    out[2] = 1.0
    size = length(a)
    if size >= 1e-12:
        for k in range(3):
            out[k] = a[k] / size
    return out


@compiled
def across(axis: Floats) -> Floats:
    """Return a unit vector at right angles to `axis`."""
    thin = 0
    for k in range(1, 3):
        if abs(axis[k]) < abs(axis[thin]):
            thin = k
    helper = np.zeros(3)
    helper[thin] = 1.0
    return unit(cross(axis, helper))


@compiled
def turned(a: Floats, old: Floats, new: Floats) -> Floats:
    """Turn `a` by the smallest rotation that takes the unit vector `old` to `new`.

    The two are at most a right angle apart. The result is kept at right angles to `new`, length 1.
    """
    both = mix(1.0, old, 1.0, new)
    out = mix(1.0, a, -dot(both, a) / (1.0 + dot(old, new)), both)
    out = mix(1.0, out, 2.0 * dot(old, a), new)
    return unit(mix(1.0, out, -dot(out, new), new))
