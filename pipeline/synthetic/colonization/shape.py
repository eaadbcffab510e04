"""What a grown tree becomes: radii by the pipe rule, axes, and branches that hang."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.model import Floats, Skeleton
from pipeline.synthetic.colonization.options import GeometryOptions

Ints = NDArray[np.int64]


def pipe_exponent(stem_thickness: float) -> float:
    """Return n of ``r^n = sum of the children's r^n``: 3 is slim, 1 is stout."""
    return 3.0 - 2.0 * stem_thickness


@compiled
def pipe_radii(parent: Ints, tip_m: float, exponent: float) -> Floats:
    """(N,) radii in metres, `tip_m` at the tips; parents stand before children."""
    count = len(parent)
    area = np.zeros(count)
    for i in range(count - 1, -1, -1):
        if area[i] == 0.0:
            area[i] = tip_m**exponent
        if parent[i] >= 0:
            area[parent[i]] += area[i]
    return np.asarray(area ** (1.0 / exponent))


@compiled
def axes(parent: Ints, radius: Floats, stem: int) -> Ints:
    """(N,) the child that goes on with each node's axis, -1 at tips.

    It is the thickest, the eldest of equals; the first `stem` nodes are one axis whatever their radii.
    """
    ahead = np.full(len(parent), -1, dtype=np.int64)
    for i in range(1, len(parent)):
        p = parent[i]
        if ahead[p] < 0 or (ahead[p] >= stem and radius[i] > radius[ahead[p]]):
            ahead[p] = i
    return ahead


def hanging(skeleton: Skeleton, options: GeometryOptions) -> Floats:
    """(N, 3) positions of the nodes after branches have bent under their weight.

    Every segment of the order from which branches hang turns towards straight down by
    ``psi = pendulous * (1 - theta / 180) * theta`` degrees, theta being its angle with it, and takes all
    that it carries along; from the root to the tips. By branch order the stem never hangs.
    """
    if options.pendulous == 0.0:
        return np.asarray(skeleton.xyz)
    if options.pendulous_order == "branch":
        order = skeleton.order.astype(np.int64)
        least = max(1, int(np.ceil(options.pendulous_start * order.max())))
    else:
        order = _depth(skeleton.parent.astype(np.int64))
        least = int(np.ceil(options.pendulous_start * order.max()))
    return _bent(skeleton.xyz, skeleton.parent.astype(np.int64), order >= least, options.pendulous)


def bend_angle(theta_deg: float, intensity: float) -> float:
    """Return by how much a segment turns down that stands at `theta_deg` from straight down, degrees.

    Examples
    --------
    >>> [round(bend_angle(theta, 0.8), 9) for theta in (180, 120, 90, 60)]
    [0.0, 32.0, 36.0, 32.0]
    """
    return _psi(theta_deg, intensity)


@compiled
def _psi(theta: float, intensity: float) -> float:
    return intensity * (1.0 - theta / 180.0) * theta


@compiled
def _depth(parent: Ints) -> Ints:
    depth = np.zeros(len(parent), dtype=np.int64)
    for i in range(1, len(parent)):
        depth[i] = depth[parent[i]] + 1
    return depth


@compiled
def _bent(xyz: Floats, parent: Ints, hangs: NDArray[np.bool_], intensity: float) -> Floats:
    out = xyz.copy()
    turned = np.zeros((len(xyz), 3, 3))
    turned[0] = np.eye(3)
    for i in range(1, len(xyz)):
        p = parent[i]
        turn = turned[p]
        run = turn @ (xyz[i] - xyz[p])
        size = np.sqrt((run * run).sum())
        if hangs[i] and size > 0.0:
            theta = np.degrees(np.arccos(min(max(-run[2] / size, -1.0), 1.0)))
            flat = np.sqrt(run[0] ** 2 + run[1] ** 2)
            if flat > 1e-9 * size:
                down = _turn_down(-run[1] / flat, run[0] / flat, np.radians(_psi(theta, intensity)))
                turn = down @ turn
                run = down @ run
        turned[i] = turn
        out[i] = out[p] + run
    return out


@compiled
def _turn_down(x: float, y: float, angle: float) -> Floats:
    """Rotate about the level unit axis (x, y): a run with that axis to its left turns downwards."""
    c, s = np.cos(angle), np.sin(angle)
    k = 1.0 - c
    return np.array(
        [[c + x * x * k, x * y * k, y * s], [x * y * k, c + y * y * k, -x * s], [-y * s, x * s, c]]
    )
