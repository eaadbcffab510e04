"""What does not hang together with the tree: debris, a neighbour's twig, a second tree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from pipeline.cloud.order import from_corner
from pipeline.geometry.voxels import first_in_cell

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Mask = NDArray[np.bool_]

SAMPLE = 20_000  # points that are enough for a median distance
NEIGHBOURS = 8
GAPS = 4.0  # a link spans this many usual distances
MIN_LINK_M = 0.4  # occlusion leaves gaps of this size in a branch of any dense scan
FAR_LINKS = 3.0  # a small part further away than this many links is not the tree's
FAR_M = 1.0  # nor is it when nearer than this
VERY_FAR_LINKS = 8.0  # a large part further away than this is another tree's crown
STEM_SHARE = 0.05  # of all points, below which a part is no tree of its own
STEM_START_M = 1.0  # a stem starts within this height of the base
STEM_GAP_M = 0.5  # two stems stand at least this far apart


@dataclass(frozen=True, eq=False)
class Parts:
    """Which points belong to the tree, and what the others or its own loose parts tell.

    Parameters
    ----------
    clump : (P,) array of bool
        Points that are not the tree's.
    several_stems : bool
        A second tree stood in the cloud.
    floating : bool
        A large part of the tree hangs free.
    """

    clump: Mask
    several_stems: bool
    floating: bool


def parts(xyz: Floats, *, small_share: float, base_z: float | None = None) -> Parts:
    """Split a cloud into the tree and what stands apart from it.

    Parameters
    ----------
    xyz : (P, 3) array
        Metres, in canonical order, without outliers and ground.
    small_share : float
        Share of all points below which a far part is debris.
    base_z : float or None
        Height of the ground in metres; None takes the lowest point of the largest part.
    """
    link = link_length(xyz)
    label = components(xyz, link)
    count = np.bincount(label)
    if len(count) == 1:
        return Parts(np.zeros(len(xyz), dtype=bool), False, False)
    main = int(np.argmax(count))
    stems = _other_stems(xyz, label, main, base_z)
    large = count >= small_share * len(xyz)
    hop = np.where(large, VERY_FAR_LINKS * link, max(FAR_M, FAR_LINKS * link))
    keep = _within_reach(_groups(xyz, label, link), hop, stems, main)
    return Parts(~keep[label], bool(stems.any()), bool((large & keep).sum() > 1))


def link_length(xyz: Floats) -> float:
    """Longest gap inside one part in metres: a multiple of the usual distance to the neighbours."""
    if len(xyz) <= NEIGHBOURS:
        return MIN_LINK_M
    sample = xyz[:: max(1, len(xyz) // SAMPLE)]
    distance = cKDTree(xyz).query(sample, k=NEIGHBOURS + 1)[0][:, 1:].mean(axis=1)
    return max(MIN_LINK_M, GAPS * float(np.median(distance)))


def components(xyz: Floats, link_m: float) -> Ints:
    """(P,) number of the part each point belongs to; gaps up to about `link_m` are bridged."""
    few = xyz[first_in_cell(from_corner(xyz), link_m / 3)]
    tree = cKDTree(few)
    pairs = tree.query_pairs(link_m, output_type="ndarray")
    links = coo_matrix(
        (np.ones(len(pairs), dtype=np.int8), (pairs[:, 0], pairs[:, 1])), shape=(len(few),) * 2
    )
    label = connected_components(links, directed=False)[1]
    return np.asarray(label[tree.query(xyz)[1]], dtype=np.int64)


def _other_stems(xyz: Floats, label: Ints, main: int, base_z: float | None) -> Mask:
    """Mask of the parts that stand on the ground beside the main one."""
    count = np.bincount(label)
    base = float(xyz[label == main, 2].min()) if base_z is None else base_z
    found = np.zeros(len(count), dtype=bool)
    low = _bottom(xyz[label == main])
    for part in np.flatnonzero(count >= STEM_SHARE * len(xyz)):
        bottom = _bottom(xyz[label == part])
        starts = bottom[0, 2] <= base + STEM_START_M
        apart = cKDTree(low[:, :2]).query(bottom[:, :2])[0].min() > STEM_GAP_M
        found[part] = part != main and starts and apart
    return found


def _bottom(xyz: Floats) -> Floats:
    """Return the lowest metre of a part, in canonical order."""
    return np.asarray(xyz[xyz[:, 2] <= xyz[0, 2] + STEM_START_M])


def _groups(xyz: Floats, label: Ints, link: float) -> list[Floats]:
    """Return every part's points, one to a cell of a quarter link: enough for the gaps between parts."""
    order = np.argsort(label, kind="stable")
    pieces = np.split(xyz[order], np.cumsum(np.bincount(label))[:-1])
    return [piece[first_in_cell(from_corner(piece), link / 4)] for piece in pieces]


def _within_reach(groups: list[Floats], hop: Floats, skip: Mask, main: int) -> Mask:
    """Mask of the parts that can be reached from the main one, part by part, by hops that suit their size."""
    keep = np.zeros(len(groups), dtype=bool)
    newest = [main]
    waiting = [int(part) for part in np.flatnonzero(~skip) if part != main]
    while newest:
        keep[newest] = True
        tree = cKDTree(np.concatenate([groups[part] for part in newest]))
        newest = [part for part in waiting if tree.query(groups[part])[0].min() <= hop[part]]
        waiting = [part for part in waiting if part not in newest]
    return keep
