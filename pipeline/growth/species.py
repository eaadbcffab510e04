"""Sets of growth parameters by name, from configs/species: each names what differs from the defaults."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterator, Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from pipeline.errors import UsageError

SUFFIX = ".toml"


class Species(Mapping[str, Mapping[str, Any]]):
    """The sets by name, read when they are asked for."""

    def __getitem__(self, name: str) -> Mapping[str, Any]:
        """Return the parameters that a set gives.

        Raises
        ------
        KeyError
            If there is none of that name.
        """
        if name not in list(self):
            raise KeyError(name)
        return tomllib.loads((_folder() / f"{name}{SUFFIX}").read_text(encoding="utf-8"))

    def __iter__(self) -> Iterator[str]:
        """Yield the names in order."""
        entries = _folder().iterdir()
        yield from sorted(entry.name[: -len(SUFFIX)] for entry in entries if entry.name.endswith(SUFFIX))

    def __len__(self) -> int:
        return sum(1 for _ in self)


SPECIES = Species()


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


def _folder() -> Traversable:
    """Return configs/species: inside the package once installed, beside it in a source tree."""
    inside = files("pipeline") / "configs" / "species"
    return inside if inside.is_dir() else Path(__file__).resolve().parents[2] / "configs" / "species"
