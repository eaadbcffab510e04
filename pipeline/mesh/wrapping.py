"""Where in a picture of bark the corners of a tube lie: around the branch, and along it in metres."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pipeline.mesh.rings import Rings
from pipeline.mesh.tube import Tube
from pipeline.model import Floats


def wrapped(made: Sequence[Tube], around: Sequence[Rings], tile_m: float) -> Floats:
    """Lay a picture that repeats around tubes.

    Parameters
    ----------
    made : sequence of Tube
    around : sequence of Rings
        What the tubes are drawn of.
    tile_m : float
        Side of the picture, metres.

    Returns
    -------
    (F, 3, 2) array of float64
        The second number is the length along the axis, in pictures. The first goes around: a branch bears a
        whole number of pictures, nearest to its mean girth and at least one, so they meet at the seam.
    """
    parts = [_one(tube, rings, tile_m) for tube, rings in zip(made, around, strict=True)]
    return np.concatenate([np.zeros((0, 3, 2)), *parts])


def _one(tube: Tube, rings: Rings, tile_m: float) -> Floats:
    """(F, 3, 2) places of the corners of one tube; its ends lie flat in the picture."""
    if not len(tube.faces):
        return np.zeros((0, 3, 2))
    sides, corner = rings.sides[tube.kept], rings.corner[tube.kept]
    run = np.linalg.norm(np.diff(rings.points[tube.kept], axis=0), axis=1)
    along = np.concatenate([[0.0], np.cumsum(run)]) / tile_m
    girth = 2 * np.pi * float(((corner[1:] + corner[:-1]) * run).sum() / (2 * run.sum()))
    share = np.concatenate([np.arange(count) / count for count in sides.tolist()])
    u = share[tube.faces]
    u = u + ((u < 0.5) & (np.ptp(u, axis=1) > 0.5)[:, None])  # a face across the seam goes on beyond 1
    out = np.stack([u * max(1, round(girth / tile_m)), np.repeat(along, sides)[tube.faces]], axis=2)
    ends = tube.faces[len(tube.faces) - tube.ends :]
    turn = 2 * np.pi * share[ends]
    out[len(out) - tube.ends :] = (
        np.repeat(corner, sides)[ends][:, :, None] / tile_m * np.stack([np.cos(turn), np.sin(turn)], axis=2)
    )
    return np.asarray(out)
