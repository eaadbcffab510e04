"""Which wood a click means: the ray of a pixel, and what it meets first or passes nearest."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from pipeline.errors import UsageError
from pipeline.model import Floats
from pipeline.studio.years.limbs import Limbs

REACH_PX = 8.0
"""How far beside thin wood a click still means it."""
INSIDE = 0.05
"""Least distance of a picked place from the ends of its metamer, as a share: there it would be two's."""
NEAR_M = 1e-9


class Ray(NamedTuple):
    """A line of sight.

    Attributes
    ----------
    eye, way : (3,) arrays
        Where it begins, and its unit vector.
    spread : float
        Width of a pixel, as a share of the distance; 0 where sight is parallel.
    pixel_m : float
        Width of a pixel there, else 0.
    """

    eye: Floats
    way: Floats
    spread: float
    pixel_m: float


def ray_of(camera: Mapping[str, Any], place: Sequence[Any], size: Sequence[Any]) -> Ray:
    """Return the ray through a place of the picture.

    Parameters
    ----------
    camera : mapping
        As the browser tells: ``position``, ``focalPoint``, ``viewUp``, ``viewAngle`` (of the height,
        degrees), and ``parallelProjection`` with ``parallelScale``.
    place : (float, float)
        Pixels from the left and from the top.
    size : (float, float)
        Width and height of the picture, pixels.

    Raises
    ------
    UsageError
        If that is no camera.
    """
    try:
        eye, focus, up = (_vector(camera[key]) for key in ("position", "focalPoint", "viewUp"))
        (x, y), (width, height) = ([float(value) for value in pair] for pair in (place, size))
        angle, scale = float(camera["viewAngle"]), float(camera.get("parallelScale", 1.0))
        ahead = _unit(focus - eye)
        right = _unit(np.cross(ahead, up))
    except (KeyError, TypeError, ValueError) as error:
        msg = f"the picture does not tell what was clicked ({error}); click again, or reload the page"
        raise UsageError(msg) from None
    if not (width >= 1.0 and height >= 1.0 and math.isfinite(x + y) and 0.0 < angle < 180.0):
        msg = "the picture has no size yet; wait until it is drawn, and click again"
        raise UsageError(msg)
    above = np.cross(right, ahead)
    aside, up_by = (2.0 * x - width) / height, 1.0 - 2.0 * y / height
    if camera.get("parallelProjection"):
        return Ray(eye + scale * (aside * right + up_by * above), ahead, 0.0, 2.0 * scale / height)
    half = math.tan(math.radians(angle) / 2.0)
    way = _unit(ahead + half * (aside * right + up_by * above))
    return Ray(eye, way, 2.0 * half / height, 0.0)


def picked(limbs: Limbs, ray: Ray) -> tuple[int, Floats] | None:
    """Return the metamer that a ray meets, and the place on its axis; None where it passes all by.

    Of wood that the ray goes through it is the first. Where it goes through none, it is what it passes
    nearest, within `REACH_PX` pixels.
    """
    a, step = limbs.begin[1:], limbs.end[1:] - limbs.begin[1:]
    if not len(a):
        return None
    share, depth = _nearest(a, step, ray)
    place = a + share[:, None] * step
    off = np.linalg.norm(place - (ray.eye + depth[:, None] * ray.way), axis=1)
    beside = off - limbs.width[1:] / 2.0
    reach = REACH_PX * (ray.spread * depth + ray.pixel_m)
    ahead = depth > 0.0
    through = np.flatnonzero(ahead & (beside <= 0.0))
    near = np.flatnonzero(ahead & (beside <= reach))
    if len(through):
        best = int(through[np.argmin(depth[through] - limbs.width[1:][through] / 2.0)])
    elif len(near):
        best = int(near[np.argmin(beside[near] / reach[near])])
    else:
        return None
    inside = min(max(float(share[best]), INSIDE), 1.0 - INSIDE)
    return best + 1, np.asarray(a[best] + inside * step[best])


def _nearest(a: Floats, step: Floats, ray: Ray) -> tuple[Floats, Floats]:
    """Return where segments come nearest to a ray: their share there, and the depth along the ray."""
    from_eye = a - ray.eye
    square = np.maximum((step * step).sum(axis=1), NEAR_M**2)
    along, slope = from_eye @ ray.way, step @ ray.way
    across = (from_eye * step).sum(axis=1)
    free = square - slope * slope
    turned = np.where(free > NEAR_M * square, (slope * along - across) / np.maximum(free, NEAR_M**2), 0.0)
    share = np.clip(turned, 0.0, 1.0)
    return share, np.maximum(along + share * slope, 0.0)


def _vector(values: Any) -> Floats:
    vector = np.asarray([float(value) for value in values])
    if vector.shape != (3,) or not np.isfinite(vector).all():
        msg = "three numbers are needed"
        raise ValueError(msg)
    return vector


def _unit(vector: Floats) -> Floats:
    size = float(np.linalg.norm(vector))
    if size < NEAR_M:
        msg = "a way without length"
        raise ValueError(msg)
    return np.asarray(vector / size)
