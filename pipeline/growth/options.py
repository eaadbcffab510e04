"""The parameters of self-organising growth: light, allocation, shoots, shedding, widths, limits."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from pipeline.options import Options

LightModel = Literal["shadow", "space"]
Allocation = Literal["bh", "priority"]


class LightOptions(Options):
    """How much light a bud has, and where there is more."""

    light: LightModel = Field(
        "shadow", description="where buds see light: outside the shadow of the wood above, or in free space"
    )
    full_light: float = Field(1.0, gt=0, le=100, description="light of a bud that nothing shades (C)")
    shade: float = Field(
        0.2, ge=0, le=10, description="shade of a metamer in its own voxel (a), in units of light"
    )
    shade_fall: float = Field(2.0, gt=1, le=20, description="how many times weaker every voxel down (b)")
    shade_layers: int = Field(5, ge=0, le=20, description="voxels down that a metamer shades (q_max)")
    voxel_m: float = Field(0.10, ge=0.01, le=2, description="edge of a voxel of the shadow grid in metres")
    light_tilt_deg: float = Field(
        0.0, ge=0, le=80, description="angle of the light's direction with the vertical in degrees"
    )
    light_azimuth_deg: float = Field(
        0.0, ge=0, le=360, description="where tilted light comes from, from +x towards +y, in degrees"
    )
    direction: Literal["weighted", "discrete"] = Field(
        "weighted",
        description="growth away from all shade around, or into the neighbour voxel with the least",
    )
    marker_spacing: float = Field(
        1.0, ge=0.25, le=4, description="distance of the markers of free space in metamer lengths"
    )
    occupancy: float = Field(
        2.0, gt=0, le=10, description="radius around a metamer that is not free, in metamer lengths"
    )
    perception: float = Field(
        5.0, gt=0, le=20, description="how far a bud sees free space, in metamer lengths"
    )
    perception_deg: float = Field(
        90.0, gt=0, le=180, description="full angle of the cone in which a bud sees free space, degrees"
    )

    @model_validator(mode="after")
    def _sees_beyond_itself(self) -> Self:
        if self.light == "space" and self.perception <= self.occupancy:
            msg = (
                f"perception {self.perception:g} is not above occupancy {self.occupancy:g}, so no bud sees "
                "free space; raise the one or lower the other"
            )
            raise ValueError(msg)
        return self


class AllocationOptions(Options):
    """How what the light brings is shared among the buds."""

    alpha: float = Field(2.2, gt=0, le=20, description="resource at the root for a unit of light")
    dominance: float = Field(
        0.52,
        gt=0,
        lt=1,
        description="share of the main axis at a fork of equal light (lambda of Borchert-Honda)",
    )
    allocation: Allocation = Field(
        "bh", description="extended Borchert-Honda, or by priority: the best lit branches of an axis first"
    )
    switch_year: int = Field(
        0, ge=0, le=10_000, description="last year of allocation by priority, then Borchert-Honda; 0: never"
    )
    priority_most: float = Field(1.0, gt=0, le=100, description="weight of the first in the list of priority")
    priority_least: float = Field(0.006, gt=0, le=100, description="weight of the last")
    priority_fall: float = Field(
        0.5, gt=0, le=1, description="share of the list over which the weight falls from most to least"
    )
    priority_sides: int = Field(
        5,
        ge=1,
        le=1_000_000,
        description="most side branches and buds of an axis shared out by priority; Borchert-Honda beyond",
    )
    damaged_share: float = Field(
        0.5, gt=0, le=1, description="part that each side branch takes of what a damaged bud cannot use"
    )


class ShootOptions(Options):
    """When buds grow, how far and where to."""

    metamer_m: float = Field(0.10, ge=0.005, le=2, description="length of a metamer in metres")
    length_by: Literal["constant", "resource"] = Field(
        "constant", description="whether metamers are all as long, or longer by what whole numbers leave over"
    )
    terminal_threshold: float = Field(1.0, ge=1, le=100, description="resource that lets a terminal bud grow")
    lateral_threshold: float = Field(1.8, ge=1, le=100, description="resource that lets a lateral bud grow")
    longest_shoot: int = Field(20, ge=1, le=1000, description="most metamers in a shoot of one year")
    bud_weight: float = Field(0.60, ge=0, le=1, description="pull of the bud's own direction (gamma)")
    light_weight: float = Field(0.35, ge=0, le=1, description="pull towards the light or free space (eta)")
    vertical_weight: float = Field(0.05, ge=-1, le=1, description="pull upwards, below 0 downwards (xi)")
    vertical_fall: float = Field(
        0.0, ge=0, le=1, description="by how much the pull upwards falls every year, also below 0"
    )
    takeover_weight: float = Field(
        0.3, ge=0, le=10, description="pull along a cut axis of the bud beside the cut"
    )
    insertion_deg: float = Field(
        60.0, ge=0, le=120, description="angle of a lateral bud with its axis in degrees"
    )
    insertion_spread_deg: float = Field(
        5.0, ge=0, le=45, description="most that this angle differs from bud to bud, degrees"
    )
    phyllotaxis_deg: float = Field(
        137.5, ge=0, le=360, description="angle from one bud to the next around the axis in degrees"
    )
    phyllotaxis_spread_deg: float = Field(
        10.0, ge=0, le=180, description="most that this angle differs from bud to bud, degrees"
    )


class LimitOptions(Options):
    """What falls off, how thick wood becomes, and where growth ends."""

    shed_threshold: float = Field(
        0.15, ge=0, le=100, description="light for a metamer below which a side branch dies; 0: none"
    )
    pipe_exponent: float = Field(
        2.3, ge=1, le=4, description="branches join by this power of their diameters"
    )
    tip_radius_m: float = Field(0.003, gt=0, le=0.1, description="radius of a new shoot in metres")
    bound: Literal["none", "box", "cylinder", "ellipsoid"] = Field(
        "none", description="shape beyond which no shoot grows, upright over the foot"
    )
    bound_width_m: float = Field(4.0, gt=0, le=100, description="width of that shape in metres")
    bound_depth_m: float = Field(4.0, gt=0, le=100, description="depth of that shape in metres")
    bound_height_m: float = Field(6.0, gt=0, le=100, description="height of that shape in metres")
    bound_base_m: float = Field(
        0.0, ge=0, le=100, description="height above the foot where it begins; the stem below is free"
    )
    most_metamers: int = Field(
        1_000_000, ge=1, le=50_000_000, description="growth that would make more metamers stops"
    )


class GrowthOptions(LightOptions, AllocationOptions, ShootOptions, LimitOptions):
    """All parameters of a growing tree."""
