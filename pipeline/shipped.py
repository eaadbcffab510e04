"""Sets of options that come with treepipe: the TOML files of a folder of configs/, by name."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from importlib.resources import files
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

SUFFIX = ".toml"


class Shipped(Mapping[str, Mapping[str, Any]]):
    """The sets of one folder by name, read when they are asked for.

    Parameters
    ----------
    folder : str
        Its name in configs/.
    """

    def __init__(self, folder: str) -> None:
        self._name = folder

    def __getitem__(self, name: str) -> Mapping[str, Any]:
        """Return the options that a set gives.

        Raises
        ------
        KeyError
            If there is none of that name.
        """
        if name not in list(self):
            raise KeyError(name)
        return tomllib.loads((self._folder / f"{name}{SUFFIX}").read_text(encoding="utf-8"))

    def __iter__(self) -> Iterator[str]:
        """Yield the names in order."""
        names = (entry.name for entry in self._folder.iterdir())
        yield from sorted(name.removesuffix(SUFFIX) for name in names if name.endswith(SUFFIX))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    @property
    def _folder(self) -> Traversable:
        """The folder: inside the package once installed, beside it in a source tree."""
        inside = files("pipeline") / "configs" / self._name
        return inside if inside.is_dir() else Path(__file__).resolve().parents[1] / "configs" / self._name
