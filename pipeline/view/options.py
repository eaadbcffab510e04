"""How the picture is drawn; apart from the drawing, so that reading a config loads no graphics."""

from __future__ import annotations

from pydantic import Field

from pipeline.options import Options


class PictureOptions(Options):
    """Options of the picture beside every model."""

    width_px: int = Field(1800, ge=400, le=8000, description="width of the picture, pixels")
    height_px: int = Field(1000, ge=300, le=8000, description="height of the picture, pixels")
    most_points: int = Field(
        300_000,
        ge=1000,
        le=20_000_000,
        description="larger clouds are thinned to this many points",
    )
    point_px: float = Field(1.2, gt=0, le=20, description="size of a point, pixels")
    least_sides: int = Field(8, ge=3, le=64, description="sides of a drawn branch")
