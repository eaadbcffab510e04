"""Quick bark for pictures: a prism along every branch, without the care that solids of files take."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pipeline.growth.state import Mask
from pipeline.model import Floats, Ints, TreeModel

STOUT_SIDES, SLENDER_SIDES = 8, 3
THINNEST = 0.0007
"""Radius that is drawn at least, as a share of the tree's extent: thinner wood is not seen."""
STOUT = 3.0
"""Branches that are somewhere so many times thicker than that are stout."""


class Rods(NamedTuple):
    """Triangles with normals that are smooth around the wood.

    Attributes
    ----------
    vertices, normals : (V, 3) arrays of float32
    faces : (F, 3) array of int64
    node : (V,) array of int32
        The node of the tree that each vertex belongs to.
    """

    vertices: Floats
    normals: Floats
    faces: Ints
    node: Ints


def rods(tree: TreeModel) -> Rods:
    """Draw a tree, branch by branch; a ring of corners stands at every node, and where a branch begins."""
    node, place, radius, first = _rings(tree)
    least = extent_of(tree.skeleton.xyz) * THINNEST
    along = _ways(place, first)
    across = _across(along, first)
    widest = np.maximum.reduceat(radius, np.flatnonzero(first))[np.cumsum(first) - 1]
    stout = widest > STOUT * least
    radius = np.maximum(radius, least)
    parts = []
    for which, sides in ((stout, STOUT_SIDES), (~stout, SLENDER_SIDES)):
        rings = (place[which], radius[which], along[which], across[which])
        parts.append(_prisms(rings, first[which], node[which], sides))
    return _joined(*parts)


def extent_of(points: Floats) -> float:
    """Longest side of the box around points, metres."""
    return float(np.ptp(points, axis=0).max())


def _prisms(rings: tuple[Floats, Floats, Floats, Floats], first: Mask, node: Ints, sides: int) -> Rods:
    """Draw branches of so many sides from place, radius, way and across of their rings."""
    place, radius, along, across = rings
    turn = 2.0 * np.pi * np.arange(sides) / sides
    other = np.cross(along, across)
    normals = across[:, None] * np.cos(turn)[:, None] + other[:, None] * np.sin(turn)[:, None]
    vertices = place[:, None] + radius[:, None, None] * normals
    return Rods(
        vertices.reshape(-1, 3).astype(np.float32),
        normals.reshape(-1, 3).astype(np.float32),
        _faces(first, sides),
        np.repeat(node, sides),
    )


def _joined(one: Rods, other: Rods) -> Rods:
    faces = np.concatenate([one.faces, other.faces + len(one.vertices)])
    return Rods(
        np.concatenate([one.vertices, other.vertices]),
        np.concatenate([one.normals, other.normals]),
        faces,
        np.concatenate([one.node, other.node]),
    )


def _rings(tree: TreeModel) -> tuple[Ints, Floats, Floats, Mask]:
    """Return node, place and radius of all rings, branch by branch, and which are the first of theirs."""
    graph = tree.skeleton
    order = np.argsort(graph.branch, kind="stable")
    begins = np.flatnonzero(np.diff(graph.branch[order], prepend=-1))
    heads = order[begins]
    borne = graph.parent[heads] >= 0
    at, head = begins[borne], heads[borne]
    node = np.insert(order, at, head)
    place = np.insert(graph.xyz[order], at, graph.xyz[graph.parent[head]], axis=0)
    radius = np.insert(tree.radius[order], at, tree.start_radius[head])
    first = np.zeros(len(node), dtype=bool)
    first[begins + np.cumsum(borne) - borne] = True
    return node.astype(np.int32), place, np.asarray(radius), first


def _ways(place: Floats, first: Mask) -> Floats:
    """(R, 3) unit vectors along the axes, at bends the mean of both sides."""
    step = np.diff(place, axis=0)
    size = np.linalg.norm(step, axis=1, keepdims=True)
    step = np.where(first[1:, None], 0.0, step / np.maximum(size, 1e-12))
    way = np.zeros_like(place)
    way[1:] += step
    way[:-1] += step
    size = np.linalg.norm(way, axis=1, keepdims=True)
    return np.asarray(np.where(size > 1e-9, way / np.maximum(size, 1e-9), [0.0, 0.0, 1.0]))


def _across(along: Floats, first: Mask) -> Floats:
    """(R, 3) unit vectors across the axes; one direction to a branch, so that bark does not twist."""
    starts = np.flatnonzero(first)
    branch = np.cumsum(first) - 1
    mean = np.add.reduceat(along, starts)
    away = np.eye(3)[np.argmin(np.abs(mean), axis=1)][branch]
    across = np.cross(along, away)
    size = np.linalg.norm(across, axis=1, keepdims=True)
    spare = np.cross(along, np.roll(away, 1, axis=1))
    across = np.where(size > 1e-3, across, spare)
    return np.asarray(across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-9))


def _faces(first: Mask, sides: int) -> Ints:
    """(F, 3) two triangles for each side between two rings of a branch."""
    upper = np.flatnonzero(~first)[:, None] * sides
    here = np.arange(sides)
    after = (here + 1) % sides
    a, b, c, d = upper - sides + here, upper - sides + after, upper + after, upper + here
    return np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], 2).reshape(-1, 3)
