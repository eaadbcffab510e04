"""The map of an inventory as one page of HTML that can be moved and asked; no network."""

from __future__ import annotations

import base64
import json
from html import escape
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.model import Floats
from pipeline.view.map_script import SCRIPT
from pipeline.view.map_trees import RAMP, UNKNOWN, Figure, Text, TreeMap, scale_end

MOST_TREES = 50_000
"""More are not drawn on the page: choose evenly, as `pipeline.batch.merging.maps` does."""

STEP_M = 0.05
"""Crowns are drawn to this step around their tree."""

STYLE = """
*{box-sizing:border-box}
html,body{height:100%;margin:0}
body{font:14px/1.4 system-ui,sans-serif;color:#222;display:flex;flex-direction:column;background:#fff}
header{display:flex;flex-wrap:wrap;gap:4px 18px;align-items:baseline;padding:8px 14px;
border-bottom:1px solid #ddd}
h1{font-size:17px;margin:0}header small{color:#555}
.bar{display:flex;flex-wrap:wrap;gap:6px 16px;align-items:center;margin-left:auto}
#ramp{display:inline-block;width:150px;height:12px;border:1px solid #999;vertical-align:middle}
.key{display:inline-block;width:12px;height:12px;vertical-align:middle;margin-right:4px}
select,input{font:inherit}input{width:15em}
main{flex:1;position:relative;min-height:260px}
canvas{position:absolute;inset:0;width:100%;height:100%;cursor:grab;touch-action:none;background:#fbfaf7}
canvas:focus-visible{outline:2px solid #155f7a;outline-offset:-2px}
#card{position:absolute;top:12px;right:12px;max-width:min(340px,90%);
max-height:calc(100% - 24px);
overflow:auto;background:#fff;
border:1px solid #bbb;border-radius:4px;box-shadow:0 1px 6px #0003;padding:10px 14px}
#card h2{font-size:14px;margin:0 24px 6px 0;overflow-wrap:anywhere}
#card button{position:absolute;top:6px;right:8px;border:0;background:none;font-size:18px;cursor:pointer}
table{border-collapse:collapse;width:100%}td{padding:2px 0;vertical-align:top;overflow-wrap:anywhere}
td:first-child{color:#555;padding-right:14px}td:last-child{text-align:right}
tr+tr td{border-top:1px solid #eee}
footer{padding:4px 14px;border-top:1px solid #ddd;color:#555;display:flex;flex-wrap:wrap;gap:2px 18px;
font-size:12.5px}
#at{margin-left:auto;font-variant-numeric:tabular-nums}
[hidden]{display:none!important}
"""


def map_page(trees: TreeMap, *, title: str = "Trees") -> str:
    """Return the page.

    Parameters
    ----------
    trees : TreeMap
        At most `MOST_TREES` of them are quick to move.
    title : str
    """
    layers = "".join(
        f'<option value="{k}">{escape(one.label)}</option>' for k, one in enumerate(trees.figures.values())
    )
    crs = trees.crs or "unknown reference system"
    parts = [
        "<!doctype html>",
        f'<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>',
        '<meta name="viewport" content="width=device-width"><link rel="icon" href="data:,">',
        f"<style>{STYLE}</style></head><body>",
        f"<header><h1>{escape(title)}</h1><small>{escape(trees.note)}</small>",
        f'<div class="bar"><label>Colour <select id="layer">{layers}</select></label>',
        '<span><span id="low">0</span> <span id="ramp"></span> <span id="end"></span></span>',
        f'<span id="none"><span class="key" style="background:{UNKNOWN}"></span>unknown</span>',
        '<label>Find <input id="find" placeholder="tree_id, then Enter" autocomplete="off"></label>',
        "</div></header>",
        '<main><canvas id="map" tabindex="0" aria-label="map of the trees, seen from above"></canvas>',
        '<aside id="card" hidden><button id="close" aria-label="close">&times;</button>',
        '<h2 id="name"></h2><table><tbody id="facts"></tbody></table></aside></main>',
        "<footer><span>Drag or arrow keys move, wheel or + and - zoom, a click tells of a tree, Home shows "
        f"all.</span><span>{escape(crs)}</span><span>{escape(trees.source)}</span>"
        '<span id="at"></span></footer>',
        f'<script id="trees" type="application/json">{_data(trees)}</script>',
        f"<script>{SCRIPT}</script>",
        "</body></html>",
    ]
    return "\n".join(parts) + "\n"


def _data(trees: TreeMap) -> str:
    """Return what the script draws, around the middle of the map."""
    west, south, east, north = trees.window
    middle = np.round([(west + east) / 2, (south + north) / 2])
    counts = np.diff(trees.ring_ends)
    around = trees.rings - np.repeat(trees.xy, counts, axis=0)
    steps = np.clip(np.round(around / STEP_M), -32767, 32767)
    held: dict[str, Any] = {
        "middle": middle.tolist(),
        "window": (np.array([west, south, east, north]) - np.tile(middle, 2)).tolist(),
        "frames": [(np.array(frame) - np.tile(middle, 2)).tolist() for frame in trees.frames],
        "names": list(trees.names),
        "xy": _packed(trees.xy - middle, "<f4"),
        "counts": _packed(counts, "<u2"),
        "rings": _packed(steps, "<i2"),
        "step": STEP_M,
        "figures": [_figure(one) for one in trees.figures.values()],
        "texts": [_text(one) for one in trees.texts.values()],
        "ramp": RAMP,
        "unknown": UNKNOWN,
    }
    return json.dumps(held, ensure_ascii=False, allow_nan=False).replace("<", "\\u003c")


def _figure(one: Figure) -> dict[str, Any]:
    values = np.asarray(one.values, dtype=np.float64)
    return {"label": one.label, "unit": one.unit, "end": scale_end(values), "values": _packed(values, "<f4")}


def _text(one: Text) -> dict[str, Any]:
    """Return a text of every tree as numbers of its different values."""
    different = sorted(set(one.values))
    number = {value: k for k, value in enumerate(different)}
    codes = np.array([number[value] for value in one.values], dtype=np.int64)
    return {"label": one.label, "different": different, "codes": _packed(codes, "<u4")}


def _packed(values: Floats | NDArray[np.int64], kind: str) -> str:
    """Return numbers, little-endian, in base 64."""
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")
