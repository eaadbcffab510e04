"""Examples of different habits, from configs/colonization: each names what differs from the defaults."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

SUFFIX = ".toml"


class Presets(Mapping[str, Mapping[str, Any]]):
    """The examples by name, read when they are asked for."""

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
    """Return configs/colonization: inside the package once installed, beside it in a source tree."""
    inside = files("pipeline") / "configs" / "colonization"
    return inside if inside.is_dir() else Path(__file__).resolve().parents[3] / "configs" / "colonization"


PRESETS = Presets()
