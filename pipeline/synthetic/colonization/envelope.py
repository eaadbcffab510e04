"""Where a crown may grow: points in an ellipsoid whose top and bottom may be cut off."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from pipeline.model import Floats
from pipeline.synthetic.colonization.options import GrowthOptions

CHUNK = 4096  # points drawn at once; fixed, so that another shape meets the same points
WAVES = 12  # waves on the sphere that make a rough rim
WAVE_NUMBERS = (2.0, 6.0)  # slowest and fastest of them


def crown_height(options: GrowthOptions) -> float:
    """Return the height from the cut bottom to the cut top, metres."""
    low, high = _cuts(options)
    return (low + high) * options.crown_height_m


def crown_volume(options: GrowthOptions) -> float:
    """Return the volume of the cut ellipsoid in cubic metres."""
    low, high = _cuts(options)
    height = low + high
    slab = np.pi * height / 6.0 * (3.0 * (1.0 - low**2) + 3.0 * (1.0 - high**2) + height**2)
    return float(slab * options.crown_width_m * options.crown_height_m * options.crown_depth_m)


def point_density(options: GrowthOptions) -> float:
    """Return the points per cubic metre; gnarly branches see less far and need more."""
    return 12.0 + 18.0 * options.gnarliness


def crown_points(options: GrowthOptions, foot: Floats, random: Generator) -> Floats:
    """Scatter attraction points over a crown that stands on `foot`.

    Parameters
    ----------
    options : GrowthOptions
    foot : (3,) array
        Where the stem meets the crown, metres.
    random : Generator

    Returns
    -------
    (P, 3) array
        Metres. The same generator gives a wider crown the same points, moved outwards.

    References
    ----------
    Eq. 22 of the thesis behind this generator divides the volume by the density, a misprint: it is the
    product. With a rough rim or on the rim alone the density is the same, so there are about as many or
    fewer points.
    """
    low, high = _cuts(options)
    inner = 1.0 - options.rim_share
    wanted = int(np.ceil(crown_volume(options) * point_density(options) * (1.0 - inner**3)))
    rim = _rim(options.rim_noise, random)
    reach = 1.0 + options.rim_noise
    chunks, count = [], 0
    while count < wanted:
        drawn = random.uniform(-reach, reach, (CHUNK, 3))
        away = np.linalg.norm(drawn, axis=1)
        edge = rim.at(drawn)
        inside = (away <= edge) & (away >= inner * edge) & (drawn[:, 2] >= -low) & (drawn[:, 2] <= high)
        chunks.append(drawn[inside])
        count += len(chunks[-1])
    unit = np.concatenate(chunks)[:wanted]
    scale = np.array([options.crown_width_m, options.crown_depth_m, options.crown_height_m])
    return np.asarray((unit + [0.0, 0.0, low]) * scale + foot)


def _cuts(options: GrowthOptions) -> tuple[float, float]:
    """Return how far the unit sphere reaches below and above its middle."""
    return 1.0 - 2.0 * options.cutoff_bottom, 1.0 - 2.0 * options.cutoff_top


class _Rim:
    """A smooth random function of direction, 1 on average."""

    def __init__(self, amount: float, waves: Floats, phase: Floats) -> None:
        self.amount, self.waves, self.phase = amount, waves, phase

    def at(self, xyz: Floats) -> Floats:
        """(P,) distance of the rim in the direction of every point."""
        if self.amount == 0.0:
            return np.ones(len(xyz))
        way = xyz / np.maximum(np.linalg.norm(xyz, axis=1, keepdims=True), 1e-9)
        swing = np.sin(way @ self.waves.T + self.phase).mean(axis=1) * np.sqrt(WAVES / 2.0)
        return np.asarray(1.0 + self.amount * np.clip(swing, -1.0, 1.0))


def _rim(amount: float, random: Generator) -> _Rim:
    way = random.normal(size=(WAVES, 3))
    way /= np.linalg.norm(way, axis=1, keepdims=True)
    return _Rim(amount, way * random.uniform(*WAVE_NUMBERS, (WAVES, 1)), random.uniform(0, 2 * np.pi, WAVES))
