"""Trees that organise themselves year by year, the stem cleared below if asked for: an adapter to growth."""

from __future__ import annotations

from pydantic import Field

from pipeline.growth import GrowthOptions, grow
from pipeline.growth.events import planned
from pipeline.growth.pruning import CrownRaise
from pipeline.model import TreeModel
from pipeline.shipped import Shipped

FIRST_CLEARED = 6
"""Year from which the stem is cleared: a younger tree has nothing else."""


class OrganicTreeOptions(GrowthOptions):
    """A tree that grows by itself; beside all parameters of growth its age, its seed and its clear stem."""

    seed: int = Field(default=1, ge=0, description="the same seed gives the same tree")
    years: int = Field(default=25, ge=1, le=100, description="years of growth")
    clear_m: float = Field(
        default=0.0,
        ge=0,
        le=10,
        description="clear height of the stem in metres, kept every third year from the sixth on; 0: none",
    )


def grow_organic(options: OrganicTreeOptions) -> TreeModel:
    """Grow a tree.

    Raises
    ------
    UsageError
        If there would be more metamers than `most_metamers`.
    """
    years = options.years
    events = (
        planned(CrownRaise(height_m=options.clear_m), min(FIRST_CLEARED, years), until=years, every=3)
        if options.clear_m
        else ()
    )
    return grow(options, years, seed=options.seed, events=events).to_model()


ORGANIC = Shipped("organic")
"""Street trees by name: each names what differs from the defaults."""
