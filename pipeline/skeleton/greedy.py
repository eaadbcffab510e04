"""The stem by circles, the rest point by point: the method for sparse airborne clouds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.spatial import cKDTree

from pipeline.errors import NotATreeError
from pipeline.geometry.azimuth import STEM
from pipeline.geometry.compiled import compiled
from pipeline.geometry.voxels import ball_moments, first_in_cell
from pipeline.model import PointCloud, Skeleton
from pipeline.options import Options
from pipeline.skeleton.joining import AHEAD, Grown, grown
from pipeline.skeleton.limbs import find_base
from pipeline.skeleton.rooted import LEAST_THICKNESS_M, Rooted, skeleton_of
from pipeline.skeleton.stem import STEP_M, Stem, find_stem

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

THIN_M = 0.01  # points closer than this say the same
MOST_POINTS = 20_000  # the growth compares all points with all nodes; more points are thinned
BALLS = ((2.0, 0.20), (3.0, 0.30))  # spacings, and at most metres: where points look for their limb
LINE_POINTS = 6  # of a ball that may be a limb
LINE_WIDTH = 0.35  # root mean square width of a limb's points as a share of the ball
LINE_SHAPE = 3.0  # least ratio of variances along and across
HANGING = 0.15  # where nothing is seen below this share of the height, the lower stem is a guess


class GreedyOptions(Options):
    """Options of the greedy skeleton."""

    range_noise_m: float = Field(0.02, gt=0, le=0.2, description="range noise to expect on bark, metres")
    path_cost: float = Field(0.45, ge=0, le=5, description="cost of a metre of way to the root")
    bend_cost: float = Field(0.3, ge=0, le=5, description="cost of a metre of link at a right angle")
    longest_link: float = Field(
        8.0, gt=0, description="link, in spacings, beyond which a few points are left out"
    )
    link_points: int = Field(2, ge=1, description="least points beyond such a link")
    tip_beyond_m: float = Field(0.1, ge=0, le=1, description="length of a branch past its last point, metres")
    direction_window_m: float = Field(
        0.2, gt=0, le=5, description="length over which a branch's direction is taken at a fork, metres"
    )


def by_greedy(cloud: PointCloud, options: GreedyOptions) -> Skeleton:
    """Extract a skeleton by a circle-fitted stem and greedy growth from point to point.

    A point joins the tree where ``d^1.5 + path_cost * way + bend_cost * d * (1 - cos bend)`` is
    least, d being its distance and `way` that to the root; the cheapest point joins first.

    Parameters
    ----------
    cloud : PointCloud
        A cleaned cloud of one tree, in canonical order.
    options : GreedyOptions

    Returns
    -------
    Skeleton
        Numbered path by path. Its metadata hold `stem_circles`: rows of height (relative to the
        origin), radius and its standard error, in metres, from below; none where no bark is seen.
        Where none stands in the lowest part of the tree, the flag `no_trunk` is added.

    Raises
    ------
    NotATreeError
        If fewer than two points are left after thinning.

    References
    ----------
    Prim (1957), with the way to the root in the cost as between Prim's and Dijkstra's trees
    (Alpert et al. 1995, "Prim-Dijkstra tradeoffs").
    """
    points, spacing = _thinned(cloud.xyz)
    stem = stem_of(cloud, points, points, options.range_noise_m)
    free = points[~stem.claims(points)]
    nodes = grown(_centred(free, spacing), stem, spacing, (options.path_cost, options.bend_cost))
    tree = _pruned(nodes, options.longest_link * spacing, options.link_points, len(stem.xyz))
    tree = _with_tips(tree, options.tip_beyond_m, AHEAD * spacing)
    skeleton = skeleton_of(tree, cloud, options.direction_window_m)
    known = {
        **{key: value for key, value in skeleton.metadata.items() if key != STEM},
        "flags": airborne_flags(cloud, stem, points),
        "stem_circles": stem.circles,
        "noise_m": options.range_noise_m,
    }
    return Skeleton(skeleton.xyz, skeleton.parent, skeleton.origin, skeleton.crs, known)


def _thinned(xyz: Floats) -> tuple[Floats, float]:
    """Thin the points until the growth is quick; their median distance from each other."""
    size = THIN_M
    points = xyz[first_in_cell(xyz, size)]
    while len(points) > MOST_POINTS:
        size *= 1.25
        points = xyz[first_in_cell(xyz, size)]
    if len(points) < 2:
        msg = f"the points fall on {len(points)} node at a spacing of {size:g} m; is the unit metres?"
        raise NotATreeError(msg)
    return points, max(float(np.median(cKDTree(points).query(points, k=2)[0][:, 1])), size)


def ground_under(cloud: PointCloud, points: Floats) -> float:
    """Height of the ground, never above the lowest point."""
    lowest = float(points[:, 2].min())
    return min(float(cloud.metadata.get("ground_z", lowest)), lowest)


def airborne_flags(cloud: PointCloud, stem: Stem, points: Floats) -> tuple[str, ...]:
    """Return the cloud's flags, and `no_trunk` where the lower stem was not seen."""
    lowest = stem.circles[0][0] if stem.circles else np.inf
    foot = stem.xyz[0, 2]
    unseen = lowest - foot > HANGING * (points[:, 2].max() - foot)
    return tuple(sorted({*cloud.metadata.get("flags", ()), *(("no_trunk",) if unseen else ())}))


def stem_of(cloud: PointCloud, bark: Floats, points: Floats, noise_m: float) -> Stem:
    """Return the stem: straight where foot and top are known, else by its bark, else a guess.

    Parameters
    ----------
    cloud : PointCloud
        Its metadata may hold `STEM`.
    bark : (Q, 3) array
        The points that circles are laid through, metres.
    points : (P, 3) array
        The points of the whole tree, metres.
    noise_m : float
        What to expect of the points' noise, metres.
    """
    if STEM not in cloud.metadata:
        found = find_stem(bark, ground_under(cloud, bark), noise_m)
        return found or guessed_stem(points, ground_under(cloud, points))
    foot, top = cloud.metadata[STEM]
    count = max(int(np.ceil(float(np.linalg.norm(top - foot)) / STEP_M)), 1)
    return Stem(np.linspace(foot, top, count + 1), np.zeros(count + 1), 0.0, ())


def guessed_stem(points: Floats, ground: float) -> Stem:
    """Return the stem of a tree that shows no bark: a line straight up from the ground.

    It ends at the lowest point of the column with the most points above it; where the whole crown
    hangs in the air, it stands below the crown's centre and ends at the crown's base.
    """
    height = float(points[:, 2].max()) - ground
    foot = points[find_base(points, 0.3)].copy()
    if foot[2] - ground > HANGING * height:
        foot = np.array([*np.median(points[:, :2], axis=0), np.quantile(points[:, 2], 0.05)])
    count = max(int(np.ceil((foot[2] - ground) / STEP_M)), 1)
    up = np.linspace(ground, foot[2], count + 1)[: None if foot[2] > ground else 1]
    return Stem(np.column_stack([np.full((len(up), 2), foot[:2]), up]), np.zeros(len(up)), 0.0, ())


def _centred(free: Floats, spacing: float) -> Floats:
    """Move the points of limbs that look like lines on to those lines."""
    out = free.copy()
    waiting = np.ones(len(free), dtype=bool)
    for spacings, most in BALLS if len(free) >= LINE_POINTS else ():
        ball = min(spacings * spacing, most)
        count, mean, covariance = ball_moments(free, ball)
        variance, axes = np.linalg.eigh(covariance)
        is_line = waiting & (count >= LINE_POINTS) & (variance[:, 2] > LINE_SHAPE * variance[:, 1])
        is_line &= variance[:, 0] + variance[:, 1] < (LINE_WIDTH * ball) ** 2
        way = axes[is_line, :, 2]
        along = ((free[is_line] - mean[is_line]) * way).sum(axis=1, keepdims=True)
        out[is_line] = mean[is_line] + along * way
        waiting &= ~is_line
    return out


def _pruned(nodes: Grown, longest_m: float, least: int, first: int) -> Rooted:
    """Leave out what few points reach over a long link, and the nodes on links that no one uses."""
    xyz, parent, link, is_point = nodes
    keep = _supported(parent, link, is_point, longest_m, least)
    forks = np.bincount(parent[keep & (parent >= 0)], minlength=len(parent)) != 1
    stays = keep & (is_point | forks)
    stays[:first] = True
    above = _next_kept(parent, stays)
    thickness = np.full(len(xyz), LEAST_THICKNESS_M)
    thickness[:first] = 0.1  # the stem goes on as the stem
    tree = Rooted(xyz, above, thickness, is_point.astype(np.float64))
    return tree.keep(stays)


@compiled
def _supported(
    parent: Ints, link: Floats, is_point: NDArray[np.bool_], longest: float, least: int
) -> NDArray[np.bool_]:
    points = is_point.astype(np.int64)
    for i in range(len(parent) - 1, 0, -1):
        points[parent[i]] += points[i]
    keep = np.ones(len(parent), dtype=np.bool_)
    for i in range(1, len(parent)):
        keep[i] = keep[parent[i]] and (link[i] <= longest or points[i] >= least)
    return keep


@compiled
def _next_kept(parent: Ints, stays: NDArray[np.bool_]) -> Ints:
    """(N,) the nearest node towards the root that stays."""
    above = parent.copy()
    for i in range(1, len(parent)):
        if not stays[parent[i]]:
            above[i] = above[parent[i]]
    return above


def _with_tips(tree: Rooted, beyond_m: float, ahead_m: float) -> Rooted:
    """Lead every branch a little past its last point, in its direction."""
    tips = np.flatnonzero(np.bincount(tree.parent[1:], minlength=len(tree.parent)) == 0)
    if beyond_m == 0.0 or len(tree.parent) < 2:
        return tree
    ends = tree.xyz[tips] + beyond_m * _ways_out(tree.xyz, tree.parent, tips, ahead_m)
    return Rooted(
        np.vstack([tree.xyz, ends]),
        np.concatenate([tree.parent, tips]),
        np.concatenate([tree.thickness, tree.thickness[tips]]),
        np.concatenate([tree.support, np.zeros(len(tips))]),
    )


@compiled
def _ways_out(xyz: Floats, parent: Ints, tips: Ints, ahead: float) -> Floats:
    """(T, 3) unit direction of the last `ahead` metres before every tip."""
    out = np.empty((len(tips), 3))
    for k in range(len(tips)):
        back, gone = tips[k], 0.0
        while parent[back] >= 0 and gone < ahead:
            gone += np.sqrt(((xyz[back] - xyz[parent[back]]) ** 2).sum())
            back = parent[back]
        run = xyz[tips[k]] - xyz[back]
        out[k] = run / max(np.sqrt((run * run).sum()), 1e-9)
    return out
