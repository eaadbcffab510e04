"""The kinds of trees that can be grown, by name: a new generator is one entry in `KINDS`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

from pipeline.choosing import named
from pipeline.mesh import Mesh
from pipeline.mesh.look import Look
from pipeline.model import TreeModel
from pipeline.options import Options
from pipeline.synthetic import colonization
from pipeline.synthetic.organic import ORGANIC, OrganicTreeOptions, grow_organic
from pipeline.synthetic.pruned import (
    ESPALIERS,
    PRUNED,
    EspalierOptions,
    PrunedTreeOptions,
    grow_espalier,
    grow_pruned,
)
from pipeline.synthetic.tubes import PRESETS, TubeTreeOptions, grow_tubes

NO_PRESETS: Mapping[str, Mapping[str, Any]] = MappingProxyType({})


class Kind(NamedTuple):
    """A generator of trees.

    Attributes
    ----------
    options : type of Options
        Has a field `seed`.
    grow : callable
        Makes a `TreeModel` of these options.
    about : str
        What it grows, in a few words.
    presets : mapping of str to mapping
        Options by name, for trees of different looks.
    tells : bool
        Whether `grow` takes a second argument that is told after every step (`done` of `iterations`).
    draw : callable, optional
        Makes the mesh of a tree, its options and ``leaves=True``; None where any tree is drawn alike.
    look : callable, optional
        Colours and pictures of these options; there where `draw` is.
    """

    options: type[Options]
    grow: Callable[..., TreeModel]
    about: str
    presets: Mapping[str, Mapping[str, Any]] = NO_PRESETS
    tells: bool = False
    draw: Callable[..., Mesh] | None = None
    look: Callable[[Any], Look] | None = None

    def preset(self, name: str) -> Mapping[str, Any]:
        """Return the options that a preset sets.

        Raises
        ------
        UsageError
            If there is none of that name, listing those there are.
        """
        return named(name, self.presets, "preset")


KINDS: dict[str, Kind] = {
    "tubes": Kind(TubeTreeOptions, grow_tubes, "wandering axes around a stem, the quickest", PRESETS),
    "colonization": Kind(
        colonization.ColonizationOptions,
        colonization.grow_colonization,
        "branches that compete for the free space of a crown",
        colonization.PRESETS,
        tells=True,
        draw=colonization.dressed,
        look=colonization.look_of,
    ),
    "organic": Kind(OrganicTreeOptions, grow_organic, "buds that compete for light, year by year", ORGANIC),
    "pruned": Kind(PrunedTreeOptions, grow_pruned, "grown in its years, staked and pruned open", PRUNED),
    "espalier": Kind(EspalierOptions, grow_espalier, "grown and trained along a wall", ESPALIERS),
}
"""Generators by name."""


def kind_named(name: str) -> Kind:
    """Return one of `KINDS`.

    Raises
    ------
    UsageError
        If there is none of that name, listing those there are.
    """
    return named(name, KINDS, "kind of tree")
