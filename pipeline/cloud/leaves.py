"""Which points are leaves: wood lies along lines, and the lines hang together down to the foot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components, dijkstra
from scipy.spatial import cKDTree

from pipeline.cloud.ground import foot, lowest
from pipeline.cloud.lines import line_scores
from pipeline.cloud.order import from_corner
from pipeline.cloud.outliers import SAMPLE
from pipeline.geometry.compiled import compiled
from pipeline.geometry.spanning import shortest_bridges
from pipeline.geometry.voxels import cell_keys
from pipeline.options import Options

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

COARSER = 2.0  # lines are drawn among points this much sparser as well, for rough and thick wood;
COARSE_LESS = 0.4  # their scores count for so much less, as they are blunt

NEIGHBOURS = 8
CARRIES = 0.0  # score from which a point may carry a path
EASE = 2.0  # paths run exp(EASE * score) times easier along lines
FREE_CELLS = 2.0  # steps longer than this are gaps
MOST = 0.6  # what this share of its neighbours is, a point is too
FOOT_M = 0.5  # the root is looked for so far above the lowest points


class LeafOptions(Options):
    """How leaves are told from wood."""

    leaf_cell_m: float = Field(
        0.025, ge=0.005, le=0.5, description="lines are sought among points at least this far apart (metres)"
    )
    wood_score: float = Field(
        0.3, ge=0, le=1.5, description="evidence for a line, in nats a cell of its length, that makes wood"
    )


def find_leaves(xyz: Floats, *, options: LeafOptions | None = None) -> Mask:
    """Tell the leaves of a dense cloud of one tree from its wood.

    Every point is asked for the straight line through it that stands out best from what surrounds
    it: wood fills a line without gaps, foliage fills it by chance. The evidence is added up along
    the easiest paths from the foot; the heaviest connected part of them is the wood. A branch that
    leaves hide in part is so bridged where what lies beyond outweighs the gap, and a lone woody
    spot in the foliage is not reached.

    Parameters
    ----------
    xyz : (P, 3) array
        A cleaned tree without ground, in canonical order, in metres; z points up.
    options : LeafOptions, optional

    Returns
    -------
    (P,) array of bool
        True where a point is leaf.

    Notes
    -----
    Lengths are multiples of one cell: `leaf_cell_m`, or in sparser clouds the usual distance to
    the fourth neighbour.

    References
    ----------
    Wang, Momo Takoudjou & Casella (2020), "LeWoS", for linear evidence that neighbours regularise;
    Vicari et al. (2019), "TLSeparation", for paths to the base. Changed: the eigenvalues of a ball
    full of leaves say little of the twig in it, so lines are tested against their surroundings;
    and paths are not counted, but weighed by the evidence they gather.
    """
    options = options or LeafOptions()
    if len(xyz) <= NEIGHBOURS:
        return np.zeros(len(xyz), dtype=bool)
    cell, few, place = thinned_for_lines(xyz, options.leaf_cell_m)
    if len(few) <= NEIGHBOURS:
        return np.zeros(len(xyz), dtype=bool)
    near = cKDTree(few).query(few, k=NEIGHBOURS + 1)[1][:, 1:]
    score = smoothed_scores(few, near, cell)
    wood = _connected_wood(few, near, score, cell, options.wood_score)
    wood |= wood[near].mean(axis=1) > MOST
    return np.asarray(~wood[place])


def thinned_for_lines(xyz: Floats, least_m: float) -> tuple[float, Floats, Ints]:
    """Return the cell that lines are sought with, one point a cell, and which stands for every point."""
    cell = max(least_m, _usual_distance(xyz))
    first, place = _thinned(xyz, cell)
    return cell, np.ascontiguousarray(xyz[first]), place


def smoothed_scores(xyz: Floats, near: Ints, cell: float) -> Floats:
    """Return the evidence for the best line through every point, half of it that of its neighbours."""
    score = _scores(xyz, cell)
    return np.asarray(0.5 * (score + score[near].mean(axis=1)))


def _usual_distance(xyz: Floats) -> float:
    """Median distance to the fourth neighbour in metres: about what a surface's points lie apart."""
    sample = xyz[:: max(1, len(xyz) // SAMPLE)]
    return float(np.median(cKDTree(xyz).query(sample, k=5)[0][:, 4]))


def _thinned(xyz: Floats, cell: float) -> tuple[Ints, Ints]:
    """Positions of the first point in every cell, and for every point which of these stands for it."""
    keys = cell_keys(from_corner(xyz), cell)
    _, first, place = np.unique(keys, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return first[order], rank[place.ravel()]


def _scores(xyz: Floats, cell: float) -> Floats:
    """Evidence for the best line through every point, at two scales."""
    first, place = _thinned(xyz, COARSER * cell)
    coarse = line_scores(xyz[first], COARSER * cell)[place] - COARSE_LESS
    return np.maximum(line_scores(xyz, cell), coarse)


def _connected_wood(xyz: Floats, near: Ints, score: Floats, cell: float, least: float) -> Mask:
    """Heaviest connected part of the easiest paths from the foot.

    A point weighs its score less `least`; a gap weighs as if it were filled with points of score 0.

    Parameters
    ----------
    xyz : (P, 3) array
        Thinned points.
    near : (P, k) array of int
        Their neighbours.
    score : (P,) array
    cell : float
        What they are thinned to, metres.
    least : float
        Score from which a point is wood.
    """
    wood = np.zeros(len(xyz), dtype=bool)
    carriers = np.flatnonzero(score > CARRIES)
    if not len(carriers):
        return ~wood
    points, worth = xyz[carriers], score[carriers]
    far, before = _paths(points, _edges(points, near, carriers, len(xyz)), worth)
    step = np.linalg.norm(points - points[np.maximum(before, 0)], axis=1)
    gap = np.maximum(step / cell - FREE_CELLS, 0.0)
    weight = worth - least - least * gap
    wood[carriers] = heaviest_part(np.argsort(far, kind="stable"), before, weight)
    return wood


def _edges(points: Floats, near: Ints, carriers: Ints, total: int) -> Ints:
    """Edges between neighbours among the carriers, and the bridges that join them all."""
    count = len(points)
    number = np.full(total, -1, dtype=np.int64)
    number[carriers] = np.arange(count)
    other = number[near[carriers]].ravel()
    pairs = np.column_stack([np.repeat(np.arange(count), near.shape[1]), other])[other >= 0]
    links = coo_array((np.ones(len(pairs), dtype=np.int8), pairs.T), shape=(count, count))
    parts, part = connected_components(links, directed=False)
    if parts > 1:
        pairs = np.vstack([pairs, shortest_bridges(points, part.astype(np.int64))])
    pairs.sort(axis=1)
    return np.column_stack(np.divmod(np.unique(pairs[:, 0] * count + pairs[:, 1]), count))


def _paths(points: Floats, edges: Ints, score: Floats) -> tuple[Floats, Ints]:
    """Cost of the easiest path from the foot to every point, and the point before it (-1 at the foot)."""
    a, b = edges.T
    length = np.maximum(np.linalg.norm(points[a] - points[b], axis=1), 1e-9)
    cost = length * np.exp(-EASE * np.minimum(score[a], score[b]))
    ends = (np.concatenate([a, b]), np.concatenate([b, a]))
    graph = csr_array((np.concatenate([cost, cost]), ends), shape=(len(points), len(points)))
    far, before = dijkstra(graph, indices=_root(points), return_predecessors=True)
    return far, np.maximum(before, -1).astype(np.int64)


def _root(points: Floats) -> int:
    """Return the point at the foot of the stem."""
    bottom = lowest(points)
    low = np.flatnonzero(points[:, 2] <= bottom + FOOT_M)
    away = np.hypot(*(points[low, :2] - foot(points)).T) + np.abs(points[low, 2] - bottom)
    return int(low[np.argmin(away)])


@compiled
def heaviest_part(order: Ints, before: Ints, weight: Floats) -> Mask:
    """Heaviest connected part of a rooted tree that holds its root.

    Parameters
    ----------
    order : (N,) array of int
        All nodes, every one after the one before it on its path; the root first.
    before : (N,) array of int
    weight : (N,) array

    Returns
    -------
    (N,) array of bool
    """
    total = weight.copy()
    for k in range(len(order) - 1, 0, -1):
        node = order[k]
        if total[node] > 0.0:
            total[before[node]] += total[node]
    kept = np.zeros(len(order), dtype=np.bool_)
    kept[order[0]] = True
    for node in order[1:]:
        kept[node] = kept[before[node]] and total[node] > 0.0
    return kept
