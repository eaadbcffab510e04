"""Leaves: folded quads or crossing foils around the ends of the twigs, the same for the same seed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pipeline.mesh.options import MeshOptions
from pipeline.mesh.triangles import Mesh, empty
from pipeline.model import Floats, TreeModel

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
    paths = [(b, path) for b, path in enumerate(tree.skeleton.paths) if len(path) > 1]
    each = options.leaves_per_tip
    at, along, radius = (np.zeros((len(paths), each, *shape)) for shape in ((3,), (3,), ()))
    jitter = generator.uniform(0.0, 1.0, (len(paths), each))
    for row, (_, path) in enumerate(paths):
        upward = tree.skeleton.xyz[path[::-1]]
        arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(upward, axis=0), axis=1))])
        zone = min(options.leaf_zone_m, 0.8 * arc[-1])
        down = zone * (np.arange(each) - 0.5 + jitter[row]).clip(0) / each
        down[0] = 0.0
        for k in range(3):
            at[row, :, k] = np.interp(down, arc, upward[:, k])
        later = np.searchsorted(arc, down, side="right").clip(1, len(arc) - 1)
        along[row] = upward[later - 1] - upward[later]
        radius[row] = np.interp(down, arc, tree.radius[path[::-1]])
    first = generator.uniform(0.0, 2 * np.pi, (len(paths), 1))
    turn = first + GOLDEN_TURN * np.arange(each) + generator.normal(0.0, 0.2, (len(paths), each))
    branch = np.repeat([b for b, _ in paths], each)
    return Places(at.reshape(-1, 3), unit(along.reshape(-1, 3)), radius.ravel(), branch, turn.ravel())


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
