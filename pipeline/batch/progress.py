"""How far a run is: counted by the engine, shown by whoever watches."""

from __future__ import annotations

from dataclasses import dataclass, field
from time import perf_counter
from typing import Any


@dataclass
class Progress:
    """Counts of a run; those of earlier runs in the same folder are in the totals, not in the rates.

    Parameters
    ----------
    planned, done, quarantined : int
        Cells.
    slices, exploded : int
        Pieces of tiles that are to be exploded, and that are.
    trees, fallback_trees, points : int
        Of all cells that are done.
    peak_rss_mb : float
        The most that a worker used.
    """

    planned: int = 0
    done: int = 0
    quarantined: int = 0
    slices: int = 0
    exploded: int = 0
    trees: int = 0
    fallback_trees: int = 0
    points: int = 0
    peak_rss_mb: float = 0.0
    dashboard: str = ""
    fresh: dict[str, int] = field(default_factory=lambda: {"cells": 0, "trees": 0, "points": 0})
    began: float = field(default_factory=perf_counter)

    def count(self, manifest: dict[str, Any], *, fresh: bool) -> None:
        """Count a cell that is done, in this run or in an earlier one."""
        trees, points = int(manifest.get("trees", 0)), int(manifest.get("points", 0))
        self.done += 1
        self.trees += trees
        self.fallback_trees += int(manifest.get("fallback_trees", 0))
        self.points += points
        self.peak_rss_mb = max(self.peak_rss_mb, float(manifest.get("peak_rss_mb") or 0.0))
        if fresh:
            self.fresh["cells"] += 1
            self.fresh["trees"] += trees
            self.fresh["points"] += points

    @property
    def seconds(self) -> float:
        """Since the run began."""
        return perf_counter() - self.began

    @property
    def open(self) -> int:
        """Cells that are still to be done."""
        return self.planned - self.done - self.quarantined

    @property
    def seconds_left(self) -> float | None:
        """As long as the cells before took; None before the first."""
        cells = self.fresh["cells"]
        return self.seconds / cells * self.open if cells else None

    def rate(self, what: str) -> float:
        """Trees or points of this run in a second."""
        return self.fresh[what] / max(self.seconds, 1e-9)

    def summary(self) -> dict[str, Any]:
        """Return what stands in summary.json."""
        return {
            "planned": self.planned,
            "done": self.done,
            "quarantined": self.quarantined,
            "trees": self.trees,
            "fallback_trees": self.fallback_trees,
            "seconds": round(self.seconds, 3),
            "points": self.points,
            "trees_per_s": round(self.rate("trees"), 3),
            "points_per_s": round(self.rate("points"), 1),
            "peak_rss_mb": round(self.peak_rss_mb, 1),
        }

    def line(self) -> str:
        """Return the state in one line."""
        text = f"{self.done} of {self.planned} cells"
        if self.exploded < self.slices:
            text = f"exploding {self.exploded} of {self.slices}, {text}"
        if self.quarantined:
            text += f", {self.quarantined} quarantined"
        text += f", {self.trees} trees, {self.rate('trees'):.1f} trees/s"
        left = self.seconds_left
        return text if left is None else f"{text}, {duration(left)} left"


def duration(seconds: float) -> str:
    """Write a time as people read it.

    Examples
    --------
    >>> duration(42.4), duration(4242), duration(424242)
    ('42 s', '1 h 10 min', '4 d 21 h')
    """
    minutes, hours, days = seconds / 60, seconds / 3600, seconds / 86400
    if days >= 1:
        return f"{int(days)} d {int(hours) % 24} h"
    if hours >= 1:
        return f"{int(hours)} h {int(minutes) % 60} min"
    return f"{int(minutes)} min" if minutes >= 2 else f"{round(seconds)} s"
