"""Laser beams: where they start, where they go, and how they widen into a footprint."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from pipeline.model import Floats
from pipeline.synthetic.scene import SceneOptions

GOLDEN_TURN = np.pi * (3.0 - np.sqrt(5.0))
MOST_RETURNS = 15
"""LAS counts the returns of a pulse in four bits."""


class BeamOptions(SceneOptions):
    """What every scanner has; the defaults are those of a terrestrial one."""

    noise_m: float = Field(
        default=0.0035, ge=0, le=0.2, description="standard deviation of a range in metres"
    )
    divergence_mrad: float = Field(
        default=0.3, ge=0, le=10, description="full angle of the widening beam in milliradians"
    )
    aperture_m: float = Field(
        default=0.0035, ge=0, le=0.1, description="diameter of the beam where it leaves, in metres"
    )
    sub_rays: int = Field(default=7, ge=1, le=61, description="rays that stand for the width of a beam")
    gap_m: float = Field(
        default=0.3, gt=0, le=10, description="surfaces farther apart than this give two returns, in metres"
    )
    max_returns: int = Field(default=4, ge=1, le=MOST_RETURNS, description="most returns of a pulse")
    least_share: float = Field(
        default=0.1, ge=0, le=1, description="share of the beam that must hit for a return"
    )
    max_range_m: float = Field(default=120.0, gt=0, description="longest range in metres")
    registration_m: float = Field(
        default=0.0, ge=0, le=0.5, description="standard deviation of the shift of each scan in metres"
    )
    wind_m: float = Field(
        default=0.0, ge=0, le=1, description="sway of the top of the crown during a scan in metres"
    )


class Beams(NamedTuple):
    """Beams in the order in which they leave.

    Attributes
    ----------
    origin, direction : (B, 3) array of float64
        Metres from the foot of the tree; unit vectors.
    scanner : (B,) array of uint8
        Number of the station or flight line.
    """

    origin: Floats
    direction: Floats
    scanner: NDArray[np.uint8]


def joined(parts: list[tuple[Floats, Floats]]) -> Beams:
    """Put the origins and directions of several scanners behind each other."""
    return Beams(
        np.concatenate([origin for origin, _ in parts]),
        np.concatenate([direction for _, direction in parts]),
        np.repeat(np.arange(len(parts), dtype=np.uint8), [len(origin) for origin, _ in parts]),
    )


def sunflower(count: int) -> Floats:
    """Return (count, 2) places spread evenly over the unit disc, around its middle."""
    number = np.arange(count)
    away, turn = np.sqrt((number + 0.5) / count), GOLDEN_TURN * number
    places = away[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    return np.asarray(places - places.mean(axis=0))


def sub_rays(origin: Floats, direction: Floats, options: BeamOptions) -> tuple[Floats, Floats]:
    """Split every beam into rays that together fill its footprint.

    Parameters
    ----------
    origin, direction : (B, 3) array of float64
    options : BeamOptions

    Returns
    -------
    origin, direction : (B * sub_rays, 3) array of float64
        The rays of a beam stand behind each other.
    """
    helper = np.where(np.abs(direction[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    across = np.cross(direction, helper)
    across /= np.linalg.norm(across, axis=1)[:, None]
    other = np.cross(direction, across)
    place = sunflower(options.sub_rays)
    off = place[:, 0, None] * across[:, None] + place[:, 1, None] * other[:, None]
    start = origin[:, None] + options.aperture_m / 2 * off
    heading = direction[:, None] + options.divergence_mrad / 2000 * off
    heading /= np.linalg.norm(heading, axis=2)[..., None]
    return start.reshape(-1, 3), heading.reshape(-1, 3)
