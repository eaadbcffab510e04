"""The pyramid of voxels that a metamer shades, turned away from where light comes from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.growth.lattice import Voxels
from pipeline.growth.options import LightOptions
from pipeline.model import Floats

FIXED = 1 << 20
"""What a unit of light is in whole numbers."""
EDGE = 1e-9
"""Rounding that decides no voxel."""


class Pyramid(NamedTuple):
    """Offsets (M, 3) from the voxel of a caster, their shade (M,) times `FIXED`, and how far they reach."""

    offset: Voxels
    amount: Voxels
    reach: int


def fixed(light: float) -> int:
    """Return light as a whole number."""
    return round(light * FIXED)


def towards_light(options: LightOptions) -> Floats:
    """(3,) unit vector to where light comes from."""
    tilt, azimuth = np.radians(options.light_tilt_deg), np.radians(options.light_azimuth_deg)
    flat = np.sin(tilt)
    return np.array([flat * np.cos(azimuth), flat * np.sin(azimuth), np.cos(tilt)])


def pyramid(options: LightOptions) -> Pyramid:
    """Return the voxels that one metamer shades.

    Layer q below the caster, seen from the light, is a square of (2 q + 1) x (2 q + 1) voxels with shade
    a b^-q each. For light from straight above the layers are those of the grid.
    """
    up = towards_light(options)
    side = np.array([-np.sin(a := np.radians(options.light_azimuth_deg)), np.cos(a), 0.0])
    if options.light_tilt_deg == 0.0:
        side = np.array([0.0, 1.0, 0.0])
        up = np.array([0.0, 0.0, 1.0])
    across = np.cross(side, up)
    far = options.shade_layers
    reach = int(np.ceil(far * np.sqrt(3.0))) if options.light_tilt_deg else far
    span = np.arange(-reach, reach + 1)
    offset = np.stack(np.meshgrid(span, span, span, indexing="ij"), axis=-1).reshape(-1, 3)
    layer = np.floor(-offset @ up + 0.5 + EDGE).astype(np.int64)
    wide = np.maximum(np.abs(offset @ side), np.abs(offset @ across))
    inside = (layer >= 0) & (layer <= far) & (wide < layer + 0.5 - EDGE)
    inside |= (offset == 0).all(axis=1)
    amount = np.rint(FIXED * options.shade * options.shade_fall ** -layer[inside].astype(float))
    return Pyramid(offset[inside].astype(np.int64), amount.astype(np.int64), reach)
