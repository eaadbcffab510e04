"""What a run will cost, told before it begins, from the headers of its tiles alone."""

from __future__ import annotations

from pipeline.batch.plan import Plan
from pipeline.batch.status import Status
from pipeline.cloud.parts import RECORD

CPU_S_PER_MILLION = 1.6
"""CPU seconds from a million points of a tile to cut out trees, as docs/scaling.md measures them."""

CPU_S_PER_TREE = 0.024
"""CPU seconds from the points of a tree to its written model."""

RESULT_BYTES_PER_TREE = 36_000
"""Bytes of results for a tree, nearly all of it CityJSON."""

TREES_PER_HA = {"open": 80, "forest": 350}
"""Trees on a hectare: streets of a town (81 and 96 on samples of AHN), forest (322 and 329 on two plots)."""


def forecast(plan: Plan, workers: int) -> dict[str, float]:
    """Return what to expect: cells, points, disk; and trees, results and hours in the open and in forest.

    Nobody knows the trees beforehand, and they decide: hence two figures, of few and of many trees on the
    tiles' area, between which most tiles lie.

    Parameters
    ----------
    plan : Plan
    workers : int
        Processes that share the work.
    """
    told = {
        "cells": len(plan.cells),
        "points": round(plan.points),
        "hectares": plan.hectares,
        "work_gb": plan.buffered_points * RECORD.itemsize / 1e9,
    }
    for kind, per_ha in TREES_PER_HA.items():
        trees = plan.hectares * per_ha
        cpu_s = plan.points / 1e6 * CPU_S_PER_MILLION + trees * CPU_S_PER_TREE
        told[f"trees_{kind}"] = round(trees)
        told[f"results_gb_{kind}"] = trees * RESULT_BYTES_PER_TREE / 1e9
        told[f"hours_{kind}"] = cpu_s / 3600 / workers
    return told


BY_TREES = {
    "trees": ("trees", "{:,.0f}"),
    "disk, results": ("results_gb", "{:.2g} GB"),
    "hours": ("hours", "{:.2g}"),
}
"""Lines that depend on the trees: what they say, key and form."""


def lines(plan: Plan, workers: int, there: Status | None = None) -> list[str]:
    """Return a forecast for people, and how far the run is where it has begun."""
    told = forecast(plan, workers)
    out = [
        f"tiles            {len(plan.tiles)}, {plan.reference.crs}",
        f"cells            {told['cells']:.0f} of {plan.grid.core_m:g} m",
        f"points           {told['points'] / 1e6:.3g} million",
        f"disk, meanwhile  at most {told['work_gb']:.3g} GB",
    ]
    for label, (key, form) in BY_TREES.items():
        few, many = (form.format(told[f"{key}_{kind}"]) for kind in TREES_PER_HA)
        out.append(f"{label:<16} about {few} in an open town, {many} in dense forest")
    out.append(f"{'':<16} on {workers} workers; the trees decide, and only the run counts them")
    if there is not None:
        counts = ", ".join(f"{there.count(state)} {state}" for state in ("done", "quarantined", "missing"))
        out.append(
            f"{'begun':<16} {counts}; the figures above are of all cells, the run does the missing ones"
        )
    return out
