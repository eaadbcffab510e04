"""From beams to returns: where each comes from, what the scanner makes of it, and how wrong that is.

The rays of a beam are sorted by range. Where the next one is farther than the gap, another return
begins; a return's range is the mean of its rays. A beam that meets two twigs within the gap so gives
a point between them, as real scanners do.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.model import Floats, Ints, TreeModel
from pipeline.synthetic.beams import BeamOptions, Beams, sub_rays
from pipeline.synthetic.raycaster import Raycaster
from pipeline.synthetic.scene import LEAF, WOOD, Scene

BEAMS_AT_ONCE = 50_000
"""Keeps memory below a few hundred megabytes."""
MARK_M = 0.01
"""The segment of a return is found by marks on the axes, so far apart."""
APART_M = 1000.0
"""Branches are moved so far from each other in a fourth dimension that none is taken for another."""
SWAYS = 6.0
"""How often the crown sways while a scan lasts."""


@dataclass(frozen=True, eq=False)
class Returns:
    """What is true of every return, in the order of the cloud's points.

    Parameters
    ----------
    segment, branch, order : (R,) array of int32
        Cylinder of the truth file, its branch and order; of a leaf, those of its twig; -1 elsewhere.
    surface : (R,) array of uint8
        Index into `SURFACES`.
    true_xyz : (R, 3) array of float64
        The point of the surface that was hit, in the coordinates of the cloud.
    true_range_m : (R,) array of float64
        From the scanner to there.
    range_error_m : (R,) array of float32
        What the scanner measures beyond it: noise, and the mixture of several surfaces.
    spread_m : (R,) array of float32
        Between the nearest and the farthest ray of the return: large at edges.
    hits : (R,) array of uint8
        Rays of the beam in this return.
    incidence_deg : (R,) array of float32
        Between the beam and the surface's normal.
    scanner : (R,) array of uint8
        Station or flight line.
    return_number, number_of_returns : (R,) array of uint8
        As LAS counts them, from 1.
    """

    segment: Ints
    branch: Ints
    order: Ints
    surface: NDArray[np.uint8]
    true_xyz: Floats
    true_range_m: Floats
    range_error_m: NDArray[np.float32]
    spread_m: NDArray[np.float32]
    hits: NDArray[np.uint8]
    incidence_deg: NDArray[np.float32]
    scanner: NDArray[np.uint8]
    return_number: NDArray[np.uint8]
    number_of_returns: NDArray[np.uint8]

    def __len__(self) -> int:
        return len(self.segment)


class Echoes(NamedTuple):
    """Returns as they come back, (R,) each but `place` (R, 3): the ray nearest to the mean stands for all."""

    beam: NDArray[np.int64]
    mean: Floats
    spread: Floats
    hits: NDArray[np.int64]
    face: NDArray[np.int64]
    range: Floats
    place: Floats

    def take(self, chosen: NDArray[np.bool_]) -> Echoes:
        """Return those of a mask."""
        columns: list[NDArray[Any]] = [column[chosen] for column in self]
        return Echoes(*columns)


def echoes_of(beams: Beams, scene: Scene, options: BeamOptions) -> Echoes:
    """Follow all beams to the scene, a part of them at a time."""
    caster = Raycaster(scene.vertices, scene.faces)
    parts = []
    for first in range(0, max(1, len(beams.origin)), BEAMS_AT_ONCE):
        some = slice(first, first + BEAMS_AT_ONCE)
        found = _echoes(beams.origin[some], beams.direction[some], caster, options)
        parts.append(found._replace(beam=found.beam + first))
    return Echoes(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _echoes(origin: Floats, direction: Floats, caster: Raycaster, options: BeamOptions) -> Echoes:
    """Cast the rays of some beams, and gather those that end near each other."""
    start, heading = sub_rays(origin, direction, options)
    distance, face = caster.cast(start, heading)
    distance[distance > options.max_range_m] = np.inf
    by_range = np.argsort(distance.reshape(-1, options.sub_rays), axis=1, kind="stable")
    ray = (by_range + options.sub_rays * np.arange(len(origin))[:, None]).ravel()
    ray = ray[np.isfinite(distance[ray])]
    far, beam = distance[ray], ray // options.sub_rays
    begins = np.ones(len(ray), dtype=bool)
    begins[1:] = (np.diff(beam) > 0) | (np.diff(far) > options.gap_m)
    first = np.flatnonzero(begins)
    if not len(first):
        none = np.zeros(0, dtype=np.int64)
        return Echoes(none, np.zeros(0), np.zeros(0), none, none, np.zeros(0), np.zeros((0, 3)))
    hits = np.diff(np.append(first, len(ray)))
    mean = np.add.reduceat(far, first) / hits
    group = np.repeat(np.arange(len(first)), hits)
    chosen = ray[np.lexsort((np.abs(far - mean[group]), group))[first]]
    place = start[chosen] + distance[chosen, None] * heading[chosen]
    spread = far[first + hits - 1] - far[first]
    return Echoes(beam[first], mean, spread, hits, face[chosen], distance[chosen], place)


def recorded(echoes: Echoes, options: BeamOptions) -> tuple[Echoes, NDArray[np.int64], NDArray[np.int64]]:
    """Drop what is too weak and what comes too late; return the rest, its number and how many there are."""
    strong = echoes.hits >= options.least_share * options.sub_rays
    kept = echoes.take(strong)
    number = _rank(kept.beam)
    early = number <= options.max_returns
    kept, number = kept.take(early), number[early]
    count = np.bincount(kept.beam)[kept.beam] if len(number) else number
    return kept, number, count


def _rank(beam: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the place of every echo among those of its beam, from 1."""
    new = np.append(True, np.diff(beam) > 0)[: len(beam)]
    first = np.maximum.accumulate(np.where(new, np.arange(len(beam)), 0))
    return np.asarray(np.arange(len(beam)) - first + 1)


def swayed(place: Floats, share: Floats, height: float, wind_m: float, rng: Generator) -> Floats:
    """Return the (R, 3) shifts of what sways in the wind: more the higher it is, to and fro in time."""
    heading, phase = rng.uniform(0, 2 * np.pi, 2)
    stroke = wind_m * np.clip(place[:, 2] / height, 0, 1) ** 2 * np.sin(2 * np.pi * SWAYS * share + phase)
    return np.asarray(stroke[:, None] * np.array([np.cos(heading), np.sin(heading), 0.0]))


def segments(place: Floats, face: NDArray[np.int64], scene: Scene) -> Ints:
    """Return the node whose segment of the hit branch is nearest to every place; -1 off the tree.

    Parameters
    ----------
    place : (R, 3) array of float64
        Metres from the foot.
    face : (R,) array of int64
    scene : Scene
    """
    found = np.full(len(place), -1, dtype=np.int32)
    own = (scene.surface[face] == WOOD) | (scene.surface[face] == LEAF)
    marks, node = _marks(scene.tree)
    where = np.column_stack([place[own] + scene.foot, APART_M * scene.branch[face[own]]])
    found[own] = node[cKDTree(marks).query(where)[1]]
    return found


def _marks(tree: TreeModel) -> tuple[Floats, Ints]:
    """Return places on all axes with the branch as a fourth coordinate, and the node of each."""
    skeleton = tree.skeleton
    count = np.maximum(1, np.ceil(skeleton.length[1:] / MARK_M)).astype(np.int64)
    node = np.repeat(np.arange(1, len(skeleton), dtype=np.int32), count)
    share = (np.arange(len(node)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / count[node - 1]
    start = skeleton.xyz[skeleton.parent[node]]
    at = start + share[:, None] * (skeleton.xyz[node] - start)
    return np.column_stack([at, APART_M * skeleton.branch[node]]), node


def incidence(direction: Floats, face: NDArray[np.int64], scene: Scene) -> Floats:
    """Return the (R,) angles between beams and the normals of the faces they hit, in degrees."""
    a, b, c = (scene.vertices[scene.faces[face, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    size = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    return np.asarray(np.degrees(np.arccos(np.clip(np.abs((normal * direction).sum(axis=1)) / size, 0, 1))))
