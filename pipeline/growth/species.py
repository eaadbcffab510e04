"""Sets of growth parameters by name, from configs/species: each names what differs from the defaults."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pipeline.choosing import named
from pipeline.shipped import Shipped

SPECIES = Shipped("species")


def species_named(name: str) -> Mapping[str, Any]:
    """Return the parameters of a species.

    Raises
    ------
    UsageError
        If there is none of that name, listing those there are.
    """
    return named(name, SPECIES, "species")
