"""Colours of wood and points, and the legend that says what they mean."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.accuracy.viewer import BEYOND, UNKNOWN
from pipeline.accuracy.viewer import RAMP as DEVIATION
from pipeline.model import RADIUS_SOURCES, Floats, Skeleton, TreeModel
from pipeline.report import ground_height
from pipeline.studio.scan.making import Result
from pipeline.view.picture import ORDER_COLOURS, ORDERS

Colours = NDArray[np.uint8]
Mode = Literal["height", "order", "source", "distance"]

MODES: Mapping[Mode, str] = {
    "height": "Height above the ground",
    "order": "Branch order",
    "source": "Where radii come from",
    "distance": "Distance between model and points",
}

HEIGHT = ("#3b2f7f", "#31688e", "#21918c", "#5cc863", "#f5d73b")
"""From the ground to the top; told apart with any colour vision (after viridis)."""

SOURCES = ("#2a788e", "#e8b33c", "#b5172d")
"""Measured, propagated, allometric."""

SOURCE_WORDS = ("measured on points", "propagated along the branch", "allometric, from a rule")
PLAIN = "#8a929b"
LEAF, REST = "#5d9440", "#c9a27a"
PAIR = ("#d55e00", "#0072b2")
"""The two models of a comparison; told apart with any colour vision (after Okabe and Ito, 2008)."""

ROUND = (1.0, 2.0, 5.0)
TICKS = 5


class Bar(NamedTuple):
    """A ramp of colours for values.

    Attributes
    ----------
    low, high : float
    unit : str
    colours : tuple of str
        Evenly from low to high.
    """

    low: float
    high: float
    unit: str
    colours: tuple[str, ...]

    def ticks(self) -> list[str]:
        """Return values at even steps, as texts."""
        values = np.linspace(self.low, self.high, TICKS)
        digits = max(0, 1 - math.floor(math.log10(max(self.high - self.low, 1e-9) / (TICKS - 1))))
        return [f"{value:.{min(digits, 3)}f}" for value in values]


class Legend(NamedTuple):
    """What colours mean.

    Attributes
    ----------
    title : str
    bar : Bar or None
    classes : tuple of (str, str)
        Colours with what they stand for.
    """

    title: str
    bar: Bar | None = None
    classes: tuple[tuple[str, str], ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain values for the page."""
        made: dict[str, Any] = {"title": self.title, "classes": [list(each) for each in self.classes]}
        if self.bar is not None:
            made |= {
                "ramp": f"linear-gradient(to right, {', '.join(self.bar.colours)})",
                "ticks": self.bar.ticks(),
                "unit": self.bar.unit,
            }
        return made


class Painted(NamedTuple):
    """Colours of a result.

    Attributes
    ----------
    segments : (N - 1, 3) array of uint8
        Of the segment to every node but the root.
    points : (P, 3) array of uint8
        Of every point that was used.
    legend : Legend
    """

    segments: Colours
    points: Colours
    legend: Legend


def modes_of(result: Result) -> list[Mode]:
    """Return the colourings that a result has."""
    thick = isinstance(result.tree, TreeModel)
    has: Mapping[Mode, bool] = {"source": thick, "distance": thick and result.off is not None}
    return [mode for mode in MODES if has.get(mode, True)]


def painted(result: Result, mode: Mode) -> Painted:
    """Colour a result; a colouring that it has not is that by height."""
    paint = {"order": _by_order, "source": _by_source, "distance": _by_distance}.get(mode, _by_height)
    return (paint if mode in modes_of(result) else _by_height)(result)


def along(ramp: Sequence[str], share: Floats) -> Colours:
    """Return the colours at shares of a ramp, from 0 to 1.

    Examples
    --------
    >>> along(("#000000", "#ff0000"), np.array([0.0, 1.0])).tolist()
    [[0, 0, 0], [255, 0, 0]]
    """
    stops = np.array([rgb(colour) for colour in ramp], dtype=np.float64)
    at = np.linspace(0, 1, len(stops))
    held = np.clip(share, 0, 1)
    return np.column_stack([np.interp(held, at, stops[:, k]) for k in range(3)]).round().astype(np.uint8)


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue of ``#rrggbb``."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def plain(count: int, colour: str = PLAIN) -> Colours:
    """Return one colour so many times."""
    return np.full((count, 3), rgb(colour), dtype=np.uint8)


def graph_of(tree: TreeModel | Skeleton) -> Skeleton:
    """Return the axes of a model."""
    return tree.skeleton if isinstance(tree, TreeModel) else tree


def _by_height(result: Result) -> Painted:
    graph = graph_of(result.tree)
    if isinstance(result.tree, TreeModel):
        ground = ground_height(result.tree) + float(graph.origin[2])
    else:
        ground = float(graph.world[:, 2].min())
    middle = (graph.world[1:, 2] + graph.world[graph.parent[1:], 2]) / 2 - ground
    points = np.zeros(0) if result.used is None else result.used.world[:, 2] - ground
    top = max(float(graph.world[:, 2].max()) - ground, float(points.max(initial=0.0)), 0.1)
    legend = Legend("Height above the ground", Bar(0.0, top, "m", HEIGHT))
    return Painted(along(HEIGHT, middle / top), along(HEIGHT, points / top), legend)


def _by_order(result: Result) -> Painted:
    order = np.minimum(graph_of(result.tree).order[1:], len(ORDER_COLOURS) - 1)
    named = zip(ORDER_COLOURS, ORDERS, strict=True)
    classes = tuple(each for k, each in enumerate(named) if (order == k).any())
    return _in_classes(result, order, ORDER_COLOURS, Legend("Branch order", classes=classes))


def _by_source(result: Result) -> Painted:
    if not isinstance(result.tree, TreeModel):
        return _by_height(result)
    source, length = result.tree.radius_source[1:].astype(np.int64), result.tree.skeleton.length[1:]
    share = np.bincount(source, length, minlength=len(RADIUS_SOURCES)) / max(float(length.sum()), 1e-9)
    classes = tuple(
        (colour, f"{words}: {100 * part:.0f} % of the length")
        for colour, words, part in zip(SOURCES, SOURCE_WORDS, share.tolist(), strict=True)
    )
    return _in_classes(result, source, SOURCES, Legend("Where radii come from", classes=classes))


def _by_distance(result: Result) -> Painted:
    """Colour wood by the mean distance of its points, points by their own; grey is wood without points."""
    view = None if result.off is None else result.off.view
    if view is None or view.point_mm is None or result.used is None or not view.layers:
        return _by_height(result)
    wood, points = view.layers[0].value_mm, _in_order(result, view.point_mm)
    end = rounded_up(float(np.percentile(view.point_mm, 95)))
    title = "Distance of the points from the bark: of each point, and the mean along the wood"
    classes = ((BEYOND, f"more than {end:g} mm"), (UNKNOWN, "wood without points"))
    legend = Legend(title, Bar(0.0, end, "mm", DEVIATION), classes)
    return Painted(_deviating(wood, end), _deviating(points, end), legend)


def rounded_up(value: float) -> float:
    """Return the next value of 1, 2, 5, 10, 20, ...

    Examples
    --------
    >>> rounded_up(13.0), rounded_up(5.0), rounded_up(0.0)
    (20.0, 5.0, 1.0)
    """
    if value <= 0:
        return 1.0
    decade = 10.0 ** math.floor(math.log10(value))
    return next((step * decade for step in ROUND if step * decade >= value * (1 - 1e-9)), 10.0 * decade)


def _deviating(value: Floats, end: float) -> Colours:
    known = np.nan_to_num(value, nan=0.0)
    made = along(DEVIATION, known / end)
    made[known > end] = rgb(BEYOND)
    made[np.isnan(value)] = rgb(UNKNOWN)
    return made


def _in_order(result: Result, sorted_mm: Floats) -> Floats:
    """Return distances in the order of the points that were used; `compare_cloud` sorts them."""
    if result.used is None:
        return sorted_mm
    made = np.empty(len(result.used))
    made[np.lexsort(result.used.world.T)] = sorted_mm
    return made


def _in_classes(result: Result, number: NDArray[Any], colours: Sequence[str], legend: Legend) -> Painted:
    """Colour wood by classes, and every point like the wood nearest to it."""
    segments = np.array([rgb(colour) for colour in colours], dtype=np.uint8)[number]
    count = 0 if result.used is None else len(result.used)
    points = plain(count) if result.near is None else segments[result.near]
    return Painted(segments, points, legend)
