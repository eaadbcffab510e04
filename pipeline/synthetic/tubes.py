"""A leafless tree of tapered tubes, grown from a seed: the simplest tree whose truth is known.

It looks like a tree, it does not grow like one: axes wander, branches leave at wide angles below and
narrow ones above and turn up towards the light, a crown's outline bounds their length, and radii
follow the wood that they carry, with noise. No reconstruction of ours makes trees this way.
"""

from __future__ import annotations

from collections import deque
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from pydantic import Field

from pipeline.model import MEASURED, Floats, Skeleton, TreeModel
from pipeline.options import Options

GOLDEN_DEG = 137.508
"""Angle between successive branches around a stem (phyllotaxis)."""
FORK_DEG = 32
"""Angle between the two leaders of a forked stem."""
UP = np.array([0.0, 0.0, 1.0])
PRESETS: dict[str, dict[str, float]] = {
    "sapling": {"height_m": 3.0, "trunk_radius_m": 0.03, "max_order": 1, "branch_spacing_m": 0.2},
    "excurrent": {"height_m": 12.0, "trunk_radius_m": 0.14, "crown_base": 0.15, "crown_width": 0.22},
    "decurrent": {
        "height_m": 9.0, "trunk_radius_m": 0.16, "fork": 0.35, "crown_width": 0.5, "branch_spacing_m": 0.4,
    },
    "pendulous": {"height_m": 8.0, "trunk_radius_m": 0.12, "crown_width": 0.45, "droop": 0.07},
    "leaning": {"height_m": 8.0, "trunk_radius_m": 0.12, "lean_deg": 20.0},
}  # fmt: skip
"""Trees of different habits, as options that differ from the defaults."""


class TubeTreeOptions(Options):
    """What the tree looks like."""

    seed: int = Field(default=1, ge=0, description="the same seed gives the same tree")
    height_m: float = Field(default=7.0, ge=2, le=40, description="length of the stem in metres")
    trunk_radius_m: float = Field(default=0.10, gt=0, le=1, description="radius of the foot in metres")
    tip_radius_m: float = Field(default=0.003, gt=0, le=0.05, description="least radius in metres")
    lean_deg: float = Field(default=0.0, ge=0, le=45, description="lean of the stem at its foot in degrees")
    fork: float = Field(
        default=0.0, ge=0, le=0.8, description="share of the height where the stem forks; 0: it does not"
    )
    crown_base: float = Field(default=0.3, ge=0.05, le=0.9, description="share of the height below the crown")
    crown_width: float = Field(
        default=0.38, gt=0, le=1, description="length of the longest branches as a share of the height"
    )
    branch_spacing_m: float = Field(
        default=0.3, gt=0, le=5, description="mean distance of branches along the stem in metres"
    )
    twig_spacing_m: float = Field(
        default=0.32, gt=0, le=5, description="mean distance of side branches along a branch in metres"
    )
    least_branch_m: float = Field(
        default=0.3, gt=0, le=5, description="branches shorter than this are not made"
    )
    max_order: int = Field(default=3, ge=0, le=5, description="highest branch order; the stem is 0")
    droop: float = Field(
        default=0.0, ge=0, le=0.3, description="how far branches turn down at each step; 0: they do not hang"
    )
    step_m: float = Field(default=0.07, gt=0, le=1, description="length of a segment in metres")


class Shoot(NamedTuple):
    """An axis that waits to be grown: where it starts, where it heads, how far and of which order."""

    foot: int
    heading: Floats
    length: float
    order: int


def grow_tubes(options: TubeTreeOptions | None = None) -> TreeModel:
    """Grow a tree with its foot in (0, 0, 0).

    Parameters
    ----------
    options : TubeTreeOptions, optional

    Returns
    -------
    TreeModel
        Numbered path by path, breadth first over branches; every radius counts as measured.
    """
    options = options or TubeTreeOptions()
    rng = np.random.default_rng(options.seed)
    nodes: list[Floats] = [np.zeros(3)]
    parent = [-1]
    azimuth, lean = rng.uniform(0, 2 * np.pi), np.radians(options.lean_deg)
    heading = np.array([np.sin(lean) * np.cos(azimuth), np.sin(lean) * np.sin(azimuth), np.cos(lean)])
    waiting = deque([Shoot(0, heading, options.height_m, 0)])
    while waiting:
        shoot = waiting.popleft()
        axis = _axis(nodes[shoot.foot], shoot, options, rng)
        numbers = [shoot.foot, *range(len(nodes), len(nodes) + len(axis))]
        parent += numbers[:-1]
        nodes += axis
        waiting.extend(_side_shoots(nodes, numbers, shoot, options, rng))
    skeleton = Skeleton(np.array(nodes), np.array(parent, dtype=np.int32))
    radius = _radii(skeleton, options, rng)
    count = len(skeleton)
    return TreeModel(
        skeleton, radius, np.full(count, MEASURED, dtype=np.uint8), np.zeros(count), None, {"method": "tubes"}
    )


def _axis(start: Floats, shoot: Shoot, options: TubeTreeOptions, rng: Generator) -> list[Floats]:
    """Wander from `start`: the stem straightens up, branches turn to the light at their tips, or hang."""
    step = options.step_m
    count = max(2, round(shoot.length / step))
    wander = 0.02 if shoot.order == 0 else 0.07
    rise = 0.02 if shoot.order == 0 else 0.03
    heading, here, axis = shoot.heading, start, []
    for i in range(count):
        pull = rise if shoot.order == 0 else rise * (2 * i / count - 0.3) - options.droop
        heading = _unit(heading + rng.normal(0, wander, 3) + pull * UP)
        here = here + step * heading
        axis.append(here)
    return axis


def _side_shoots(
    nodes: list[Floats], numbers: list[int], shoot: Shoot, options: TubeTreeOptions, rng: Generator
) -> list[Shoot]:
    """Return the branches of a grown axis, from its foot up."""
    if shoot.order >= options.max_order:
        return []
    shoots = []
    count = len(numbers) - 1
    turn = rng.uniform(0, 360)
    for i in _feet(count, shoot, options, rng):
        turn += GOLDEN_DEG if shoot.order == 0 else 180 + rng.normal(0, 35)
        along = i / count
        length = _branch_length(along, shoot, options) * rng.uniform(0.7, 1.1)
        if length >= options.least_branch_m:
            heading = _branch_heading(
                nodes[numbers[i]] - nodes[numbers[i - 1]], along, turn, shoot.order, rng
            )
            shoots.append(Shoot(numbers[i], heading, length, shoot.order + 1))
    if options.fork and _is_stem(shoot):
        shoots.append(_second_leader(nodes, numbers, shoot, options, rng))
    return sorted(shoots, key=lambda waiting: waiting.foot)


def _second_leader(
    nodes: list[Floats], numbers: list[int], shoot: Shoot, options: TubeTreeOptions, rng: Generator
) -> Shoot:
    """Return the other half of a forked stem; it grows like a stem."""
    foot = max(1, round(options.fork * (len(numbers) - 1)))
    axis = _unit(nodes[numbers[foot]] - nodes[numbers[foot - 1]])
    heading = _turned(axis, np.radians(FORK_DEG), rng.uniform(0, 2 * np.pi))
    return Shoot(numbers[foot], heading, 0.85 * (1 - options.fork) * shoot.length, 0)


def _is_stem(shoot: Shoot) -> bool:
    return shoot.foot == 0 and shoot.order == 0


def _feet(count: int, shoot: Shoot, options: TubeTreeOptions, rng: Generator) -> list[int]:
    """Return the steps along an axis where branches start, each at most once."""
    first = options.crown_base if _is_stem(shoot) else 0.15
    spacing = (options.branch_spacing_m if shoot.order == 0 else options.twig_spacing_m) / options.step_m
    at, feet = first * count + rng.uniform(0, spacing), []
    while at < 0.96 * count:
        feet.append(max(1, round(at)))
        at += max(1.0, spacing * rng.uniform(0.6, 1.4))
    return sorted(set(feet))


def _branch_length(along: float, shoot: Shoot, options: TubeTreeOptions) -> float:
    """Return the length of a branch at a share of its parent's axis."""
    if shoot.order > 0:
        return shoot.length * (0.12 + 0.5 * (1 - along))
    share = max(0.0, (along - options.crown_base) / (1 - options.crown_base))
    outline = np.sqrt(max(0.0, 1 - ((share - 0.3) / 0.75) ** 2))
    return float(options.crown_width * shoot.length * outline)


def _branch_heading(axis: Floats, along: float, turn_deg: float, order: int, rng: Generator) -> Floats:
    """Return where a branch leaves: wide angles at the base of a crown, narrow ones at its top."""
    angle = 75 - 40 * along if order == 0 else 48
    return _turned(_unit(axis), np.radians(angle + rng.normal(0, 6)), np.radians(turn_deg))


def _turned(axis: Floats, angle: float, azimuth: float) -> Floats:
    """Return the unit vector `angle` away from a unit `axis`, at `azimuth` around it."""
    helper = UP if abs(axis[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    across = _unit(np.cross(axis, helper))
    other = np.cross(axis, across)
    return np.asarray(
        np.cos(angle) * axis + np.sin(angle) * (np.cos(azimuth) * across + np.sin(azimuth) * other)
    )


def _radii(skeleton: Skeleton, options: TubeTreeOptions, rng: Generator) -> Floats:
    """Share the cross-section by carried wood (da Vinci), taper the stem, flare its foot.

    Every branch is 10 % thicker or thinner than its share, and nothing is thicker than what
    carries it.
    """
    wood = skeleton.subtree_length + options.step_m
    thickness = rng.lognormal(0, 0.1, len(skeleton.paths))[skeleton.branch]
    share = np.sqrt(wood / wood[0]) * np.where(skeleton.order > 0, 0.9 * thickness, 1.0)
    height = skeleton.xyz[:, 2] / options.height_m
    taper = np.where(skeleton.order == 0, 1 - 0.25 * np.clip(height, 0, 1), 1.0)
    flare = 1 + 0.15 * np.exp(-skeleton.xyz[:, 2] / 0.15)
    radius = options.trunk_radius_m * share * taper * flare
    for i, p in enumerate(skeleton.parent.tolist()[1:], 1):
        radius[i] = max(options.tip_radius_m, min(radius[i], radius[p]))
    return np.asarray(radius)


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector))
