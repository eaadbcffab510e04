"""Trees that organise themselves year by year, the stem cleared below if asked for: an adapter to growth."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from pydantic import Field

from pipeline.growth import GrowthOptions, grow
from pipeline.growth.events import planned
from pipeline.growth.pruning import CrownRaise
from pipeline.model import TreeModel

SUFFIX = ".toml"
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


class OrganicPresets(Mapping[str, Mapping[str, Any]]):
    """Street trees by name, read from configs/organic: each names what differs from the defaults."""

    def __getitem__(self, name: str) -> Mapping[str, Any]:
        """Return the options that an example sets."""
        if name not in list(self):
            raise KeyError(name)
        return tomllib.loads((_folder() / f"{name}{SUFFIX}").read_text(encoding="utf-8"))

    def __iter__(self) -> Iterator[str]:
        """Yield the names in order."""
        entries = _folder().iterdir()
        yield from sorted(entry.name[: -len(SUFFIX)] for entry in entries if entry.name.endswith(SUFFIX))

    def __len__(self) -> int:
        return sum(1 for _ in self)


def _folder() -> Traversable:
    """Return configs/organic: inside the package once installed, beside it in a source tree."""
    inside = files("pipeline") / "configs" / "organic"
    return inside if inside.is_dir() else Path(__file__).resolve().parents[2] / "configs" / "organic"


ORGANIC = OrganicPresets()
