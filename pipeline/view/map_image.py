"""The map of an inventory as a picture: crowns by height, a scale bar, the reference system."""

from __future__ import annotations

import os
from importlib import import_module
from itertools import product
from typing import Any

import numpy as np

from pipeline.errors import MissingExtraError
from pipeline.model import Floats
from pipeline.output import whole_file
from pipeline.view.map_trees import RAMP, UNKNOWN, TreeMap, bar_length, length_text, scale_end

MOST_CROWNS = 60_000
"""Above, crowns are too small to see, and the highest tree of every pixel is drawn."""

FEW = 2_000
"""Up to so many crowns, white lines part those of like colour."""

INCHES, DPI = 11.0, 160
GRID_PIXELS = 1400
"""Pixels of the longer side where pixels are drawn."""

MOST_REACH = 24
"""Pixels to which a crown reaches at most."""

PAPER, INK, FAINT = "#fbfaf7", "#333333", "#d8d5cc"


def write_map_image(trees: TreeMap, path: str | os.PathLike[str], *, title: str = "") -> None:
    """Draw the map.

    Parameters
    ----------
    trees : TreeMap
    path : path-like
        A ``.png``.
    title : str

    Raises
    ------
    OutputError
        If the file cannot be written.
    MissingExtraError
        If matplotlib is not installed.
    """
    west, south, east, north = trees.window
    margin = 0.02 * max(east - west, north - south, 1.0)
    shape = np.clip((north - south + 2 * margin) / (east - west + 2 * margin), 0.4, 1.6)
    figure = _package("matplotlib.figure").Figure(figsize=(INCHES, INCHES * shape * 0.86 + 0.9), dpi=DPI)
    figure.set_facecolor("white")
    axes = figure.add_axes((0.075, 0.08, 0.8, 0.85))
    axes.set_facecolor(PAPER)
    axes.set_aspect("equal")
    axes.set_xlim(west - margin, east + margin)
    axes.set_ylim(south - margin, north + margin)
    _frames(axes, trees)
    first = next(iter(trees.figures.values()))
    drawn = (
        _crowns(axes, trees, first.values)
        if len(trees) <= MOST_CROWNS
        else _pixels(axes, trees, first.values)
    )
    bar = figure.colorbar(drawn, ax=axes, fraction=0.032, pad=0.02)
    bar.set_label(f"{first.label} ({first.unit})" if first.unit else first.label)
    _labels(axes, trees, title)
    with whole_file(path) as temporary:
        figure.savefig(
            temporary, format="png", bbox_inches="tight", pad_inches=0.15, metadata={"Software": "treepipe"}
        )


def _crowns(axes: Any, trees: TreeMap, values: Floats) -> Any:
    """Draw every crown, the highest last; a tree without one is a dot."""
    order = np.argsort(np.where(np.isfinite(values), values, -np.inf), kind="stable")
    ends = trees.ring_ends
    with_crown = order[np.diff(ends)[order] >= 3]
    rings = [trees.rings[ends[k] : ends[k + 1]] for k in with_crown.tolist()]
    ramp, norm = _ramp(), _package("matplotlib.colors").Normalize(0, scale_end(values))
    collections = _package("matplotlib.collections")
    drawn = collections.PolyCollection(
        rings, array=np.ma.masked_invalid(values[with_crown]), cmap=ramp, norm=norm,
        linewidths=0.6 if len(rings) < FEW else 0.15,
        edgecolors=(1, 1, 1, 0.8) if len(rings) < FEW else (0.1, 0.1, 0.1, 0.35),
    )  # fmt: skip
    axes.add_collection(drawn, autolim=False)
    bare = order[np.diff(ends)[order] < 3]
    if len(bare):
        axes.scatter(*trees.xy[bare].T, c=np.ma.masked_invalid(values[bare]), cmap=ramp, norm=norm, s=3)
    return drawn


def _pixels(axes: Any, trees: TreeMap, values: Floats) -> Any:
    """Draw every tree as a disc of its crown's size, the highest of every pixel."""
    west, south, east, north = trees.window
    side = max(east - west, north - south) / GRID_PIXELS
    column, row = np.floor((trees.xy - [west, south]) / side).astype(np.int64).T
    held = np.full((int(row.max()) + 1, int(column.max()) + 1), -np.inf)
    wide = trees.figures.get("crown_diam_m")
    reach = np.zeros(len(trees)) if wide is None else np.nan_to_num(wide.values) / 2 / side
    most = int(min(reach.max(), MOST_REACH))
    for up, right in product(range(-most, most + 1), repeat=2):
        far = (reach >= np.hypot(up, right)) & np.isfinite(values)
        far &= (row + up >= 0) & (row + up < held.shape[0])
        far &= (column + right >= 0) & (column + right < held.shape[1])
        np.maximum.at(held, (row[far] + up, column[far] + right), values[far])
    extent = (west, west + held.shape[1] * side, south, south + held.shape[0] * side)
    norm, ramp = _package("matplotlib.colors").Normalize(0, scale_end(values)), _ramp()
    known = np.ma.masked_invalid(held)
    return axes.imshow(
        known, origin="lower", extent=extent, cmap=ramp.with_extremes(bad="none"), norm=norm,
        interpolation="nearest",
    )  # fmt: skip


def _frames(axes: Any, trees: TreeMap) -> None:
    """Draw the outlines of the cells."""
    boxes = [[(w, s), (e, s), (e, n), (w, n)] for w, s, e, n in trees.frames]
    poly = _package("matplotlib.collections").PolyCollection
    axes.add_collection(poly(boxes, facecolors="none", edgecolors=FAINT, linewidths=0.6), autolim=False)


def _labels(axes: Any, trees: TreeMap, title: str) -> None:
    """Write title, note, reference system, source and scale bar."""
    low, high = axes.get_xlim()
    length = bar_length(high - low)
    axes.ticklabel_format(style="plain", useOffset=False)
    axes.tick_params(labelsize=7, colors=INK)
    axes.locator_params(nbins=6)
    axes.set_title(_plain(title or "Trees"), loc="left", fontsize=13, color=INK)
    axes.set_title(_plain(trees.note), loc="right", fontsize=9, color=INK)
    name = trees.crs or "unknown reference system"
    about = f"x (m), {name[:80]}" + (f"\n{trees.source[:110]}" if trees.source else "")
    axes.set_xlabel(_plain(about), fontsize=8, color=INK, loc="left", multialignment="left")
    axes.set_ylabel("y (m)", fontsize=8, color=INK)
    _scale(axes, low + 0.97 * (high - low) - length, length)


def _scale(axes: Any, x: float, length: float) -> None:
    """Draw scale bar and north arrow below the map, where they cover no crown."""
    across = axes.get_xaxis_transform()  # x in metres, y in heights of the map
    inches = axes.get_position().height * axes.figure.get_size_inches()[1]
    y = -0.48 / inches
    axes.plot([x, x + length], [y, y], color=INK, linewidth=2.4, solid_capstyle="butt", transform=across,
              clip_on=False)  # fmt: skip
    axes.annotate(length_text(length), (x + length / 2, y), xycoords=across, xytext=(0, -3),
                  textcoords="offset points", ha="center", va="top", fontsize=9, color=INK)  # fmt: skip
    axes.annotate("N", (x + length, y), xycoords=across, xytext=(20, -16), textcoords="offset points",
                  ha="center", va="bottom", fontsize=10, color=INK)  # fmt: skip
    axes.annotate("\u25b2", (x + length, y), xycoords=across, xytext=(20, -4), textcoords="offset points",
                  ha="center", va="bottom", fontsize=10, color=INK)  # fmt: skip


def _ramp() -> Any:
    ramp = _package("matplotlib.colors").LinearSegmentedColormap.from_list("heights", RAMP)
    return ramp.with_extremes(bad=UNKNOWN)


def _plain(text: str) -> str:
    """Return a text in which nothing is read as a formula."""
    return text.replace("$", r"\$")


def _package(name: str) -> Any:
    try:
        return import_module(name)
    except ImportError as error:
        msg = "drawing the map needs matplotlib; install it with `pip install 'treepipe[batch]'`"
        raise MissingExtraError(msg) from error
