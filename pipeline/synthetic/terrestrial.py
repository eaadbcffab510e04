"""A scanner on a tripod that turns around at several stations: terrestrial laser scanning."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator
from pydantic import Field

from pipeline.errors import UsageError
from pipeline.model import Floats, Ints
from pipeline.synthetic.beams import BeamOptions, Beams, joined
from pipeline.synthetic.scene import Scene
from pipeline.synthetic.silhouette import Grid, cells_towards


class TlsOptions(BeamOptions):
    """Where the scanner stands and how fine it looks."""

    stations: int = Field(default=4, ge=1, le=64, description="positions of the scanner, evenly around")
    distance_m: float = Field(default=14.0, gt=0, le=200, description="from the foot of the tree in metres")
    azimuth_deg: float = Field(
        default=0.0, ge=0, lt=360, description="of the first station, from +x towards +y, in degrees"
    )
    height_m: float = Field(default=1.6, ge=0, le=50, description="of the scanner above the ground in metres")
    positions: tuple[tuple[float, float, float], ...] = Field(
        default=(),
        max_length=64,
        description="stations as [east, north, above ground] in metres from the foot, instead of the above",
    )
    lowest_deg: float = Field(
        default=-60.0, ge=-90, le=0, description="elevation below which the tripod is in the way, in degrees"
    )
    step_deg: float = Field(default=0.06, ge=0.005, le=5, description="between two beams, in degrees")


def step_for(density_per_m2: float, distance_m: float) -> float:
    """Return the step in degrees that gives so many points on a square metre that faces the scanner."""
    return float(np.degrees(1 / (distance_m * np.sqrt(density_per_m2))))


def stations_of(scene: Scene, options: TlsOptions) -> Floats:
    """Return the (S, 3) places of the scanner, in metres from the foot.

    Raises
    ------
    UsageError
        If a station stands inside the wood of a tree.
    """
    given = np.array(options.positions, dtype=np.float64).reshape(-1, 3)
    if not len(given):
        azimuth = np.radians(options.azimuth_deg) + 2 * np.pi * np.arange(options.stations) / options.stations
        around = options.distance_m * np.column_stack([np.cos(azimuth), np.sin(azimuth)])
        given = np.column_stack([around, np.full(options.stations, options.height_m)])
    placed = given + np.column_stack([np.zeros((len(given), 2)), scene.ground.height(given[:, :2])])
    for number, place in enumerate(placed):
        if scene.inside_wood(place):
            east, north, up = given[number]
            msg = (
                f"station {number} at {east:.2f} m east and {north:.2f} m north of the foot, {up:.2f} m "
                "above the ground, stands inside a trunk; give a larger distance_m or other positions"
            )
            raise UsageError(msg)
    return np.asarray(placed)


def tripod_beams(scene: Scene, options: TlsOptions, rng: Generator) -> Beams:
    """Return those beams of all stations that can hit what is kept, station by station.

    The grid of directions is as regular as that of a scanner with two turning mirrors: denser
    towards the zenith.
    """
    kept = _near(scene, options.margin_m)
    beam = (options.aperture_m, options.divergence_mrad / 1000)
    parts = []
    for place in stations_of(scene, options):
        grid = Grid(np.radians(options.step_deg), rng.random(2), float(np.arctan2(-place[1], -place[0])))
        heading = grid.directions(cells_towards(scene.vertices - place, kept, grid, beam))
        heading = heading[heading[:, 2] >= np.sin(np.radians(options.lowest_deg))]
        parts.append((np.broadcast_to(place, heading.shape), heading))
    return joined(parts)


def _near(scene: Scene, margin_m: float) -> Ints:
    """Return the faces that reach into the circle around the crown."""
    away = np.hypot(scene.vertices[:, 0], scene.vertices[:, 1])
    return np.asarray(scene.faces[(away <= scene.crown_radius + margin_m)[scene.faces].any(axis=1)])
