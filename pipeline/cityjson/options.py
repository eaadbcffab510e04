"""What a CityJSON file of one tree holds, and how finely."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from pipeline.options import Options

Lod = Literal["1", "2", "3"]
Profile = Literal["default", "extension", "compact"]


class CityjsonOptions(Options):
    """Which profile and levels of detail are written, and the steps to which coordinates are rounded."""

    profile: Profile = Field(
        "default", description="default: solids; extension: the same, declared; compact: axes, radius classes"
    )
    lods: tuple[Lod, ...] = Field(
        ("1", "2", "3"), description="levels of detail: 1 the hull, 2 the main branches, 3 all branches"
    )
    skeleton: bool = Field(True, description="write the nodes and radii as an attribute, to read them back")
    skeleton_object: bool = Field(
        False, description="write the axes as lines in an object of their own too; some viewers refuse them"
    )
    main_share: float = Field(
        0.2, ge=0, le=1, description="main branches are at least this thick, as a share of the stem's foot"
    )
    max_deviation_m: float = Field(
        0.002, gt=0, le=0.1, description="farthest that a side of a tube may lie inside the bark, metres"
    )
    vertex_step_m: float = Field(1e-4, ge=1e-6, le=1e-4, description="step of the vertices, metres")
    node_step_m: float = Field(1e-3, ge=1e-6, le=1e-3, description="step of the skeleton's nodes, metres")
    radius_step_m: float = Field(1e-4, ge=1e-6, le=1e-3, description="step of the skeleton's radii, metres")
    radius_classes: int = Field(10, ge=2, le=1000, description="classes of radius in the compact profile")
    extension_url: str = Field(
        "treeskeleton.ext.json",
        min_length=1,
        description="address of treeskeleton.ext.json; this one means that the file is written beside",
    )
