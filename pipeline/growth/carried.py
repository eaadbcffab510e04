"""A tree as it was scanned, with what has grown on it since."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.numbering import number_by_paths, renumbered
from pipeline.growth.bent import unbent
from pipeline.growth.conversion import Conversion, converted
from pipeline.growth.outlook import described, trunk_of
from pipeline.growth.resampling import Stations
from pipeline.growth.simulation import Growth
from pipeline.model import ALLOMETRIC, Floats, Ints, Skeleton, TreeModel

ROUNDING = 1e-9
SIDE_YOUNG, SIDE, END_YOUNG, ONWARD = 1, 2, 3, 4
"""Which child of a node goes on: the highest; old wood keeps its branches."""


class _Link(NamedTuple):
    """What has become of the metamers of the tree that was scanned.

    Attributes
    ----------
    first : (M,) array
        The number that each metamer of now had at first, -1 for young ones.
    row : (K,) array
        The number that each metamer of then has now, -1 where it is gone.
    gain : (K,) array
        What each has gained, as a power of its diameter.
    power : float
        That power.
    """

    first: Ints
    row: Ints
    gain: Floats
    power: float


class _Places(NamedTuple):
    """Where the nodes of the new tree come from, and their numbers: kept ones, ends on segments, shoots.

    Attributes
    ----------
    kept : (A,) array
        Nodes of the old tree.
    ends : (B,) array
        Metamers of then that end on a segment and need a node there, by segment and along it.
    young : (C,) array
        Metamers of now.
    node, metamer : (N,) and (M,) arrays
        The new number of every node of then, and of every metamer of now; -1 for none.
    """

    kept: Ints
    ends: Ints
    young: Ints
    node: Ints
    metamer: Ints


class _Nodes(NamedTuple):
    """Nodes of the new tree, in any order; the rank tells which child goes on."""

    xyz: Floats
    parent: Ints
    radius: Floats
    source: NDArray[np.uint8]
    rmse: Floats
    rank: Ints


def carried(
    tree: TreeModel,
    growth: Growth,
    *,
    known: Mapping[str, Any] | None = None,
    origin: Conversion | None = None,
) -> TreeModel:
    """Return a tree with what has grown on it, and without what was cut or shed.

    Its nodes stay where they are to the last bit, also where wood has thickened; only what has been bent
    moves. A node is added on a segment where a shoot begins or a cut ends. Wood never becomes thinner; what
    has become thicker, and all that is new, is allometric.

    Parameters
    ----------
    tree : TreeModel
        What the growth began with, by `metamers_of` or as a `Carrying`.
    growth : Growth
    known : mapping, optional
        More of what metadata's ``growth`` shall tell (species, ...).
    origin : Conversion, optional
        What the growth began with, where it is at hand; else it is made again.

    Returns
    -------
    TreeModel
        Numbered path by path; the tree itself, but for metadata, where nothing has happened.
    """
    origin = origin or converted(tree, growth.options, seed=growth.seed)
    link = _linked(origin, growth)
    places = _places(origin.stations, link, growth.metamers.held()["parent"])
    xyz = unbent(tree.skeleton.xyz, origin, growth.metamers, link.row)
    graph = tree.skeleton
    changes = len(places.ends) or len(places.young) or len(places.kept) < len(tree)
    if not changes and xyz is graph.xyz and not link.gain.any():
        return replace(tree, metadata=described(tree, graph, growth, known))
    nodes = _nodes(tree, xyz, origin.stations, link, places, growth)
    order = _numbered(nodes)
    skeleton = Skeleton(
        nodes.xyz[order], renumbered(nodes.parent, order), graph.origin, graph.crs, graph.metadata
    )
    grown = TreeModel(
        skeleton,
        nodes.radius[order],
        nodes.source[order],
        nodes.rmse[order],
        None,
        described(tree, skeleton, growth, known),
    )
    gain = link.gain[origin.stations.holder]
    return replace(grown, trunk=trunk_of(tree, grown, gain, link.power))


def _linked(origin: Conversion, growth: Growth) -> _Link:
    """Find the metamers of then among those of now, by their keys."""
    then, now = origin.metamers.held(), growth.metamers.held()
    order = np.argsort(then["key"])
    at = np.minimum(np.searchsorted(then["key"][order], now["key"]), len(order) - 1)
    first = np.where(then["key"][order][at] == now["key"], order[at], -1).astype(np.int32)
    row = np.full(len(order), -1, dtype=np.int32)
    row[first[first >= 0]] = np.flatnonzero(first >= 0)
    power = growth.options.pipe_exponent
    width = np.where(row >= 0, now["width"][row], then["width"])
    gain = np.where(width > (1.0 + ROUNDING) * then["width"], width**power - then["width"] ** power, 0.0)
    return _Link(first, row, gain, power)


def _places(stations: Stations, link: _Link, parent: Ints) -> _Places:
    """Decide which nodes there are."""
    young = np.flatnonzero(link.first < 0).astype(np.int32)
    kept = np.flatnonzero(link.row[stations.holder] >= 0).astype(np.int32)
    ends = _ends(stations, link, parent[young])
    node = np.full(len(stations.holder), -1, dtype=np.int32)
    node[kept] = np.arange(len(kept))
    metamer = np.full(len(link.first), -1, dtype=np.int32)
    at_node = (link.first >= 0) & (stations.share[link.first] >= 1.0)
    metamer[at_node] = node[stations.segment[link.first[at_node]]]
    metamer[link.row[ends]] = len(kept) + np.arange(len(ends))
    metamer[young] = len(kept) + len(ends) + np.arange(len(young))
    return _Places(kept, ends, young, node, metamer)


def _ends(stations: Stations, link: _Link, bearing: Ints) -> Ints:
    """(B,) metamers of then that need a node at their end: a shoot begins there, or the axis ends now."""
    bears = np.zeros(len(link.first), dtype=bool)
    bears[bearing] = True
    alive = link.row >= 0
    follows = np.flatnonzero(~stations.is_lateral[1:]) + 1
    cut = np.zeros(len(alive), dtype=bool)
    cut[stations.parent[follows]] = ~alive[follows]
    cut &= ~alive[stations.holder[stations.segment]]
    metamer = np.flatnonzero(alive & (stations.share < 1.0) & (bears[link.row] | cut))
    order = np.lexsort((stations.share[metamer], stations.segment[metamer]))
    return metamer[order].astype(np.int32)


def _nodes(
    tree: TreeModel, xyz: Floats, stations: Stations, link: _Link, places: _Places, growth: Growth
) -> _Nodes:
    """Gather what is left of the tree, the ends on its segments, and the shoots."""
    now, young, ends = growth.metamers.held(), places.young, places.ends
    segment, share = stations.segment[ends], stations.share[ends]
    between = tree.start_radius[segment] * (1.0 - share) + tree.radius[segment] * share
    of = np.concatenate([places.kept, segment])  # whose source and error a node has
    gain = link.gain[np.concatenate([stations.holder[places.kept], ends])]
    was = np.concatenate([tree.radius[places.kept], between])
    thick = np.maximum(0.5 * ((2.0 * was) ** link.power + gain) ** (1.0 / link.power), was)
    parent, rank = _onward(tree, stations, places)
    end = now["end"]
    return _Nodes(
        np.concatenate([xyz[places.kept], end[link.row[ends]], end[young]]),
        np.concatenate([parent, places.metamer[now["parent"][young]]]),
        np.concatenate([np.where(gain > 0.0, thick, was), now["width"][young] / 2.0]),
        np.concatenate(
            [np.where(gain > 0.0, ALLOMETRIC, tree.radius_source[of]), np.full(len(young), ALLOMETRIC)]
        ).astype(np.uint8),
        np.concatenate([np.where(gain > 0.0, np.nan, tree.radius_rmse[of]), np.full(len(young), np.nan)]),
        np.concatenate([rank, np.where(now["is_lateral"][young], SIDE_YOUNG, END_YOUNG)]).astype(np.int32),
    )


def _onward(tree: TreeModel, stations: Stations, places: _Places) -> tuple[Ints, Ints]:
    """Return the parents of kept nodes and of ends on segments, and which of them go on."""
    graph, kept, segment = tree.skeleton, places.kept, stations.segment[places.ends]
    number = len(kept) + np.arange(len(segment))
    begins = np.diff(segment, prepend=-1) != 0
    base = graph.parent[segment]
    parent_end = np.where(begins, places.node[base], number - 1)
    rank_end = np.where(~begins | (graph.continuation[base] == segment), ONWARD, SIDE)
    parent = np.where(graph.parent[kept] >= 0, places.node[graph.parent[kept]], -1)
    rank = np.where(graph.branch_start[kept], SIDE, ONWARD)
    last = np.full(len(tree), -1)
    last[segment] = number  # of several on a segment, the last stays
    after = last[kept] >= 0
    parent[after], rank[after] = last[kept][after], ONWARD
    return (
        np.concatenate([parent, parent_end]).astype(np.int32),
        np.concatenate([rank, rank_end]).astype(np.int32),
    )


def _numbered(nodes: _Nodes) -> NDArray[np.int64]:
    """Order nodes path by path: the child of highest rank goes on, of equals the thickest."""
    order = np.lexsort((-np.arange(len(nodes.rank)), nodes.radius, nodes.rank))
    order = order[nodes.parent[order] >= 0]
    ahead = np.full(len(nodes.rank), -1, dtype=np.int64)
    ahead[nodes.parent[order]] = order  # the last of each parent stays
    return number_by_paths(nodes.parent, ahead)
