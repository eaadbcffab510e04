"""The twenty parameters a person moves: ranges and sentences come from the options themselves."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple, get_args, get_origin

import annotated_types

from pipeline.choosing import chosen
from pipeline.synthetic.colonization import ColonizationOptions
from pipeline.synthetic.colonization.options import AppearanceOptions, GrowthOptions
from pipeline.toml import allowed

Class = Literal["growth", "geometry", "appearance"]
Part = Literal["growth", "shape", "bark", "leaves", "appearance"]

LABELS: Mapping[str, Mapping[str, str]] = {
    "Tree": {
        "iterations": "Age (iterations)",
        "gnarliness": "Gnarliness",
        "density_begin": "Branch density, begin",
        "density_end": "Branch density, end",
    },
    "Crown": {
        "crown_width_m": "Crown half width",
        "crown_height_m": "Crown half height",
        "crown_depth_m": "Crown half depth",
        "cutoff_top": "Cut off at the top",
        "cutoff_bottom": "Cut off at the bottom",
    },
    "Stem": {
        "stem_length_m": "Stem length",
        "stem_thickness": "Stem thickness",
        "crown_stem_ratio": "Stem within the crown",
        "stem_colour": "Bark colour",
        "ring_sides": "Sides of the bark",
    },
    "Hanging": {"pendulous": "How much branches hang", "pendulous_start": "From which order"},
    "Leaves": {
        "leaves_per_node": "Leaves per node",
        "leaf_size_m": "Leaf size",
        "leaf_type": "Leaf shape",
        "leaf_colour": "Leaf colour",
    },
}
"""The parameters as the page shows them, by group."""

CROWN = frozenset({*LABELS["Crown"], "stem_length_m"})
"""Those that shape or move the crown: while they move, its points are shown."""

RESHAPES = "leaf_type"
"""Stands among the appearance, but another shape has other triangles."""


class Parameter(NamedTuple):
    """One parameter on the page.

    Attributes
    ----------
    name, label, group : str
    kind : {"growth", "geometry", "appearance"}
        Whether another value grows anew, draws anew, or colours anew.
    sentence : str
        What it is, with its range.
    low, high, step : float
        Range and step of a slider; 0 for a choice.
    unit : str
        ``"m"`` or nothing.
    whole : bool
        Whether it is a whole number.
    choices : tuple of str
        The values of a choice; empty for a slider.
    """

    name: str
    label: str
    group: str
    kind: Class
    sentence: str
    low: float = 0.0
    high: float = 0.0
    step: float = 0.0
    unit: str = ""
    whole: bool = False
    choices: tuple[str, ...] = ()


def class_of(name: str) -> Class:
    """Return what another value of a parameter asks for."""
    if name in GrowthOptions.model_fields:
        return "growth"
    return "appearance" if name in AppearanceOptions.model_fields and name != RESHAPES else "geometry"


def part_of(name: str) -> Part:
    """Return what a parameter makes; within the geometry, leaves need no other bark."""
    kind = class_of(name)
    if kind != "geometry":
        return kind
    return "leaves" if name.startswith(("leaf_", "leaves_")) else "bark" if name == "ring_sides" else "shape"


def values_of(options: ColonizationOptions, *parts: Part) -> tuple[Any, ...]:
    """Return the values of all parameters that make some parts, as the key of these."""
    return tuple(value for name, value in options if part_of(name) in parts)


def _parameter(name: str, label: str, group: str) -> Parameter:
    field = ColonizationOptions.model_fields[name]
    made = Parameter(name, label, group, class_of(name), f"{field.description}; {allowed(field)}")
    if get_origin(field.annotation) is Literal:
        return made._replace(choices=get_args(field.annotation))
    bounds = {type(bound): bound for bound in field.metadata}
    low, high = float(bounds[annotated_types.Ge].ge), float(bounds[annotated_types.Le].le)
    whole = field.annotation is int
    step = 1.0 if whole else 0.01 if high - low <= 1 else 0.05 if high - low < 5 else 0.1
    unit = "m" if name.endswith("_m") else ""
    return made._replace(low=low, high=high, step=step, unit=unit, whole=whole)


PARAMETERS: tuple[Parameter, ...] = tuple(
    _parameter(name, label, group) for group, labels in LABELS.items() for name, label in labels.items()
)
"""All of them, in the order of the page."""


def options_of(values: Mapping[str, Any]) -> ColonizationOptions:
    """Make options of values.

    Raises
    ------
    UsageError
        If a key is unknown or a value out of range, with what would be right.
    """
    return chosen(ColonizationOptions, values)


def changed(options: ColonizationOptions, **values: Any) -> ColonizationOptions:
    """Return options with other values.

    Raises
    ------
    UsageError
        As `options_of`.
    """
    return options_of({**options.model_dump(), **values})
