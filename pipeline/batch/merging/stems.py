"""Stems of a field list, joined one to one to the trees from the air."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any

from scipy.spatial import cKDTree

from pipeline.batch.merging.fieldlist import Stem
from pipeline.model import Floats

REACH_M = 3.0
"""A stem further than this from the foot of every tree is not joined."""


@dataclass(frozen=True)
class Joined:
    """Which tree is which stem.

    Parameters
    ----------
    by_tree : mapping of str to tuple
        Species, leaf type, diameter in cm and distance in m, by tree_id.
    unmatched : tuple of Stem
        Without a tree within reach, or whose trees are nearer to another stem.
    """

    by_tree: Mapping[str, tuple[str | None, str | None, float, float]]
    unmatched: tuple[Stem, ...]

    def summary(self) -> dict[str, Any]:
        """Return the figures for people."""
        matched, left = len(self.by_tree), [stem.name for stem in self.unmatched]
        return {
            "given": matched + len(left),
            "matched": matched,
            "unmatched": len(left),
            "unmatched_names": left,
        }

    def to_json(self) -> str:
        """Return the figures, and the stems that have no tree, as JSON."""
        left = [
            {"name": stem.name, "x": stem.x, "y": stem.y, "species": stem.species} for stem in self.unmatched
        ]
        told = {**self.summary(), "unmatched_stems": left}
        return json.dumps(told, indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def join(
    stems: Sequence[Stem], trees: Iterable[tuple[Sequence[str], Floats]], reach_m: float = REACH_M
) -> Joined:
    """Join stems to trees one to one, the nearest pairs first.

    Parameters
    ----------
    stems : sequence of Stem
    trees : iterable of (names, (N, 2) array)
        Names of trees and where their stems stand, in parts.
    reach_m : float
        Largest distance.

    Notes
    -----
    Pairs of the same distance are taken by the tree's name, then by the stem's place and name; the order
    of the rows and of the parts does not matter.
    """
    index = cKDTree([(stem.x, stem.y) for stem in stems]) if stems else None
    pairs: list[tuple[float, str, float, float, str, int]] = []
    for names, places in trees:
        near = index.query_ball_point(places, reach_m) if index is not None and len(places) else ()
        for name, (x, y), within in zip(names, places, near, strict=False):
            for k in within:
                stem = stems[k]
                pairs.append((hypot(stem.x - x, stem.y - y), name, stem.x, stem.y, stem.name, k))
    by_tree: dict[str, tuple[str | None, str | None, float, float]] = {}
    taken: set[int] = set()
    for distance, name, *_, k in sorted(pairs):
        if name not in by_tree and k not in taken:
            by_tree[name] = (stems[k].species, stems[k].leaf_type, stems[k].dbh_cm, distance)
            taken.add(k)
    return Joined(by_tree, tuple(stem for k, stem in enumerate(stems) if k not in taken))
