"""Where in a picture of bark the corners of a tube lie: around the branch, and along it in metres."""

from __future__ import annotations

import numpy as np

from pipeline.geometry.compiled import compiled
from pipeline.mesh.rings import Index, Rings, chosen
from pipeline.mesh.tube import Tubes
from pipeline.model import Floats, Ints


def wrapped(made: Tubes, around: Rings, tile_m: float) -> Floats:
    """Lay a picture that repeats around tubes.

    Parameters
    ----------
    made : Tubes
    around : Rings
        What the tubes are drawn of.
    tile_m : float
        Side of the picture, metres.

    Returns
    -------
    (F, 3, 2) array of float64
        The second number is the length along the axis, in pictures. The first goes around: a branch bears a
        whole number of pictures, nearest to its mean girth and at least one, so they meet at the seam.
    """
    rings, count = chosen(around, made.kept), np.diff(made.first[:, 2])
    sides = rings.sides
    share = counted(sides) / np.repeat(sides, sides)
    run = np.linalg.norm(np.diff(rings.points, axis=0, prepend=rings.points[:1]), axis=1)
    along, pictures = unrolled(run, rings.corner, made.first[:, 0], tile_m)
    out = laid(made.faces, share, np.repeat(along, sides), np.repeat(pictures, count))
    flat = np.flatnonzero(counted(count) >= np.repeat(count - made.ends, count))  # the ends of the tubes
    turn = 2 * np.pi * share[made.faces[flat]]
    wide = np.repeat(rings.corner, sides)[made.faces[flat]][:, :, None]
    out[flat] = wide / tile_m * np.stack([np.cos(turn), np.sin(turn)], axis=2)
    return out


def counted(sizes: Index) -> Index:
    """Return 0, 1, 2, ... for every group of so many."""
    return np.asarray(np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes))


@compiled
def unrolled(run: Floats, corner: Floats, first: Index, tile_m: float) -> tuple[Floats, Index]:
    """Unroll tubes.

    Parameters
    ----------
    run, corner : (R,) arrays of float64
        Of every ring, the length from the one before and the distance of its corners, metres.
    first : (A + 1,) array of int64
        Where each tube begins.
    tile_m : float

    Returns
    -------
    along : (R,) array of float64
        Length from the foot, in pictures.
    pictures : (A,) array of int64
        How many go around each tube.
    """
    along = np.zeros(len(run))
    pictures = np.ones(len(first) - 1, dtype=np.int64)
    for a in range(len(first) - 1):
        length, wall = 0.0, 0.0
        for k in range(first[a] + 1, first[a + 1]):
            length += run[k]
            wall += (corner[k] + corner[k - 1]) * run[k]
            along[k] = length / tile_m
        if length > 0.0:
            girth = 2 * np.pi * (wall / (2 * length))
            pictures[a] = max(1, round(girth / tile_m))
    return along, pictures


@compiled
def laid(faces: Ints, share: Floats, along: Floats, pictures: Index) -> Floats:
    """(F, 3, 2) places of corners; a face across the seam goes on beyond the last picture.

    Parameters
    ----------
    faces : (F, 3) array of int32
    share, along : (V,) arrays of float64
        How far around and along a vertex is.
    pictures : (F,) array of int64
        How many pictures go around.
    """
    out = np.empty((len(faces), 3, 2))
    for f in range(len(faces)):
        a, b, c = share[faces[f, 0]], share[faces[f, 1]], share[faces[f, 2]]
        seam = max(a, b, c) - min(a, b, c) > 0.5
        for k in range(3):
            u = share[faces[f, k]]
            out[f, k, 0] = (u + 1.0 if seam and u < 0.5 else u) * pictures[f]
            out[f, k, 1] = along[faces[f, k]]
    return out
