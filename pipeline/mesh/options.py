"""What can be chosen of a mesh: how round, how smooth, how detailed, with or without leaves."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from pipeline.options import Options


class TubeOptions(Options):
    """How round and how fine the tubes are."""

    min_radius_m: float = Field(0.004, gt=0, le=0.1, description="thinnest radius that is drawn, metres")
    max_deviation_m: float = Field(
        0.002, gt=0, le=0.1, description="farthest that the middle of a side may lie inside the bark, metres"
    )
    min_edge_m: float = Field(0.003, gt=0, le=0.1, description="shortest edge around a ring, metres")
    ring_gap_m: float = Field(
        0.002, gt=0, le=0.1, description="least distance between two rings; closer ones are merged, metres"
    )
    min_sides: int = Field(4, ge=3, le=64, description="fewest sides of a ring")
    max_sides: int = Field(32, ge=3, le=64, description="most sides of a ring")

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.min_sides > self.max_sides:
            msg = f"min_sides {self.min_sides} is above max_sides {self.max_sides}; lower min_sides"
            raise ValueError(msg)
        return self


class MeshOptions(TubeOptions):
    """How a tree is drawn for mesh files. As they stand, the mesh is that of `tubes`."""

    union: bool = Field(False, description="whether the tubes of all branches are joined into one surface")
    smooth: bool = Field(False, description="whether bends are rounded and shaded smoothly")
    subdivisions: int = Field(
        3, ge=0, le=16, description="rings added between two nodes where a smooth axis bends"
    )
    max_swing: float = Field(
        0.5, gt=0, le=1, description="farthest a smooth axis leaves the skeleton, as a share of the radius"
    )
    lod: int = Field(
        0,
        ge=0,
        le=3,
        description="level of detail: 0 is all, each further one has at most a quarter of the triangles",
    )
    leaves: Literal["none", "quads", "crosses"] = Field(
        "none", description="leaves at the tips: none, folded quads, or two crossing ones each"
    )
    leaf_size_m: float = Field(0.08, gt=0, le=1, description="length of a leaf, metres")
    leaves_per_tip: int = Field(12, ge=1, le=200, description="leaves on every twig that ends in a tip")
    leaf_zone_m: float = Field(
        0.4, gt=0, le=5, description="how far below the tip leaves grow, metres along the twig"
    )
    leaf_droop: float = Field(
        0.35, ge=0, le=1, description="how far leaves hang: 0 follows the petiole, 1 points straight down"
    )
    seed: int = Field(0, ge=0, description="seed of the leaves' positions and turns")
