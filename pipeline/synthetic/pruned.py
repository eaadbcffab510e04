"""Trees that a gardener has had a hand in: grown year by year and pruned, so that their truth is known."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from pydantic import Field

from pipeline.growth import Event, GrowthOptions, grow
from pipeline.growth.events import planned
from pipeline.growth.pruning import CrownRaise, Espalier, OpenCentre, Stake, Thin
from pipeline.model import TreeModel
from pipeline.options import Options


class PrunedTreeOptions(Options):
    """A fruit or street tree: staked, opened, its crown raised and thinned."""

    seed: int = Field(default=1, ge=0, description="the same seed gives the same tree")
    years: int = Field(default=20, ge=1, le=40, description="years of growth")
    stake_years: int = Field(default=8, ge=0, le=40, description="years at the stake; 0: none")
    open_year: int = Field(default=10, ge=0, le=40, description="year of the cut that opens it; 0: none")
    clear_m: float = Field(
        default=0.0,
        ge=0,
        le=10,
        description="clear height of the stem in metres, kept from the year of opening on",
    )
    thin_share: float = Field(
        default=0.1, ge=0, le=0.5, description="share of the wood thinned out, five years before the end"
    )
    metamer_m: float = Field(default=0.1, ge=0.05, le=0.5, description="length of a metamer in metres")


class EspalierOptions(Options):
    """A tree along a wall."""

    seed: int = Field(default=1, ge=0, description="the same seed gives the same tree")
    years: int = Field(default=18, ge=1, le=40, description="years of growth")
    tiers: int = Field(default=3, ge=1, le=8, description="number of tiers")
    arm_m: float = Field(default=1.5, gt=0, le=5, description="greatest length of an arm in metres")
    wall_deg: float = Field(
        default=0.0, ge=-360, le=360, description="the way along the wall, from +x towards +y, degrees"
    )


PRUNED: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "decurrent": {"years": 18, "open_year": 9, "thin_share": 0.0},
        "excurrent": {"open_year": 0, "clear_m": 1.2, "thin_share": 0.2, "stake_years": 12},
    }
)
"""A bush on three leaders, and a street tree with one stem, as options that differ from the defaults."""

ESPALIERS: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {
        "excurrent": {"tiers": 3},
        "low": {"tiers": 1, "years": 14},
        "tall": {"tiers": 5, "years": 26, "arm_m": 1.2},
    }
)
"""Espaliers of different sizes; all keep one stem, the first is what is usual."""


def grow_pruned(options: PrunedTreeOptions) -> TreeModel:
    """Grow a tree, and prune it on the way."""
    growth = GrowthOptions(metamer_m=options.metamer_m, voxel_m=options.metamer_m)
    return grow(growth, options.years, seed=options.seed, events=_programme(options)).to_model()


def grow_espalier(options: EspalierOptions) -> TreeModel:
    """Grow a tree along a wall, trained year by year."""
    training = Espalier(tiers=options.tiers, arm_m=options.arm_m, wall_deg=options.wall_deg)
    events = planned(training, 1, until=options.years)
    return grow(GrowthOptions(), options.years, seed=options.seed, events=events).to_model()


def _programme(options: PrunedTreeOptions) -> tuple[Event, ...]:
    """Return what is done in which year."""
    years = options.years
    events: list[Event] = []
    if options.stake_years:
        events += planned(Stake(years=options.stake_years), 0)
    if 0 < options.open_year <= years:
        events += planned(OpenCentre(), options.open_year, until=years, every=3)
    if options.clear_m:
        events += planned(
            CrownRaise(height_m=options.clear_m), min(max(options.open_year, 6), years), until=years
        )
    if options.thin_share and years > 5:
        events += planned(Thin(share=options.thin_share), years - 5)
    return tuple(events)
