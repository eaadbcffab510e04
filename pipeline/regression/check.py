"""One tree of today against its reference, measure by measure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from pipeline.geometry.surface import Tubes, nearest_tube
from pipeline.model import Floats, Skeleton, TreeModel
from pipeline.regression.tolerance import Tolerance


@dataclass(frozen=True)
class Check:
    """One figure then and now.

    Parameters
    ----------
    measure : str
    reference, today : float or None
        None where it is not known.
    room : float
        How far they may be apart.
    """

    measure: str
    reference: float | None
    today: float | None
    room: float

    @property
    def difference(self) -> float | None:
        """Today less reference; None where one of them is not known."""
        if self.reference is None or self.today is None:
            return None
        return self.today - self.reference

    @property
    def ok(self) -> bool:
        """Whether they agree; what was known and is no longer, or the other way round, does not."""
        if self.difference is None:
            return self.reference is None and self.today is None
        return abs(self.difference) <= self.room

    @property
    def severity(self) -> float:
        """The difference in tolerances; infinite where a figure appears or is lost."""
        if self.difference is None:
            return 0.0 if self.ok else np.inf
        return abs(self.difference) / self.room if self.room else np.inf if self.difference else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for report.json."""
        return {**asdict(self), "difference": self.difference, "ok": self.ok}


def check_tree(
    figures: tuple[Mapping[str, Any], Mapping[str, Any]],
    trees: tuple[TreeModel, TreeModel],
    tolerances: Mapping[str, Tolerance],
) -> list[Check]:
    """Compare a tree with its reference.

    Parameters
    ----------
    figures : (mapping, mapping)
        report.json of the reference and of today.
    trees : (TreeModel, TreeModel)
        As their files have them.
    tolerances : mapping
        By measure; these are checked.
    """
    moved = 1000.0 * moved_m(trees[0].skeleton, trees[1].skeleton)
    apart = {"moved_median_mm": float(np.median(moved)), "moved_p95_mm": float(np.quantile(moved, 0.95))}
    then, now = ({**told, **_of_file(tree)} for told, tree in zip(figures, trees, strict=True))
    then, now = then | dict.fromkeys(apart, 0.0), now | apart
    checks = []
    for measure, tolerance in tolerances.items():
        before, after = _figure(then, measure), _figure(now, measure)
        checks.append(Check(measure, before, after, tolerance.room(before or 0.0)))
    return checks


def _of_file(tree: TreeModel) -> dict[str, float]:
    volume, length = float(tree.volume.sum()), float(tree.skeleton.length.sum())
    return {"file_volume_l": 1000.0 * volume, "file_length_m": length}


def moved_m(one: Skeleton, other: Skeleton) -> Floats:
    """(N + M,) distance of every node of each skeleton to the nearest axis of the other, in metres."""
    shift = other.origin - one.origin
    there, back = _to_axes(one.xyz, other.xyz + shift, other), _to_axes(other.xyz + shift, one.xyz, one)
    return np.concatenate([there, back])


def _to_axes(points: Floats, nodes: Floats, graph: Skeleton) -> Floats:
    if len(graph) < 2:
        return np.asarray(np.linalg.norm(points - nodes[0], axis=1))
    none = np.zeros(len(nodes) - 1)
    tubes = Tubes(nodes[graph.parent[1:]], nodes[1:], none, none)
    return nearest_tube(points, tubes).axial


def _figure(figures: Mapping[str, Any], measure: str) -> float | None:
    """Return a figure of a report; a dot leads into a table."""
    value: Any = figures
    for key in measure.split("."):
        value = value.get(key) if isinstance(value, Mapping) else None
    return None if value is None else float(value)
