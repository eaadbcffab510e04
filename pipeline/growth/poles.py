"""Parameters that would grow a pole: what a lateral bud gets, against what it needs."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from pipeline.growth.markers import Markers
from pipeline.growth.options import GrowthOptions, LightOptions, ShootOptions
from pipeline.growth.state import DAMAGED, DORMANT, GROWN, Metamers

TALL = 12
"""Metamers of the pole that light by space is tried on."""
LOWEST = 5
"""Those below do not count: nobody claims the space under them, which in a tree is ground."""
TRIES = 5
"""Sets of markers that it is tried with."""


def bare_pole(options: GrowthOptions) -> str | None:
    """Tell why a tree of these options may grow into a pole without branches; None where it does not.

    At a dominance of 0.5 the allocation of Borchert and Honda gives every bud alpha times its own light, and
    the resource of a lateral bud must pass its threshold. By shadow, such a bud below one metamer of its own
    axis has `full_light - shade / shade_fall`. By space, cones of neighbouring buds overlap, the more the
    wider they are: what the best bud of a small pole claims is found by trying.

    Examples
    --------
    >>> bare_pole(GrowthOptions())
    >>> print(bare_pole(GrowthOptions(alpha=2.0)))
    a lateral bud in good light gets 1.73 and needs 1.8: a bare pole may grow; raise alpha above 2.08 or ...
    >>> print(bare_pole(GrowthOptions(light="space", perception_deg=120.0)))
    a lateral bud in good light gets 1.40 and needs 1.8: ... or lower lateral_threshold or perception_deg
    """
    if options.light == "shadow":
        light, other = options.full_light - options.shade / options.shade_fall, "shade"
    else:
        names = (*LightOptions.model_fields, "metamer_m", "insertion_deg", "phyllotaxis_deg")
        # in lengths of a metamer, so that other lengths need no new trial
        alike = {name: getattr(options, name) for name in names} | {"metamer_m": 1.0}
        light, other = on_a_pole(GrowthOptions(**alike)), "perception_deg"
    share = 2.0 * (1.0 - options.dominance) * light
    got = options.alpha * share
    if got > options.lateral_threshold:
        return None
    enough = f"raise alpha above {options.lateral_threshold / share:.2f} or " if share > 0.0 else ""
    return (
        f"a lateral bud in good light gets {got:.2f} and needs {options.lateral_threshold:g}: a bare pole "
        f"may grow; {enough}lower lateral_threshold or {other}"
    )


@lru_cache(maxsize=256)
def on_a_pole(options: GrowthOptions) -> float:
    """Return the light of the best lateral bud of a pole in free space, the mean of some sets of markers."""
    tree = pole(options)
    ends, foot = tree.end[: len(tree)], np.array([0.0, 0.0, -2.0 * options.perception * options.metamer_m])
    best = []
    for seed in range(TRIES):
        markers = Markers(options, seed, foot)
        markers.add(ends)
        best.append(float(markers.at_buds(tree).lateral[LOWEST:].max()))
    return sum(best) / TRIES


def pole(options: ShootOptions) -> Metamers:
    """Return an upright axis whose lateral buds wait."""
    tree, rows = Metamers.empty(TALL + 1), np.arange(TALL + 1)
    tree.count = len(rows)
    lean, turn = np.radians(options.insertion_deg), np.radians(options.phyllotaxis_deg) * rows
    around = np.column_stack([np.cos(turn), np.sin(turn), np.zeros(len(rows))])
    tree.direction[rows] = upright = np.array([0.0, 0.0, 1.0])
    tree.end[rows] = rows[:, None] * options.metamer_m * upright
    tree.lateral_bud_direction[rows] = np.sin(lean) * around + np.cos(lean) * upright
    tree.terminal_bud[rows], tree.lateral_bud[rows] = GROWN, DORMANT
    tree.terminal_bud[TALL], tree.lateral_bud[0] = DORMANT, DAMAGED
    return tree
