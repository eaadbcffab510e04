"""The ground under a tree that is scanned: a slope with bumps, as triangles."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.random import Generator

from pipeline.model import Floats, Ints

CELL_M = 0.2
"""Edge of a square of the ground; each is two triangles."""
WAVES = 8
"""The bumps are so many waves on top of each other."""
WAVELENGTHS_M = (0.8, 5.0)


class Terrain(NamedTuple):
    """Height of the ground around the foot of the tree, where it is 0.

    Attributes
    ----------
    slope : (2,) array of float64
        Rise to the east and to the north, metres a metre.
    waves : (W, 2) array of float64
        Radians a metre.
    phase : (W,) array of float64
        Radians.
    amplitude_m : float
        Of every wave.
    """

    slope: Floats
    waves: Floats
    phase: Floats
    amplitude_m: float

    def height(self, xy: Floats) -> Floats:
        """Return the (P,) heights at (P, 2) places relative to the foot, in metres."""
        bumps = np.sin(xy @ self.waves.T + self.phase) - np.sin(self.phase)
        return np.asarray(xy @ self.slope + self.amplitude_m * bumps.sum(axis=1))


def terrain(slope_deg: float, roughness_m: float, rng: Generator) -> Terrain:
    """Make ground that falls in some direction, with bumps of a standard deviation of `roughness_m`."""
    azimuth, turn = rng.uniform(0, 2 * np.pi, 2)
    slope = np.tan(np.radians(slope_deg)) * np.array([np.cos(azimuth), np.sin(azimuth)])
    heading = turn + np.pi * np.arange(WAVES) / WAVES
    wavelength = np.geomspace(*WAVELENGTHS_M, WAVES)[rng.permutation(WAVES)]
    waves = 2 * np.pi / wavelength[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    return Terrain(slope, waves, rng.uniform(0, 2 * np.pi, WAVES), roughness_m * np.sqrt(2 / WAVES))


def disc(ground: Terrain, radius_m: float) -> tuple[Floats, Ints]:
    """Return the vertices (V, 3) and faces (F, 3) of the ground within a radius of the foot."""
    half = int(np.ceil(radius_m / CELL_M))
    if not half:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)
    row = radius_m * np.linspace(-1, 1, 2 * half + 1)
    xy = np.stack(np.meshgrid(row, row, indexing="ij"), axis=-1).reshape(-1, 2)
    number = np.arange(len(xy), dtype=np.int32).reshape(len(row), -1)
    a, d = (block.ravel() for block in (number[:-1, :-1], number[:-1, 1:]))
    b, c = a + len(row), d + len(row)
    faces = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    inside = np.linalg.norm(xy[faces].mean(axis=1), axis=1) <= radius_m
    return np.column_stack([xy, ground.height(xy)]), faces[inside]
