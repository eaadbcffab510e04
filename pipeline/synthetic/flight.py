"""A scanner in an aeroplane that passes by: airborne laser scanning."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from pydantic import Field

from pipeline.model import Floats
from pipeline.synthetic.beams import MOST_RETURNS, BeamOptions, Beams, joined
from pipeline.synthetic.scene import Scene


class AlsOptions(BeamOptions):
    """How the aeroplane flies and how often it shoots."""

    altitude_m: float = Field(default=600.0, ge=50, le=5000, description="above the foot in metres")
    density_per_m2: float = Field(
        default=15.0, gt=0, le=2000, description="pulses on a square metre of ground, all lines together"
    )
    lines: int = Field(default=2, ge=1, le=32, description="flight lines that see the tree")
    scan_angle_deg: float = Field(
        default=15.0, ge=0, le=45, description="largest angle from the vertical in degrees"
    )
    noise_m: float = Field(default=0.015, ge=0, le=0.2, description="standard deviation of a range in metres")
    divergence_mrad: float = Field(
        default=0.5, ge=0, le=10, description="full angle of the widening beam in milliradians"
    )
    gap_m: float = Field(
        default=0.5, gt=0, le=10, description="surfaces farther apart than this give two returns, in metres"
    )
    max_returns: int = Field(default=5, ge=1, le=MOST_RETURNS, description="most returns of a pulse")
    max_range_m: float = Field(default=10_000.0, gt=0, description="longest range in metres")
    leaf_size_m: float = Field(
        default=0.18, gt=0, le=0.5, description="length of a leaf in metres; fewer large ones are quicker"
    )
    facet_m: float = Field(
        default=0.002, gt=0, le=0.02, description="largest gap of a flat side from round bark in metres"
    )


def flight_beams(scene: Scene, options: AlsOptions, rng: Generator) -> Beams:
    """Return the beams of all flight lines that pass through the air around the tree.

    Every line has a heading and an angle at which it sees the tree, drawn from the seed. Its pulses meet
    the level of the foot on a square grid; each leaves where the aeroplane is then.
    """
    parts = []
    for _ in range(options.lines):
        angle = np.radians(options.scan_angle_deg) * rng.uniform(-1, 1)
        heading, phase = rng.uniform(0, 2 * np.pi), rng.random(2)
        reach = scene.crown_radius + options.margin_m + scene.height * abs(float(np.tan(angle)))
        aim = _square_grid(reach, np.sqrt(options.lines / options.density_per_m2), phase)
        side = -options.altitude_m * np.tan(angle)
        parts.append(_turned(aim, side, options.altitude_m, heading))
    return joined(parts)


def _square_grid(reach: float, spacing: float, phase: Floats) -> Floats:
    """Return the (P, 2) places of a square grid within a circle: along and across the flight."""
    half = int(np.ceil(reach / spacing)) + 1
    row = np.arange(-half, half + 1)
    along, across = (spacing * (row + p) for p in phase)
    places = np.stack(np.meshgrid(along, across, indexing="ij"), axis=-1).reshape(-1, 2)
    return np.asarray(places[np.linalg.norm(places, axis=1) <= reach])


def _turned(aim: Floats, side: float, altitude: float, heading: float) -> tuple[Floats, Floats]:
    """Return origins and directions of pulses at `aim`, for an aeroplane `side` metres to the side."""
    turn = np.array([[np.cos(heading), np.sin(heading)], [-np.sin(heading), np.cos(heading)]])
    level = np.zeros(len(aim))
    target = np.column_stack([aim @ turn, level])
    above = np.column_stack([np.column_stack([aim[:, 0], level + side]) @ turn, level + altitude])
    ray = target - above
    return above, ray / np.linalg.norm(ray, axis=1)[:, None]
