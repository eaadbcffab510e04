"""From parameters to a tree: points in a crown, a stem below it, growth, and its shape."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from pipeline.geometry.colonization import Colony, Progress, Rules, colonize
from pipeline.geometry.numbering import number_by_paths, renumbered
from pipeline.model import MEASURED, Floats, Skeleton, TreeModel
from pipeline.synthetic.colonization.envelope import crown_height, crown_points
from pipeline.synthetic.colonization.options import ColonizationOptions, GrowthOptions
from pipeline.synthetic.colonization.schedule import influence, kill_distances
from pipeline.synthetic.colonization.shape import axes, hanging, pipe_exponent, pipe_radii

STEM_STREAM, POINTS_STREAM = 0, 1
YOUNG = 0.5  # share of points left above which a growth that ends has hardly begun
WIDER = 1.25  # how much farther tips then see
MOST_TRIES = 10
Listener = Callable[[Progress], None]


def grow_colonization(options: ColonizationOptions, progress: Listener | None = None) -> TreeModel:
    """Grow a tree into the free space of a crown.

    Parameters
    ----------
    options : ColonizationOptions
    progress : callable, optional
        Is told after every iteration.

    Returns
    -------
    TreeModel
        Numbered path by path, an axis going on with its thickest child. Its metadata tell the `seed`, how
        many `points` there were, the share of them `unused`, the `iterations` done and the `stop_reason`
        (see `pipeline.geometry.colonization.Colony`).

    References
    ----------
    Runions, Lane & Prusinkiewicz (2007), "Modeling trees with a space colonization algorithm". Changed: the
    kill distance falls while the tree grows, the stem may go on into the crown, and branches may hang.
    """
    colony, stem = grow(options, progress)
    return shaped(colony, stem, options)


def grow(options: GrowthOptions, progress: Listener | None = None) -> tuple[Colony, int]:
    """Grow the nodes alone; the second value is how many of them, from the first on, are the stem.

    A low `density_begin` kills points nearly as far off as tips see them. Few points are left between the two
    distances, by chance none, and the tree ends before it has begun. It then grows anew with tips that see
    farther; a crown that has filled half of its space does not.
    """
    straight, entered = stem_nodes(options, np.random.default_rng([options.seed, STEM_STREAM]))
    points = crown_points(options, straight[entered], np.random.default_rng([options.seed, POINTS_STREAM]))
    flat = min(1.0, options.crown_height_m / max(options.crown_width_m, options.crown_depth_m))
    rules = Rules(
        options.step_m,
        influence(options.gnarliness),
        options.perception_deg,
        (options.tropism_x, options.tropism_y, options.tropism_z * flat**2),
        options.tropism_on,
    )
    first = (straight, np.arange(len(straight)) - 1)
    kill = kill_distances(options)
    for _ in range(MOST_TRIES):
        colony = colonize(points, first, rules=rules, kill_m=kill, progress=progress)
        if colony.reason != "out_of_reach" or colony.left.mean() < YOUNG:
            break
        rules = rules._replace(influence_m=WIDER * rules.influence_m)
    return colony, len(straight)


def shaped(colony: Colony, stem: int, options: ColonizationOptions) -> TreeModel:
    """Give grown nodes their radii, axes and bends; another shape needs no new growth."""
    radius = pipe_radii(colony.parent, options.tip_radius_m, pipe_exponent(options.stem_thickness))
    order = number_by_paths(colony.parent, axes(colony.parent, radius, stem))
    known = {
        "method": "colonization",
        "seed": options.seed,
        "points": len(colony.left),
        "unused": round(float(colony.left.mean()), 6),
        "iterations": colony.iterations,
        "stop_reason": colony.reason,
    }
    skeleton = Skeleton(colony.xyz[order], renumbered(colony.parent, order), metadata=known)
    bent = hanging(skeleton, options)
    if bent is not skeleton.xyz:
        skeleton = replace(skeleton, xyz=bent)
    count = len(order)
    sources: NDArray[np.uint8] = np.full(count, MEASURED, dtype=np.uint8)
    return TreeModel(skeleton, radius[order], sources, np.zeros(count), None, known)


def stem_nodes(options: GrowthOptions, random: Generator) -> tuple[Floats, int]:
    """(M, 3) nodes of the stem from the ground up, and which of them stands where the crown begins."""
    below = _segments(options.stem_length_m, options.step_m, options.stem_tilt_deg, random)
    inside = crown_height(options) * options.crown_stem_ratio
    above = _segments(inside, options.step_m, options.stem_tilt_deg, random)
    return np.vstack([np.zeros((1, 3)), np.cumsum(np.vstack([below, above]), axis=0)]), len(below)


def _segments(length: float, step: float, tilt_deg: float, random: Generator) -> Floats:
    """(K, 3) upright segments, each tilted a little; together as long as asked for."""
    count = max(1, round(length / step)) if length > 0.0 else 0
    tilt = np.radians(tilt_deg) * random.uniform(-1.0, 1.0, (count, 2))
    way = np.column_stack([np.tan(tilt), np.ones(count)])
    return np.asarray(way / np.linalg.norm(way, axis=1, keepdims=True) * (length / max(count, 1)))
