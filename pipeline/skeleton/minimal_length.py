"""The shortest system of straight branches that leads from the trunk to the crown's points."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field, field_validator

from pipeline.errors import NotATreeError
from pipeline.geometry.numbering import number_by_paths, renumbered
from pipeline.geometry.polyline import douglas_peucker
from pipeline.geometry.voxels import cells_with_means, first_in_cell
from pipeline.model import PointCloud, Skeleton
from pipeline.options import Options
from pipeline.skeleton.limbs import find_base
from pipeline.skeleton.minimal.nodes import nodes_of
from pipeline.skeleton.minimal.problem import Axes, Floats, Problem
from pipeline.skeleton.minimal.search import Budget
from pipeline.skeleton.minimal.solving import Outcome, shortest
from pipeline.skeleton.stem import Stem, find_stem

THIN_M = 0.01  # points closer than this say the same
MOST_POINTS = 20_000  # that the stem is sought among
WIDER = 1.25  # step of the cells' sides
BEND_M = 0.05  # a trunk is straight as long as its circles lie within
HANGING = 0.15  # where nothing is seen below this share of the height, the lower stem is a guess


class MinimalOptions(Options):
    """Options of the minimal-length skeleton."""

    range_noise_m: float = Field(0.02, gt=0, le=0.2, description="range noise to expect on bark, metres")
    trunk: Literal["seen", "straight"] = Field(
        "seen", description="trunk of minimal-length: along the bark where it is seen, or straight to the top"
    )
    insertion_deg: tuple[float, ...] = Field(
        (42.5,),
        min_length=1,
        description="angles between branch and mother by order, the last for all beyond, degrees, 5 to 90",
    )
    leaf_cell_m: float = Field(
        0.2, gt=0, le=5, description="least side of the cells that keep one point as a leaf each, metres"
    )
    most_leaves: int = Field(
        400, ge=1, le=5000, description="cells grow until at most this many leaves are left"
    )
    least_branch: float = Field(
        0.5, ge=0, le=5, description="length, in cells, below which a branch without daughters is left out"
    )
    exact_leaves: int = Field(
        100,
        ge=0,
        le=200,
        description="most leaves for which the least length is proven by an integer program",
    )
    search_rounds: int = Field(
        2, ge=0, le=1000, description="rounds of the quick search for a shorter tree, for every leaf"
    )
    exact_bunches: int = Field(
        0,
        ge=0,
        le=100_000,
        description="bunches of 25 leaves that integer programs then solve: 150 are seconds, and 5 % shorter",
    )
    search_seed: int = Field(0, ge=0, description="seed of the search")

    @field_validator("insertion_deg")
    @classmethod
    def _angles(cls, angles: tuple[float, ...]) -> tuple[float, ...]:
        bad = [angle for angle in angles if not 5.0 <= angle <= 90.0]
        if bad:
            msg = f"an insertion angle of {bad[0]:g} degrees is not allowed; give angles from 5 to 90"
            raise ValueError(msg)
        return angles


def by_minimal_length(cloud: PointCloud, options: MinimalOptions) -> Skeleton:
    """Extract a skeleton as the shortest branch system that reaches the crown's points.

    Branches are straight and leave their mothers at an angle that their order gives; none is longer
    than what its mother still has to go (apical dominance). Points that no branch can reach so are
    reached at angles up to 20 degrees off, then from wherever is nearest.

    Parameters
    ----------
    cloud : PointCloud
        A cleaned cloud of one tree, in canonical order.
    options : MinimalOptions

    Returns
    -------
    Skeleton
        Numbered path by path. Its metadata hold `minimal_length`: leaves, those at relaxed angles
        and at none, lengths of trunk and branches, the best bound, length over bound and whether the
        length is proven to be the least; and the flags `relaxed_angles`, `unreached_leaves`, `no_trunk`.

    Raises
    ------
    NotATreeError
        If fewer than two points are left after thinning, or all lie below the stem's foot.

    References
    ----------
    Beyer, Bayer, Pretzsch & Cournede (2017), "Reconstructing minimal length tree branch systems from
    leaf positions", Ecological Informatics 42, 61-66. Changed: the trunk may bend, and the search is
    an integer program with a large-neighbourhood search in place of the enumeration of systems.
    """
    points = _thinned(cloud.xyz)
    ground = _ground_under(cloud, points)
    stem = find_stem(points, ground, options.range_noise_m)
    line = _trunk(points, ground, stem, options)
    crown = points if stem is None else points[~stem.claims(points)]
    leaves, cell = _leaves(crown[(crown != line[-1]).any(axis=1)], options)
    problem = Problem(leaves, Axes.trunk(line), np.radians(options.insertion_deg))
    budget = Budget(options.search_rounds, options.exact_bunches, options.search_seed)
    outcome = shortest(problem, budget, exact_leaves=options.exact_leaves)
    xyz, parent, ahead = nodes_of(outcome.system, options.least_branch * cell)
    order = number_by_paths(parent, ahead)
    known = {
        **cloud.metadata,
        **_told(cloud, outcome, stem, points, ground),
        "noise_m": options.range_noise_m,
    }
    return Skeleton(xyz[order], renumbered(parent, order), cloud.origin, cloud.crs, known)


def _thinned(xyz: Floats) -> Floats:
    """Thin the points until the stem is found quickly."""
    size = THIN_M
    points = xyz[first_in_cell(xyz, size)] if len(xyz) else xyz
    while len(points) > MOST_POINTS:
        size *= WIDER
        points = xyz[first_in_cell(xyz, size)]
    if len(points) < 2 or np.ptp(points[:, 2]) < THIN_M:
        msg = (
            f"the {len(points)} points left at a spacing of {size:g} m have no height, a tree takes two "
            "points or more; is the cloud one tree, and its unit metres?"
        )
        raise NotATreeError(msg)
    return points


def _ground_under(cloud: PointCloud, points: Floats) -> float:
    """Height of the stem's foot: the ground, never above the lowest point of a tree that stands on it."""
    low, high = float(points[:, 2].min()), float(points[:, 2].max())
    ground = float(cloud.metadata.get("ground_z", low))
    if ground >= high:
        msg = (
            f"all points, at heights from {low:.2f} to {high:.2f} m, lie below the stem's foot on the ground "
            f"at {ground:.2f} m; give points above it, or the ground of this tree"
        )
        raise NotATreeError(msg)
    return min(ground, low)


def _trunk(points: Floats, ground: float, stem: Stem | None, options: MinimalOptions) -> Floats:
    """(M, 3) line from the foot to the highest point, along the bark where it is seen."""
    top = points[np.argmax(points[:, 2])]
    if stem is None:
        foot = points[find_base(points, 0.3)]
        if foot[2] - ground > HANGING * (top[2] - ground):
            foot = np.median(points, axis=0)
        return np.array([[foot[0], foot[1], ground], top])
    if options.trunk == "straight":
        return np.array([stem.xyz[0], top])
    line = stem.xyz[stem.xyz[:, 2] < top[2] - THIN_M]
    line = line[douglas_peucker(line, np.full(len(line), BEND_M))] if len(line) > 1 else line
    return np.vstack([line, top])


def _leaves(crown: Floats, options: MinimalOptions) -> tuple[Floats, float]:
    """One point of every cell, that nearest to the cell's mean, in the order of points; the cells' side."""
    side = options.leaf_cell_m
    cell, mean = cells_with_means(crown, side) if len(crown) else (np.zeros(0, dtype=np.int64), crown)
    while len(mean) > options.most_leaves:
        side *= WIDER
        cell, mean = cells_with_means(crown, side)
    off = ((crown - mean[cell]) ** 2).sum(axis=1)
    order = np.lexsort((off, cell))
    return crown[np.sort(order[np.diff(cell[order], prepend=-1) > 0])], side


def _told(
    cloud: PointCloud, outcome: Outcome, stem: Stem | None, points: Floats, ground: float
) -> dict[str, object]:
    """What the skeleton says of itself."""
    off = outcome.system.off_angle
    lowest = stem.circles[0][0] if stem is not None and stem.circles else np.inf
    unseen = lowest - ground > HANGING * (points[:, 2].max() - ground)
    raised = {
        "no_trunk": unseen,
        "relaxed_angles": bool((off != 0.0).any()),
        "unreached_leaves": bool(np.isnan(off).any()),
    }
    return {
        "flags": tuple(sorted({*cloud.metadata.get("flags", ()), *(f for f, on in raised.items() if on)})),
        "stem_circles": stem.circles if stem is not None else (),
        "minimal_length": outcome.as_plain(),
        "method_note": str(outcome),
    }
