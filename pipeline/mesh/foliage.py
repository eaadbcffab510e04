"""Leaves: folded quads or crossing foils around the ends of the twigs, the same for the same seed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.geometry.compiled import compiled
from pipeline.mesh.axes import Index, nodes_of
from pipeline.mesh.options import MeshOptions
from pipeline.mesh.triangles import Mesh, empty
from pipeline.mesh.vector import length, minus, put, row
from pipeline.model import Floats, Ints, TreeModel

GOLDEN_TURN = np.pi * (3.0 - np.sqrt(5.0))
"""From one leaf to the next around the twig: 137.5 degrees, the commonest spiral phyllotaxis."""

PETIOLE_ANGLE = np.radians(50.0)
"""Between twig and petiole."""

PETIOLE = 0.15
"""Length of the petiole, as a share of the leaf's; it is not drawn, so it is short."""

WIDTH = 0.62
"""Width of a leaf, as a share of its length."""

WIDEST = 0.42
"""Where along its length a leaf is widest."""

FOLD = 0.14
"""How far the sides of a leaf stand above its midrib, as a share of its width."""

ROLL = np.radians(40.0)
"""Spread of the leaves' tilt about their midrib."""

SIZES = (0.7, 1.15)
"""Smallest and largest leaf, as shares of `leaf_size_m`."""


class Places(NamedTuple):
    """Where leaves grow: (L, 3) points on the bark's axis and its direction, radius and twig, (L,)."""

    at: Floats
    along: Floats
    radius: Floats
    branch: NDArray[np.int64]
    turn: Floats


class Blades(NamedTuple):
    """Leaves without a shape: base, midrib and upward normal (L, 3), length (L,)."""

    base: Floats
    rib: Floats
    normal: Floats
    length: Floats


def foliage(tree: TreeModel, options: MeshOptions) -> Mesh:
    """Draw leaves around the last `leaf_zone_m` of every branch.

    The petiole stands off the twig; the blade goes on in its direction, drawn down by its weight, and
    turns its upper side to the sky. The last leaf sits on the tip. At every level of detail a quarter of
    the leaves is left, twice as long, each ending where it did.

    Parameters
    ----------
    tree : TreeModel
    options : MeshOptions
        Its `leaves` names the shape.

    Returns
    -------
    Mesh
        Open surfaces, to be seen from both sides; no leaf shares a vertex with another.
    """
    skeleton = tree.skeleton
    generator = np.random.default_rng(options.seed)
    blades, branch = hung(places(tree, options, generator), options, generator)
    chosen = slice(None, None, 4**options.lod)
    blades = Blades(*(column[chosen] for column in blades))
    if not len(blades.length):
        return empty(skeleton.origin, skeleton.crs)
    blades = grown(blades, 2.0**options.lod)
    shapes = [folded(blades)] if options.leaves == "quads" else crossed(blades)
    vertices = np.concatenate(shapes, axis=1).reshape(-1, 3)
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    quads = 4 * np.arange(len(vertices) // 4)
    faces = (quads[:, None, None] + halves).reshape(-1, 3).astype(np.int32)
    of = np.repeat(branch[chosen], 2 * len(shapes)).astype(np.int32)
    return Mesh(vertices, faces, of, skeleton.origin, skeleton.crs, np.ones(len(faces), dtype=bool))


def places(tree: TreeModel, options: MeshOptions, generator: np.random.Generator) -> Places:
    """Spread the leaves of every branch over its last stretch, from the tip down."""
    skeleton, each = tree.skeleton, options.leaves_per_tip
    size = np.array([len(path) for path in skeleton.paths])
    twig = np.flatnonzero(size > 1)
    jitter = generator.uniform(0.0, 1.0, (len(twig), each))
    share = (np.arange(each) - 0.5 + jitter).clip(0)
    share[:, 0] = 0.0
    first = np.concatenate([[0], np.cumsum(size[twig])])
    at, along, radius = spread(
        np.column_stack([skeleton.xyz, tree.radius]), nodes_of(tree, twig), first, share, options.leaf_zone_m
    )
    start = generator.uniform(0.0, 2 * np.pi, (len(twig), 1))
    turn = start + GOLDEN_TURN * np.arange(each) + generator.normal(0.0, 0.2, (len(twig), each))
    return Places(at, unit(along), radius, np.repeat(twig, each), turn.ravel())


@compiled
def spread(
    thick: Floats, node: Ints, first: Index, share: Floats, zone_m: float
) -> tuple[Floats, Floats, Floats]:
    """Go down from the tips of paths.

    Parameters
    ----------
    thick : (N, 4) array of float64
        Position and radius of every node.
    node : (K,) array of int32
        The nodes on the paths, each from foot to tip.
    first : (A + 1,) array of int64
        Where each path begins, and where the last one ends.
    share : (A, L) array of float64
        How far to go on each path, as parts of the zone, of which there are L.
    zone_m : float
        Length of the zone, metres; it is at most four fifths of the path.

    Returns
    -------
    at, along : (A * L, 3) arrays of float64
        The places, and the directions of their segments towards the tip.
    radius : (A * L,) array of float64
    """
    each = share.shape[1]
    at, along, radius = np.empty((share.size, 3)), np.empty((share.size, 3)), np.empty(share.size)
    for a in range(len(share)):
        upward = thick[node[first[a] : first[a + 1]][::-1]]
        last = len(upward) - 1
        arc = np.zeros(last + 1)
        for i in range(last):
            arc[i + 1] = arc[i] + length(minus(row(upward, i + 1), row(upward, i)))
        zone = min(zone_m, 0.8 * arc[last])
        for j in range(each):
            down = zone * share[a, j] / each
            low = np.searchsorted(arc, down, side="right") - 1
            later = min(low + 1, last)
            here = a * each + j
            put(minus(row(upward, later - 1), row(upward, later)), along, here)
            for k in range(4):
                value = upward[low, k]
                if arc[low] != down:
                    value = (upward[later, k] - value) / (arc[later] - arc[low]) * (down - arc[low]) + value
                if k < 3:
                    at[here, k] = value
                else:
                    radius[here] = value
    return at, along, radius


def hung(
    place: Places, options: MeshOptions, generator: np.random.Generator
) -> tuple[Blades, NDArray[np.int64]]:
    """Hang a leaf at every place; return the leaves and the twig of each."""
    count, each = len(place.turn), options.leaves_per_tip
    right = unit(np.cross(place.along, np.eye(3)[np.argmin(np.abs(place.along), axis=1)]))
    ahead = np.cross(place.along, right)
    outward = np.cos(place.turn)[:, None] * right + np.sin(place.turn)[:, None] * ahead
    angle = np.where(np.arange(count) % each == 0, 0.2, 1.0)[:, None] * PETIOLE_ANGLE
    petiole = np.cos(angle) * place.along + np.sin(angle) * outward
    rib = unit((1 - options.leaf_droop) * petiole + options.leaf_droop * np.array([0.0, 0.0, -1.0]))
    length = options.leaf_size_m * generator.uniform(*SIZES, count)
    base = place.at + (place.radius + PETIOLE * length)[:, None] * petiole
    up = np.array([0.0, 0.0, 1.0]) - rib[:, 2:] * rib
    hangs = np.linalg.norm(up, axis=1, keepdims=True) < 0.05  # straight down: it faces away from the twig
    up = unit(np.where(hangs, np.cross(rib, np.cross(outward, rib)), up))
    roll = generator.normal(0.0, ROLL, count)[:, None]
    return Blades(base, rib, np.cos(roll) * up + np.sin(roll) * np.cross(rib, up), length), place.branch


def grown(blades: Blades, factor: float) -> Blades:
    """Make leaves longer by `factor`; their tips stay where they are."""
    back = ((factor - 1) * blades.length)[:, None] * blades.rib
    return blades._replace(base=blades.base - back, length=blades.length * factor)


def folded(blades: Blades) -> Floats:
    """Return (L, 4, 3) corners: base, right, tip, left; the sides stand above the midrib."""
    return kite(blades, np.cross(blades.rib, blades.normal), FOLD * blades.normal)


def crossed(blades: Blades) -> list[Floats]:
    """Return the corners of two flat quads that cross at the midrib."""
    none = np.zeros_like(blades.normal)
    return [kite(blades, side, none) for side in (np.cross(blades.rib, blades.normal), blades.normal)]


def kite(blades: Blades, side: Floats, lift: Floats) -> Floats:
    """Return the (L, 4, 3) corners of kites that reach out to `side` and are lifted there."""
    long = blades.length[:, None]
    middle = blades.base + WIDEST * long * blades.rib
    half, raised = 0.5 * WIDTH * long * side, WIDTH * long * lift
    corners = (blades.base, middle + half + raised, blades.base + long * blades.rib, middle - half + raised)
    return np.stack(corners, axis=1)


def unit(vectors: Floats) -> Floats:
    """Return vectors of length 1; straight up where there is no length."""
    size = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(np.where(size > 1e-9, vectors / np.maximum(size, 1e-9), [0.0, 0.0, 1.0]))
