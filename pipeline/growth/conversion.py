"""A reconstructed tree as metamers that can grow on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.errors import ModelError, UsageError
from pipeline.geometry.compiled import compiled
from pipeline.growth.chance import sow
from pipeline.growth.options import GrowthOptions
from pipeline.growth.resampling import Stations, resample
from pipeline.growth.shoots import Arrays, Ways, place_lateral_bud
from pipeline.growth.state import DAMAGED, DORMANT, GROWN, Mask, Metamers
from pipeline.model import Floats, Ints, Skeleton, TreeModel

BUD_WOOD_M = 0.02
"""Diameter from which wood bears no dormant buds."""
BROKEN_M, BROKEN_SHARE = 0.06, 0.5
"""A tip is a broken end from this diameter on, if it also has this share of the thickest of its axis."""
EVER = -1
"""Birth year of wood that was there before the first year."""


class Conversion(NamedTuple):
    """Metamers, and where each of them ends in the tree that they stand for."""

    metamers: Metamers
    stations: Stations


def metamers_of(tree: TreeModel, options: GrowthOptions, *, seed: int) -> Metamers:
    """Make metamers of a reconstructed tree.

    Every axis is resampled to the metamer length. Tips have a terminal bud, but broken ends have not; wood
    thinner than 2 cm has dormant lateral buds by phyllotaxis.

    Parameters
    ----------
    tree : TreeModel
    options : GrowthOptions
    seed : int
        As that of the `Growth` they are for: it turns the buds.

    Raises
    ------
    ModelError
        If the tree has no radii.
    UsageError
        If it has more metamers than `most_metamers`.
    """
    return converted(tree, options, seed=seed).metamers


def converted(tree: TreeModel, options: GrowthOptions, *, seed: int) -> Conversion:
    """Make metamers, and tell where they are from; else as `metamers_of`."""
    _check(tree, options)
    stations = resample(tree, options.metamer_m)
    count = len(stations.parent)
    if count - 1 > options.most_metamers:
        msg = (
            f"the tree has {count - 1:,} metamers of {options.metamer_m:g} m, more than most_metamers, "
            f"{options.most_metamers:,}; raise it or metamer_m"
        )
        raise UsageError(msg)
    metamers = Metamers.empty(room=max(count, 2))
    metamers.count = count
    _fill(metamers, stations)
    _add_buds(metamers, seed, options)
    return Conversion(metamers, stations)


def _check(tree: TreeModel, options: GrowthOptions) -> None:
    if isinstance(tree, Skeleton):
        msg = "the tree is a skeleton without radii; measure them first with `treepipe fit`"
        raise ModelError(msg)
    if not tree.radius.any():
        msg = (
            "all radii of the tree are 0: nothing tells which wood is young; measure them with `treepipe fit`"
        )
        raise ModelError(msg)
    length = float(tree.skeleton.length.sum())
    if length / options.metamer_m > 2.0 * options.most_metamers:
        msg = (
            f"{length:,.0f} m of wood have more metamers of {options.metamer_m:g} m than most_metamers, "
            f"{options.most_metamers:,}; raise it or metamer_m"
        )
        raise UsageError(msg)


def _fill(metamers: Metamers, stations: Stations) -> None:
    """Write what the stations tell into the arrays."""
    tree, parent = metamers.held(), stations.parent
    above = np.maximum(parent, 0)
    tree["end"][:] = stations.end
    tree["begin"][:] = stations.end[above]
    tree["parent"][:], tree["is_lateral"][:], tree["width"][:] = parent, stations.is_lateral, stations.width
    tree["direction"][:] = directions(tree["begin"], tree["end"], parent)
    number = np.arange(len(parent), dtype=np.int32)
    ends, sides = number[1:][~stations.is_lateral[1:]], number[stations.is_lateral]
    tree["terminal_child"][parent[ends]] = ends
    tree["lateral_child"][parent[sides]] = sides
    tree["order"][:] = orders(parent, stations.is_lateral)
    tree["birth_year"][:] = EVER


def directions(begin: Floats, end: Floats, parent: Ints) -> Floats:
    """(M, 3) unit vectors; what has no length goes the way of its parent, the foot that of its first bud."""
    step = end - begin
    size = np.linalg.norm(step, axis=1)
    way = np.divide(step, size[:, None], out=np.zeros_like(step), where=size[:, None] > 0.0)
    stem = np.flatnonzero((parent == 0) & (size > 0.0))
    way[0] = way[stem[0]] if len(stem) else (0.0, 0.0, 1.0)
    for i in np.flatnonzero(size == 0.0)[1:].tolist():
        way[i] = way[parent[i]]
    return np.asarray(way)


@compiled
def orders(parent: Ints, is_lateral: Mask) -> Ints:
    """(M,) side branches passed on the way from the foot."""
    order = np.zeros(len(parent), dtype=np.int32)
    for i in range(1, len(parent)):
        order[i] = order[parent[i]] + (1 if is_lateral[i] else 0)
    return order


def _add_buds(metamers: Metamers, seed: int, options: GrowthOptions) -> None:
    """Give every metamer its two buds: grown, waiting, or not there (damaged)."""
    sow(metamers, seed)
    tree, count = metamers.held(), len(metamers)
    tree["lateral_bud_direction"][0] = tree["direction"][0]
    radians = np.pi / 180.0
    ways = Ways(
        (0.0, 0.0, 0.0, 0.0),
        (options.insertion_deg * radians, options.insertion_spread_deg * radians),
        (options.phyllotaxis_deg * radians, options.phyllotaxis_spread_deg * radians),
    )
    turn_buds(Arrays(*(getattr(metamers, name) for name in Arrays._fields)), count, ways)
    side, end = tree["lateral_child"], tree["terminal_child"]
    tree["lateral_bud_direction"][side >= 0] = tree["direction"][side[side >= 0]]
    young = tree["width"] < BUD_WOOD_M
    young[0] = False
    tree["lateral_bud"][:] = np.where(side >= 0, GROWN, np.where(young, DORMANT, DAMAGED))
    tree["terminal_bud"][:] = np.where(end >= 0, GROWN, np.where(_broken(metamers), DAMAGED, DORMANT))


@compiled
def turn_buds(tree: Arrays, count: int, ways: Ways) -> None:
    """Place the lateral bud of every metamer, one after the other along each axis."""
    tree.phyllotactic_angle[0] = 0.0
    for i in range(1, count):
        tree.phyllotactic_angle[i] = 0.0 if tree.is_lateral[i] else tree.phyllotactic_angle[tree.parent[i]]
        place_lateral_bud(tree, i, ways)


def _broken(metamers: Metamers) -> Mask:
    """(M,) which metamers would be broken ends, were they ends."""
    tree = metamers.held()
    thickest = tree["width"].copy()
    for i in np.flatnonzero(~tree["is_lateral"])[1:].tolist():
        thickest[i] = max(thickest[i], thickest[tree["parent"][i]])
    return np.asarray((tree["width"] >= BROKEN_M) & (tree["width"] > BROKEN_SHARE * thickest))
