"""A comparison as one page of HTML: the coloured tree that can be turned, plots and tables; no network."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.accuracy.comparison import Comparison, Layer, View
from pipeline.accuracy.plots import along_path, histogram
from pipeline.accuracy.tables import tables
from pipeline.accuracy.viewer import BEYOND, RAMP, SCRIPT, UNKNOWN
from pipeline.accuracy.wood import Wood, wood_of
from pipeline.model import Skeleton, TreeModel

Floats = NDArray[np.float64]

MOST_POINTS = 60_000
"""Larger clouds are thinned to about this many points on the page."""

STYLE = """
body{font:15px/1.45 system-ui,sans-serif;color:#222;margin:0;background:#fff}
header,section{max-width:1180px;margin:0 auto;padding:0 20px}
h1{font-size:22px;margin:22px 0 4px}h2{font-size:17px;margin:28px 0 8px}
.note{background:#fff4d6;border-left:4px solid #e8b33c;padding:6px 12px;margin:8px 0}
.stage{position:relative;border:1px solid #ddd}
canvas{width:100%;height:640px;display:block;cursor:grab;touch-action:none}
canvas:focus{outline:2px solid #2a788e}
.bar{display:flex;flex-wrap:wrap;gap:8px 18px;align-items:center;padding:8px 0}
#ramp{display:inline-block;width:180px;height:12px;border:1px solid #999;vertical-align:middle}
.key{display:inline-block;width:12px;height:12px;vertical-align:middle;margin:0 4px 0 10px}
#tip{position:absolute;background:#222;color:#fff;padding:2px 7px;font-size:13px;pointer-events:none}
.plots{display:grid;grid-template-columns:repeat(auto-fit,minmax(380px,1fr));gap:14px 24px}
figure{margin:0}figcaption{font-weight:600;font-size:14px}
svg{width:100%;height:auto}svg text{font-size:12px;fill:#333}
table{border-collapse:collapse;margin:6px 0 14px}th,td{padding:3px 14px 3px 0;text-align:right}
th:first-child,td:first-child{text-align:left}thead th{border-bottom:1px solid #999;font-weight:600}
tbody tr+tr td{border-top:1px solid #eee}
.tables{display:flex;flex-wrap:wrap;gap:8px 48px;align-items:flex-start}
small{color:#666}
"""


def page(comparison: Comparison, *, a: str, b: str) -> str:
    """Return the page.

    Parameters
    ----------
    comparison : Comparison
    a, b : str
        Names of what is judged and what it is held against.
    """
    figures = (
        "<section><h2>Figures</h2>",
        f'<div class="tables">{"".join(_table(*one) for one in tables(comparison))}</div></section>',
    )
    return _whole(f"{a} against {b}", comparison.notes, comparison.view, figures)


def page_of(model: TreeModel | Skeleton, *, title: str) -> str:
    """Return a page with one tree alone, coloured by radius, its error, and the way from the root.

    Parameters
    ----------
    model : TreeModel or Skeleton
        A skeleton has no radii to colour it by.
    title : str
    """
    wood = wood_of(model)
    layers = [Layer("way from the root", 1000.0 * wood.path)]
    if isinstance(model, TreeModel):
        errors = Layer("standard error of the radius", 1000.0 * model.radius_rmse[1:])
        layers = [Layer("radius", 1000.0 * model.radius[1:]), errors, *layers]
    return _whole(title, (), View(wood, tuple(layers)), ())


def _whole(title: str, notes: Sequence[str], view: View | None, figures: Sequence[str]) -> str:
    parts = [
        "<!doctype html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>',
        '<meta name="viewport" content="width=device-width"><link rel="icon" href="data:,">',
        f"<style>{STYLE}</style></head><body>",
        f"<header><h1>{escape(title)}</h1>",
        *(f'<p class="note">{escape(note)}</p>' for note in notes),
        "</header>",
        _stage(view) if view is not None else "",
        _plots(view) if view is not None and figures else "",
        *figures,
        f"<script>{SCRIPT}</script>" if view is not None else "",
        "</body></html>",
    ]
    return "\n".join(parts) + "\n"


def _stage(view: View) -> str:
    """Return the canvas, what steers it, and the data it draws."""
    chosen = "".join(f'<option value="{k}">{escape(one.name)}</option>' for k, one in enumerate(view.layers))
    boxes = _box("other", "reference", checked=False) if view.reference is not None else ""
    boxes += _box("points", "points", checked=True) if view.points is not None else ""
    return (
        f'<section><div class="bar"><label>Colour: <select id="layer">{chosen}</select></label>'
        '<span>0 <span id="ramp"></span> <span id="end"></span>'
        f'<span class="key" style="background:{BEYOND}"></span>beyond'
        f'<span class="key" style="background:{UNKNOWN}"></span>nothing to compare</span>'
        f'<label>scale <input id="most" type="range" min="0"></label>{boxes}</div>'
        '<div class="stage"><canvas id="view" tabindex="0" aria-label="the tree, coloured by deviation">'
        '</canvas><span id="tip" hidden></span></div>'
        "<small>Drag or arrow keys turn, wheel or + and - zoom, shift and drag moves, double click resets."
        f'</small></section>\n<script id="tree" type="application/json">{_data(view)}</script>'
    )


def _box(name: str, label: str, *, checked: bool) -> str:
    return f'<label><input id="{name}" type="checkbox"{" checked" if checked else ""}> {label}</label>'


def _data(view: View) -> str:
    """Return what the script draws, around the middle of the tree."""
    low, high = view.wood.box
    middle = (low + high) / 2
    held: dict[str, Any] = {
        "size": float(max(np.linalg.norm((high - low)[:2]), high[2] - low[2], 0.1)),
        "wood": _packed(_columns(view.wood, middle)),
        "layers": [
            {"name": one.name, "most": scale_end(one.value_mm), "value": _packed(one.value_mm)}
            for one in view.layers
        ],
        "ramp": RAMP,
        "beyond": BEYOND,
        "unknown": UNKNOWN,
    }
    if view.reference is not None:
        held["reference"] = _packed(_columns(view.reference, middle))
    if view.points is not None:
        thin = slice(None, None, max(1, math.ceil(len(view.points) / MOST_POINTS)))
        off = view.point_mm if view.point_mm is not None else np.full(len(view.points), np.nan)
        held["points"] = _packed(np.column_stack([view.points - middle, off])[thin])
    return json.dumps(held).replace("<", "\\u003c")


def _columns(wood: Wood, middle: Floats) -> Floats:
    """(M, 8) ends and radii of every segment."""
    tubes = wood.tubes() or wood.bare()
    return np.column_stack([wood.start - middle, wood.end - middle, tubes.start_radius, tubes.end_radius])


def _packed(values: Floats) -> str:
    """Return float32 numbers, little-endian, in base 64."""
    return base64.b64encode(np.ascontiguousarray(values, dtype="<f4").tobytes()).decode("ascii")


def scale_end(value: Floats) -> float:
    """Return where the scale of colours ends: a round number that 98 % of the deviations stay below.

    Examples
    --------
    >>> scale_end(np.array([0.1, 0.7, 1.3]))
    1.5
    """
    known = value[np.isfinite(value)]
    most = float(np.percentile(known, 98)) if len(known) else 0.0
    if most < 1e-6:
        return 1.0
    power = 10.0 ** math.floor(math.log10(most))
    return float(next(k * power for k in (1, 1.5, 2, 3, 5, 7.5, 10) if k * power >= most))


def _plots(view: View) -> str:
    """Return the deviations by path length, and their histograms."""
    along = "".join(_figure(one.name, along_path(one.path_m, one.value_mm)) for one in view.along)
    many = "".join(_figure(name, histogram(value)) for name, value in view.histograms.items())
    if not along + many:
        return ""
    return (
        "<section><h2>Deviation by length of the way from the root</h2><p><small>Line: median. Band: 90 % "
        f'of the deviations.</small></p><div class="plots">{along}</div><h2>Deviations</h2><p><small>Line: '
        f'median. Dashes: 95 % stay below.</small></p><div class="plots">{many}</div></section>'
    )


def _figure(name: str, drawn: str) -> str:
    return f"<figure><figcaption>{escape(name)}</figcaption>{drawn}</figure>"


def _table(name: str, head: Sequence[str], rows: Mapping[str, Sequence[str]]) -> str:
    top = "".join(f"<th>{escape(cell)}</th>" for cell in (name, *head))
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in (label, *cells)) + "</tr>"
        for label, cells in rows.items()
    )
    return f"<table><thead><tr>{top}</tr></thead><tbody>{body}</tbody></table>"
