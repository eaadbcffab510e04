"""What a comparison says, as keys of ``treepipe compare --json``, and what a page draws of it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.accuracy.amounts import Amounts
from pipeline.accuracy.clouds import Unexplained, Unsupported
from pipeline.accuracy.nodes import MatchedBy
from pipeline.accuracy.spread import Spread
from pipeline.accuracy.topology import Branches
from pipeline.accuracy.wood import Wood

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Layer:
    """One colouring of a tree: a deviation for every segment.

    Parameters
    ----------
    name : str
        What deviates from what.
    value_mm : (M,) array
        NaN where there is none.
    """

    name: str
    value_mm: Floats


@dataclass(frozen=True, eq=False)
class Along:
    """Deviations by the length of the way from the root.

    Parameters
    ----------
    name : str
    path_m, value_mm : (K,) arrays
    """

    name: str
    path_m: Floats
    value_mm: Floats


@dataclass(frozen=True, eq=False)
class View:
    """What can be drawn of a comparison.

    Parameters
    ----------
    wood : Wood
        The tree that is judged.
    layers : tuple of Layer
        Its colourings.
    reference : Wood or None
        The tree that it is held against.
    points, point_mm : (P, 3) and (P,) arrays, or None
        The points that it is held against, and how far they lie from the bark.
    histograms : mapping of str to (K,) array
        Deviations in millimetres.
    along : tuple of Along
    """

    wood: Wood
    layers: tuple[Layer, ...] = ()
    reference: Wood | None = None
    points: Floats | None = None
    point_mm: Floats | None = None
    histograms: Mapping[str, Floats] = field(default_factory=dict)
    along: tuple[Along, ...] = ()


@dataclass(frozen=True, eq=False)
class Comparison:
    """How far A is from B: the attributes but `view` are the keys of the JSON, in its order.

    A is the tree that is judged, B the reference: another model, the truth, or the points. None stands
    where a figure does not apply or is not known. docs/comparing.md tells what each means.
    """

    nodes: Spread | None = None
    matched_by: MatchedBy | None = None
    axis: Spread | None = None
    surface: Spread | None = None
    surface_back: Spread | None = None
    recall: float | None = None
    precision: float | None = None
    recall_by_order: tuple[float | None, ...] | None = None
    order_accuracy: float | None = None
    order_confusion_m: tuple[tuple[float, ...], ...] | None = None
    branches: Branches | None = None
    branches_ratio: float | None = None
    same_branching: bool | None = None
    radius_error_mm: float | None = None
    volume_error_pct: float | None = None
    stem_volume_error_pct: float | None = None
    branch_volume_error_pct: float | None = None
    length_error_pct: float | None = None
    dbh_error_pct: float | None = None
    height_error_m: float | None = None
    amounts: Mapping[str, Amounts] | None = None
    paths: Mapping[str, Mapping[str, float]] | None = None
    coverage: float | None = None
    unexplained: Unexplained | None = None
    unsupported: Unsupported | None = None
    surface_floor_mm: float | None = None
    bytes: Mapping[str, int | None] | None = None
    shift_m: float | None = None
    shift_xyz_m: tuple[float, float, float] | None = None
    notes: tuple[str, ...] = ()
    view: View | None = field(default=None, repr=False)

    def joined(self, other: Comparison) -> Comparison:
        """Fill what this one does not know from another of the same tree."""
        known = {
            one.name: getattr(other, one.name)
            for one in fields(self)
            if getattr(self, one.name) is None and one.name != "view"
        }
        for key in ("amounts", "paths"):
            known[key] = {**(getattr(other, key) or {}), **(getattr(self, key) or {})} or None
        notes = tuple(dict.fromkeys((*self.notes, *other.notes)))
        return replace(self, **known, notes=notes, view=_joined_views(self.view, other.view))

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON; None for whatever is not finite."""
        held = asdict(replace(self, view=None))
        del held["view"]
        plain: dict[str, Any] = _plain(held)
        return plain

    def to_json(self) -> str:
        """Return the text that ``treepipe compare --json`` prints."""
        return json.dumps(self.to_dict(), indent=2, ensure_ascii=False, allow_nan=False)


def _joined_views(mine: View | None, other: View | None) -> View | None:
    if mine is None or other is None:
        return mine or other
    return replace(
        mine,
        layers=mine.layers + other.layers,
        reference=mine.reference or other.reference,
        histograms={**mine.histograms, **other.histograms},
        along=mine.along + other.along,
    )


def _plain(value: Any) -> Any:
    """Make a value fit for JSON."""
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(inner) for inner in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
