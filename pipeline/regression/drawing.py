"""A tree then and now, as SVG: what the eye needs to see where they part."""

from __future__ import annotations

import numpy as np

from pipeline.model import Floats, Skeleton
from pipeline.regression.check import moved_m

HEIGHT_PX = 420
GAP_PX = 30
MOST_MM = 50.0
"""Distance from which on a segment is drawn in the last colour."""
RAMP = ("#2b7a3f", "#9aa83a", "#e0a030", "#d05020", "#b00030")


def drawn(then: Skeleton, now: Skeleton) -> str:
    """Draw both from the south and from the east: then in grey, now coloured by how far it has moved.

    Parameters
    ----------
    then, now : Skeleton

    Returns
    -------
    str
        An ``<svg>`` element.
    """
    before, after = then.xyz, now.xyz + (now.origin - then.origin)
    both = np.vstack([before, after])
    low, size = both.min(axis=0), np.maximum(np.ptp(both, axis=0), 1e-6)
    scale = HEIGHT_PX / size[2]
    moved = 1000.0 * moved_m(then, now)[-len(now) :]
    shade = np.minimum(moved / MOST_MM * len(RAMP), len(RAMP) - 1).astype(int)
    wide = [scale * size[axis] for axis in (0, 1)]
    lines = []
    for left, axis in ((0.0, 0), (wide[0] + GAP_PX, 1)):
        flat = [_flat(nodes - low, axis, scale, left) for nodes in (before, after)]
        lines += _segments(flat[0], then, ["#bbb"] * len(then), 3)
        lines += _segments(flat[1], now, [RAMP[k] for k in shade.tolist()], 1.2)
    box = f"0 0 {sum(wide) + GAP_PX:.0f} {HEIGHT_PX}"
    return (
        f'<svg viewBox="{box}" height="{HEIGHT_PX}" xmlns="http://www.w3.org/2000/svg">{"".join(lines)}</svg>'
    )


def _flat(nodes: Floats, axis: int, scale: float, left: float) -> Floats:
    return np.column_stack([left + scale * nodes[:, axis], HEIGHT_PX - scale * nodes[:, 2]])


def _segments(flat: Floats, graph: Skeleton, colours: list[str], width: float) -> list[str]:
    """Draw the segments of one colour as one path."""
    paths: dict[str, list[str]] = {}
    for i in range(1, len(graph)):
        (x, y), (u, v) = flat[graph.parent[i]], flat[i]
        paths.setdefault(colours[i], []).append(f"M{x:.1f} {y:.1f}L{u:.1f} {v:.1f}")
    return [
        f'<path d="{"".join(steps)}" stroke="{colour}" stroke-width="{width}" fill="none"/>'
        for colour, steps in paths.items()
    ]
