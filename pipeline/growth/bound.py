"""Where a tree may grow: above the ground, and within a shape over its foot."""

from __future__ import annotations

from typing import NamedTuple

from pipeline.geometry.compiled import compiled
from pipeline.growth.options import LimitOptions
from pipeline.growth.state import Metamers

KINDS = ("none", "box", "cylinder", "ellipsoid")


class Limits(NamedTuple):
    """The kind of the shape (its place in `KINDS`), the foot, and half axes and base of the shape, metres."""

    kind: int
    foot: tuple[float, float, float]
    half: tuple[float, float, float]
    base: float


def limits_of(tree: Metamers, options: LimitOptions) -> Limits:
    """Return the shape that options describe, over the foot of a tree."""
    half = (options.bound_width_m / 2.0, options.bound_depth_m / 2.0, options.bound_height_m / 2.0)
    x, y, z = tree.end[0].tolist()
    return Limits(KINDS.index(options.bound), (x, y, z), half, options.bound_base_m)


@compiled
def is_within(point: tuple[float, float, float], limits: Limits) -> bool:
    """Whether a point is above the ground and in the shape, or around the stem below it."""
    x, y, z = point[0] - limits.foot[0], point[1] - limits.foot[1], point[2] - limits.foot[2]
    if z < 0.0:
        return False
    if limits.kind == 0:
        return True
    u, v = x / limits.half[0], y / limits.half[1]
    w = (z - limits.base) / limits.half[2] - 1.0
    if w < 0.0 and z < limits.base + limits.half[2] and u * u + v * v < STEM_SHARE * STEM_SHARE:
        return True
    if limits.kind == 3:
        return bool(u * u + v * v + w * w <= 1.0)
    flat = u * u + v * v <= 1.0 if limits.kind == 2 else max(abs(u), abs(v)) <= 1.0
    return bool(flat and abs(w) <= 1.0)


STEM_SHARE = 0.15
"""Half width, as a share of the shape's, of the free column through which the stem reaches it."""
