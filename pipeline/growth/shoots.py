"""Buds with enough resource become shoots: when, how long, and which way."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.growth.allocation import Resource
from pipeline.growth.bound import Limits, is_within, limits_of
from pipeline.growth.chance import chance, lineage
from pipeline.growth.options import GrowthOptions, ShootOptions
from pipeline.growth.state import DAMAGED, DORMANT, GROWN, NO_SUPPORT, Bytes, Mask, Metamers
from pipeline.model import Floats, Ints


class Buds(NamedTuple):
    """Buds that grow: whose, which of the two, and into how many metamers of what length (metres)."""

    metamer: Ints
    is_lateral: Mask
    metamers: Ints
    length: Floats


class Ways(NamedTuple):
    """What decides directions: weights of bud, light, vertical and cut axis; angles and spreads, radians."""

    weight: tuple[float, float, float, float]
    insertion: tuple[float, float]
    phyllotaxis: tuple[float, float]


class Arrays(NamedTuple):
    """The arrays of `Metamers`, as compiled loops take them."""

    begin: Floats
    end: Floats
    direction: Floats
    parent: Ints
    is_lateral: Mask
    terminal_child: Ints
    lateral_child: Ints
    terminal_bud: Bytes
    lateral_bud: Bytes
    lateral_bud_direction: Floats
    phyllotactic_angle: Floats
    order: Ints
    birth_year: Ints
    width: Floats
    support: Ints
    key: NDArray[np.uint64]


Year = tuple[int, Buds, Floats, Floats]


def buds_that_grow(tree: Metamers, resource: Resource, year: int, options: ShootOptions) -> Buds:
    """Choose the buds that have enough.

    A terminal bud needs `terminal_threshold`, a lateral one `lateral_threshold`, and the terminal bud beside
    it must have grown in an earlier year or be damaged.
    """
    count = len(resource.terminal)
    above = tree.terminal_child[:count]
    waited = (above >= 0) & (tree.birth_year[above] < year) | (tree.terminal_bud[:count] == DAMAGED)
    ends = (tree.terminal_bud[:count] == DORMANT) & (resource.terminal >= options.terminal_threshold)
    sides = (tree.lateral_bud[:count] == DORMANT) & waited & (resource.lateral >= options.lateral_threshold)
    metamer = np.concatenate([np.flatnonzero(ends), np.flatnonzero(sides)])
    is_lateral = np.arange(len(metamer)) >= ends.sum()
    got = np.where(is_lateral, resource.lateral[metamer], resource.terminal[metamer])
    number = np.minimum(np.floor(got), options.longest_shoot)
    length = np.full(len(metamer), options.metamer_m)
    if options.length_by == "resource":
        length *= np.minimum(got, options.longest_shoot) / number
    order = np.argsort(metamer, kind="stable")
    return Buds(
        metamer[order].astype(np.int32),
        is_lateral[order],
        number[order].astype(np.int32),
        length[order],
    )


def grow_shoots(
    tree: Metamers, buds: Buds, towards: Floats, pulls: Floats, year: int, options: GrowthOptions
) -> slice:
    """Let buds become metamers; a shoot ends where it would leave the bound or enter the ground.

    Parameters
    ----------
    tree : Metamers
    buds : Buds
    towards : (K, 3) array
        Where each bud has more light.
    pulls : (S + 1, 3) array
        Of every support; the last row is 0.
    year : int
    options : GrowthOptions

    Returns
    -------
    slice
        The numbers of the new metamers.

    References
    ----------
    Eq. 4.6 of the thesis: gamma B + eta O + xi G, B being the bud's direction or the last metamer's; a
    support and a cut axis beside the bud pull as well.
    """
    tree.make_room(int(buds.metamers.sum()))
    first = tree.count
    arrays = Arrays(*(getattr(tree, name) for name in Arrays._fields))
    tree.count = shoot(
        arrays, first, (year, buds, towards, pulls), _ways(year, options), limits_of(tree, options)
    )
    return slice(first, tree.count)


def _ways(year: int, options: ShootOptions) -> Ways:
    up = options.vertical_weight - options.vertical_fall * (year - 1)
    radians = np.pi / 180.0
    return Ways(
        (options.bud_weight, options.light_weight, up, options.takeover_weight),
        (options.insertion_deg * radians, options.insertion_spread_deg * radians),
        (options.phyllotaxis_deg * radians, options.phyllotaxis_spread_deg * radians),
    )


@compiled
def shoot(tree: Arrays, count: int, this: Year, ways: Ways, limits: Limits) -> int:
    """Grow every bud into its metamers; the number of metamers then."""
    year, buds, towards, pulls = this
    for b in range(len(buds.metamer)):
        below, is_lateral = buds.metamer[b], buds.is_lateral[b]
        for _ in range(buds.metamers[b]):
            way = heading(tree, below, is_lateral, (towards[b], pulls), ways)
            tip = tree.end[below] + buds.length[b] * way
            if not is_within((tip[0], tip[1], tip[2]), limits):
                break
            tree.begin[count], tree.end[count], tree.direction[count] = tree.end[below], tip, way
            tree.birth_year[count], tree.width[count] = year, 0.0
            attach(tree, count, below, is_lateral)
            place_lateral_bud(tree, count, ways)
            below, is_lateral = count, False
            count += 1
    return count


@compiled
def heading(tree: Arrays, below: int, is_lateral: bool, pull: tuple[Floats, Floats], ways: Ways) -> Floats:
    """(3,) unit vector of the next metamer; the bud's own where all pulls cancel out."""
    gamma, eta, xi, takeover = ways.weight
    towards, pulls = pull
    own = tree.lateral_bud_direction[below] if is_lateral else tree.direction[below]
    way = gamma * own + eta * towards
    way[2] += xi
    if not is_lateral:
        way += pulls[tree.support[below]]
    elif tree.terminal_bud[below] == DAMAGED:
        way += takeover * tree.direction[below]
    size = np.sqrt((way * way).sum())
    turned: Floats = way / size if size > 1e-9 else own.copy()
    return turned


@compiled
def attach(tree: Arrays, new: int, below: int, is_lateral: bool) -> None:
    """Join a metamer to the one below it, with two dormant buds at its end."""
    tree.parent[new], tree.is_lateral[new] = below, is_lateral
    tree.terminal_child[new] = tree.lateral_child[new] = -1
    tree.terminal_bud[new] = tree.lateral_bud[new] = DORMANT
    tree.key[new] = lineage(tree.key[below], is_lateral)
    if is_lateral:
        tree.lateral_child[below], tree.lateral_bud[below] = new, GROWN
        tree.order[new], tree.support[new] = tree.order[below] + 1, NO_SUPPORT
        tree.phyllotactic_angle[new] = 0.0
    else:
        tree.terminal_child[below], tree.terminal_bud[below] = new, GROWN
        tree.order[new], tree.support[new] = tree.order[below], tree.support[below]
        tree.phyllotactic_angle[new] = tree.phyllotactic_angle[below]


@compiled
def place_lateral_bud(tree: Arrays, new: int, ways: Ways) -> None:
    """Turn the lateral bud on from the one below around the axis, and away from it.

    The first bud of a side branch turns on from the side that looks along the parent's axis; that of a stem,
    where no side is known, stands anywhere.
    """
    below, axis = tree.parent[new], tree.direction[new]
    side = tree.direction[below] if tree.is_lateral[new] else tree.lateral_bud_direction[below]
    side = side - (side * axis).sum() * axis
    size = np.sqrt((side * side).sum())
    turn = ways.phyllotaxis[0] + ways.phyllotaxis[1] * chance(tree.key[new], 0)
    if size < 1e-6:
        side = np.zeros(3)
        side[np.argmin(np.abs(axis))] = 1.0
        side -= (side * axis).sum() * axis
        size = np.sqrt((side * side).sum())
        turn = np.pi * chance(tree.key[new], 0)
    side /= size
    lean = ways.insertion[0] + ways.insertion[1] * chance(tree.key[new], 1)
    around = np.cos(turn) * side + np.sin(turn) * np.cross(axis, side)
    tree.lateral_bud_direction[new] = np.cos(lean) * axis + np.sin(lean) * around
    tree.phyllotactic_angle[new] += np.degrees(turn)
