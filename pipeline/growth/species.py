"""Sets of growth parameters by name, from configs/species: each names what differs from the defaults."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import Any

from pipeline.errors import UsageError
from pipeline.shipped import Shipped

SPECIES = Shipped("species")


def species_named(name: str) -> Mapping[str, Any]:
    """Return the parameters of a species.

    Raises
    ------
    UsageError
        If there is none of that name, listing those there are.
    """
    if name in SPECIES:
        return SPECIES[name]
    near = difflib.get_close_matches(name, list(SPECIES), n=1)
    meant = f", do you mean {near[0]}?" if near else ";"
    msg = f"unknown species {name!r}{meant} known: {', '.join(SPECIES)}"
    raise UsageError(msg)
