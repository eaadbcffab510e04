"""What a CityJSON file of one tree holds, and how finely."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from pipeline.options import Options

Lod = Literal["1", "2", "3"]


class CityjsonOptions(Options):
    """Which levels of detail are written, and the steps to which coordinates are rounded."""

    lods: tuple[Lod, ...] = Field(
        ("1", "2", "3"), description="levels of detail: 1 the hull, 2 the main branches, 3 all branches"
    )
    skeleton: bool = Field(True, description="write the nodes and radii as an attribute, to read them back")
    main_share: float = Field(
        0.2, ge=0, le=1, description="main branches are at least this thick, as a share of the stem's foot"
    )
    max_deviation_m: float = Field(
        0.002, gt=0, le=0.1, description="farthest that a side of a tube may lie inside the bark, metres"
    )
    vertex_step_m: float = Field(1e-4, ge=1e-6, le=1e-4, description="step of the vertices, metres")
    node_step_m: float = Field(1e-3, ge=1e-6, le=1e-3, description="step of the skeleton's nodes, metres")
    radius_step_m: float = Field(1e-4, ge=1e-6, le=1e-3, description="step of the skeleton's radii, metres")
