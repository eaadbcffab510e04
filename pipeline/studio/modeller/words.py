"""Figures of a tree as the page tells them, and values of the page as parameters take them."""

from __future__ import annotations

from typing import Any

from pipeline.studio.modeller.modelling import ENDED, Modelled
from pipeline.studio.modeller.parameters import Parameter

NO_FIGURES = dict.fromkeys(("nodes", "vertices", "triangles", "milliseconds", "reason", "seed"), "")


def figures_of(modelled: Modelled) -> dict[str, str]:
    """Return what the line below the picture tells."""
    return {
        "nodes": f"{len(modelled.tree):,}",
        "vertices": f"{modelled.vertices:,}",
        "triangles": f"{modelled.triangles:,}",
        "milliseconds": f"{modelled.milliseconds:.0f}",
        "reason": f"{modelled.reason}: {ENDED[modelled.reason]}",
        "seed": str(modelled.options.seed),
    }


def number_of(parameter: Parameter, value: Any) -> Any:
    """Return a slider's value without the dust of its steps; None where it is none."""
    if parameter.choices:
        return value
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return round(value) if parameter.whole else round(float(value), 4)
