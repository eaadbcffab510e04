"""Histograms and scatters as SVG, by hand: a page needs no plotting library."""

from __future__ import annotations

import math
from html import escape

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

WIDTH, HEIGHT = 520, 250
LEFT, RIGHT, TOP, BOTTOM = 58, 14, 12, 44
BINS, STEPS = 40, 24
MOST_DOTS = 2500
LEAST = 3
"""A step along the way with fewer deviations has no median."""
SHOWN_PCT = 99.5
"""Plots end here; how much lies beyond is said in words."""

NONE = "<p>none</p>"
SHADE, DOT, LINE, INK = "#9cc3cf", "#2a788e", "#b5172d", "#333"


def histogram(value: Floats) -> str:
    """Return a histogram of deviations.

    Parameters
    ----------
    value : (K,) array
        Millimetres; those that are not finite are left out.
    """
    value = value[np.isfinite(value)]
    if not len(value):
        return NONE
    most = _most(value)
    count, edge = np.histogram(value[value <= most], bins=BINS, range=(0.0, most))
    frame = _Frame(most, float(count.max()))
    bars = [
        f'<rect x="{frame.x(a):.1f}" y="{frame.y(n):.1f}" width="{frame.x(b) - frame.x(a) - 0.6:.1f}" '
        f'height="{frame.y(0) - frame.y(n):.1f}" fill="{DOT}"/>'
        for n, a, b in zip(count.tolist(), edge[:-1].tolist(), edge[1:].tolist(), strict=True)
    ]
    marks = [
        f'<line x1="{frame.x(at):.1f}" x2="{frame.x(at):.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}" '
        f'stroke="{LINE}" stroke-dasharray="{dash}"/>'
        for at, dash in ((float(np.median(value)), "none"), (float(np.percentile(value, 95)), "4 3"))
        if at <= most
    ]
    beyond = 100 * float((value > most).mean())
    said = "deviation, mm" + (f" ({beyond:.1f} % beyond)" if beyond > 0 else "")
    return frame.drawn([*bars, *marks], said, "number")


def along_path(path: Floats, value: Floats) -> str:
    """Return deviations by the length of the way from the root: dots, their median, and where 90 % lie.

    Parameters
    ----------
    path : (K,) array
        Metres.
    value : (K,) array
        Millimetres.
    """
    held = np.isfinite(value) & np.isfinite(path)
    path, value = path[held], value[held]
    if not len(value):
        return NONE
    most = _most(value)
    frame = _Frame(max(float(path.max()), 1e-6), most)
    upward = np.argsort(path, kind="stable")
    dots = upward[:: max(1, len(upward) // MOST_DOTS)]
    drawn = [
        f'<circle cx="{frame.x(x):.1f}" cy="{frame.y(y):.1f}" r="1.1"/>'
        for x, y in zip(path[dots].tolist(), value[dots].tolist(), strict=True)
        if y <= most
    ]
    bounds = np.searchsorted(path[upward], np.linspace(0, float(path.max()), STEPS + 1)[1:-1])
    runs = [run for run in np.split(upward, bounds) if len(run) >= LEAST]
    middle = [float(np.median(path[run])) for run in runs]
    low, half, high = np.array([np.percentile(value[run], (5, 50, 95)) for run in runs]).reshape(-1, 3).T
    band = [frame.point(x, y) for x, y in zip(middle, high, strict=True)]
    band += [frame.point(x, y) for x, y in zip(middle[::-1], low[::-1], strict=True)]
    line = [frame.point(x, y) for x, y in zip(middle, half, strict=True)]
    parts = [
        f'<polygon points="{" ".join(band)}" fill="{SHADE}" opacity="0.55"/>',
        f'<g fill="{DOT}" opacity="0.45">{"".join(drawn)}</g>',
        f'<polyline points="{" ".join(line)}" fill="none" stroke="{LINE}" stroke-width="2"/>',
    ]
    return frame.drawn(parts, "length of the way from the root, m", "deviation, mm")


class _Frame:
    """Axes from zero to the most of both figures."""

    def __init__(self, most_x: float, most_y: float) -> None:
        self.most_x, self.most_y = most_x, max(most_y, 1e-9)

    def x(self, value: float) -> float:
        return LEFT + (WIDTH - LEFT - RIGHT) * value / self.most_x

    def y(self, value: float) -> float:
        share = min(max(value / self.most_y, 0.0), 1.0)
        return HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * share

    def point(self, x: float, y: float) -> str:
        return f"{self.x(x):.1f},{self.y(float(y)):.1f}"

    def drawn(self, parts: list[str], across: str, upward: str) -> str:
        foot = HEIGHT - BOTTOM
        grid = [
            f'<line x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{self.y(t):.1f}" y2="{self.y(t):.1f}" '
            f'stroke="#e4e4e4"/><text x="{LEFT - 6}" y="{self.y(t) + 4:.1f}" text-anchor="end">{t:g}</text>'
            for t in ticks(self.most_y)
        ]
        below = [
            f'<line x1="{self.x(t):.1f}" x2="{self.x(t):.1f}" y1="{foot}" y2="{foot + 4}" stroke="{INK}"/>'
            f'<text x="{self.x(t):.1f}" y="{foot + 17}" text-anchor="middle">{t:g}</text>'
            for t in ticks(self.most_x)
        ]
        axis = f'<path d="M{LEFT} {TOP}V{foot}H{WIDTH - RIGHT}" fill="none" stroke="{INK}"/>'
        names = (
            f'<text x="{(LEFT + WIDTH - RIGHT) / 2}" y="{HEIGHT - 8}" text-anchor="middle">'
            f"{escape(across)}</text>"
            f'<text transform="translate(13 {(TOP + foot) / 2}) rotate(-90)" text-anchor="middle">'
            f"{escape(upward)}</text>"
        )
        label = escape(f"{upward} by {across}", quote=True)
        return (
            f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{label}">'
            + "".join([*grid, *parts, axis, *below, names])
            + "</svg>"
        )


def ticks(most: float) -> list[float]:
    """Return round numbers from zero to `most`, five or so.

    Examples
    --------
    >>> ticks(12.0)
    [0.0, 2.0, 4.0, 6.0, 8.0, 10.0, 12.0]
    """
    raw = most / 5
    power = 10.0 ** math.floor(math.log10(raw))
    step = next(k * power for k in (1, 2, 5, 10) if k * power >= raw * 0.7)
    return [float(f"{k * step:.6g}") for k in range(int(most / step + 1e-9) + 1)]


def _most(value: Floats) -> float:
    """Return where a plot of deviations ends."""
    return max(float(np.percentile(value, SHOWN_PCT)) * 1.05, 1e-3)
