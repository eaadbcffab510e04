"""The parameters of a colonization tree: twenty for everyone, the rest for whoever looks closer."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from pipeline.options import Options

LeafType = Literal["triangle", "square", "cross-foil", "custom-square", "custom-cross-foil"]
StemColour = Literal["brown", "dark-brown", "light-brown", "grey", "grey-brown"]
LeafColour = Literal[
    "green",
    "dark-green",
    "light-green",
    "yellow-green",
    "olive",
    "yellow",
    "orange",
    "red",
    "crimson",
    "pink",
]
MOST_CUT = 0.95


class GrowthOptions(Options):
    """What decides where the nodes grow; another value is another growth."""

    seed: int = Field(1, ge=0, description="the same seed gives the same tree")
    iterations: int = Field(30, ge=0, le=100, description="steps of growth, the age of the tree")
    stem_length_m: float = Field(2.0, ge=0, le=10, description="length of the stem below the crown, metres")
    crown_stem_ratio: float = Field(
        0.0,
        ge=0,
        le=1,
        description="how far the stem goes on into the crown; 1: to its top (excurrent trees)",
    )
    crown_width_m: float = Field(5.0, ge=1, le=20, description="half the width of the whole crown, metres")
    crown_height_m: float = Field(7.0, ge=1, le=20, description="half the height of the whole crown, metres")
    crown_depth_m: float = Field(4.5, ge=1, le=20, description="half the depth of the whole crown, metres")
    cutoff_top: float = Field(0.05, ge=0, le=1, description="share of the crown's height cut off at the top")
    cutoff_bottom: float = Field(
        0.15, ge=0, le=1, description="share of the crown's height cut off at the bottom"
    )
    density_begin: float = Field(
        0.0, ge=0, le=1, description="density of branches when growth begins; more is a shorter kill distance"
    )
    density_end: float = Field(0.8, ge=0, le=1, description="density of branches when growth ends")
    gnarliness: float = Field(
        0.8,
        ge=0,
        le=1,
        description="how crooked branches are: 0 straight, seen from afar, 1 gnarly, seen from near",
    )
    step_m: float = Field(0.25, ge=0.05, le=2, description="length of a segment, metres")
    perception_deg: float = Field(
        160.0, gt=0, le=360, description="full angle of the cone in which a tip sees free space, degrees"
    )
    tropism_x: float = Field(0.0, ge=-10, le=10, description="pull of every direction to the east")
    tropism_y: float = Field(0.0, ge=-10, le=10, description="pull of every direction to the north")
    tropism_z: float = Field(
        1.0, ge=-10, le=10, description="pull of every direction upwards, lessened in flat crowns"
    )
    tropism_on: Literal["sum", "unit"] = Field(
        "sum", description="what tropism is added to: the sum of the pulls of all points, or its direction"
    )
    kill_interpolation: Literal["squared", "linear"] = Field(
        "squared", description="whether densities interpolate the squared kill distance or the distance"
    )
    sigmoid_from: float = Field(
        -12.0, ge=-50, le=50, description="where the sigmoid from begin to end is entered"
    )
    sigmoid_to: float = Field(6.0, ge=-50, le=50, description="where the sigmoid from begin to end is left")
    stem_tilt_deg: float = Field(5.0, ge=0, le=30, description="most tilt of a stem's segment, degrees")
    rim_share: float = Field(
        1.0, gt=0, le=1, description="outer share of the crown's radius that holds points; 1: all of it"
    )
    rim_noise: float = Field(
        0.0, ge=0, le=0.5, description="how far the crown's rim goes in and out, as a share of its radius"
    )

    @model_validator(mode="after")
    def _leaves_a_crown(self) -> Self:
        cut = self.cutoff_top + self.cutoff_bottom
        if cut >= MOST_CUT:
            msg = (
                f"cutoff_top {self.cutoff_top:g} and cutoff_bottom {self.cutoff_bottom:g} leave nothing of "
                f"the crown; their sum must be below {MOST_CUT}"
            )
            raise ValueError(msg)
        if not self.iterations and not self.stem_length_m and not self.crown_stem_ratio:
            msg = "iterations 0, stem_length_m 0 and crown_stem_ratio 0 make a tree of one node; raise one"
            raise ValueError(msg)
        return self


class GeometryOptions(Options):
    """What decides how the grown nodes are shaped and clad; no growth is needed for another value."""

    stem_thickness: float = Field(
        0.55, ge=0, le=1, description="how fast branches thicken where they join: 0 slim, 1 stout"
    )
    tip_radius_m: float = Field(0.007, gt=0, le=0.1, description="radius of every tip, metres")
    pendulous: float = Field(0.0, ge=0, le=1, description="how much branches hang; 0: not at all")
    pendulous_start: float = Field(
        0.75, ge=0, le=1, description="order from which branches hang, as a share of the highest"
    )
    pendulous_order: Literal["branch", "depth"] = Field(
        "branch", description="what that order is: side branches passed, or nodes from the root"
    )
    leaves_per_node: float = Field(
        0.7, ge=0, le=10, description="leaves on every thin node; the part behind the point is a probability"
    )
    leaf_size_m: float = Field(
        0.7, ge=0, le=2.5, description="mean edge of a leaf or a foil of leaves, metres"
    )
    leaf_radius_m: float = Field(0.009, ge=0, le=1, description="only thinner nodes bear leaves, metres")
    leaf_shade: float = Field(
        0.0, ge=0, le=1, description="share of the leaves that the deepest shade of others leaves away"
    )
    ring_sides: int = Field(3, ge=3, le=24, description="sides of the rings around branches")


class AppearanceOptions(Options):
    """What decides colours and pictures on the surfaces."""

    leaf_type: LeafType = Field(
        "cross-foil", description="shape of a leaf; custom ones bear a picture of yours"
    )
    bark_picture: str = Field("", description="PNG file of your own bark; empty: it is painted")
    leaf_picture: str = Field("", description="PNG file of your own leaf or foil; empty: it is painted")
    stem_colour: StemColour = Field("brown", description="colour of the bark")
    leaf_colour: LeafColour = Field("green", description="colour of the leaves")


class ColonizationOptions(GrowthOptions, GeometryOptions, AppearanceOptions):
    """All parameters of a colonization tree."""
