"""Finding a patch of ground in a cloud that carries no classes.

Ground is what lies lowest, thin, plane to a few centimetres, not steep, and much wider than any
equally thin layer of the tree just above it. A tree that was cut out without its ground has none
of the last: its lowest layer is as wide as the next one, and nothing is found.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.cloud.ground import CELL_M, ROBUST, cell_medians, lowest, on_plane, plan_keys, robust_plane
from pipeline.cloud.order import from_corner
from pipeline.geometry.voxels import cell_keys

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

MAX_SLOPE = 0.5  # rise over run (27 degrees): nothing steeper is searched for
LAYER_M = 0.15  # half thickness within which the first plane gathers its points
MIN_AREA_M2 = 1.0  # anything smaller is a root flare
MIN_WIDTH_M = 0.8  # a patch stretches at least this far in every direction
MIN_POINTS = 30
WIDER = 3.0  # times the plan area of the layers above
SECTION_M = (0.3, 1.3)  # heights above the patch between which those layers are taken
EMPTY_BELOW = 0.05  # share of the patch's cells that may hold points below it
COMPANY_M = 0.5  # a point alone in a cell of this side is a stray shot
MAX_STEPS = 50
STEP_M = 0.6  # a patch grows to cells this near (terrain is not one plane)


def find_ground(xyz: Floats) -> Floats | None:
    """Return the points of a ground patch at the tree's foot, or None where there is none.

    Parameters
    ----------
    xyz : (P, 3) array
        Metres, z up, in canonical order.

    Returns
    -------
    (G, 3) array or None
    """
    xyz = xyz[_in_company(xyz)]
    if len(xyz) < MIN_POINTS:
        return None
    corner = xyz.min(axis=0)
    local = np.round(xyz - corner, 5)
    low = _lowest_cells(local)
    if len(low) * CELL_M**2 < MIN_AREA_M2:
        return None
    plane = robust_plane(low)
    for _ in range(2):  # the first plane leans on each cell's lowest point, the second on its layer
        near = local[np.abs(local[:, 2] - on_plane(plane, local)) <= LAYER_M]
        if len(near) < MIN_POINTS:
            return None
        plane = robust_plane(cell_medians(near))
    if not _is_ground(local, plane):
        return None
    return xyz[_grow(local, plane)]


def _in_company(xyz: Floats) -> Mask:
    """Mask of the points that share their cell of `COMPANY_M` with another: stray shots lie alone."""
    _, cell, count = np.unique(
        cell_keys(from_corner(xyz), COMPANY_M), return_inverse=True, return_counts=True
    )
    return np.asarray(count[cell] > 1)


def _lowest_cells(local: Floats) -> Floats:
    """Return the lowest point of every plan cell that ground could reach from the lowest place of all."""
    _, first = np.unique(plan_keys(local), return_index=True)  # rows go upwards: the first is the lowest
    low = local[first]
    bottom = lowest(local)
    start = low[low[:, 2] >= bottom - 1e-6]
    start = start[np.argmin(start[:, 2])]
    run = np.hypot(*(low[:, :2] - start[:2]).T)
    return np.asarray(low[np.abs(low[:, 2] - start[2]) <= MAX_SLOPE * run + LAYER_M])


def _is_ground(local: Floats, plane: Floats) -> bool:
    """Whether the layer on a plane is flat, wide and lowest, compared with the layers above it."""
    above = local[:, 2] - on_plane(plane, local)
    thick = _half_thickness(above)
    keys = plan_keys(local)
    patch = np.abs(above) <= thick
    here = np.unique(keys[patch])
    if np.hypot(*plane[:2]) > MAX_SLOPE or patch.sum() < MIN_POINTS or _width(local[patch]) < MIN_WIDTH_M:
        return False
    edges = np.arange(*SECTION_M, 2 * thick)
    layers = [len(np.unique(keys[(above >= edge) & (above < edge + 2 * thick)])) for edge in edges]
    under = np.intersect1d(keys[above < -2 * thick - 0.05], here)
    wide = len(here) * CELL_M**2 >= MIN_AREA_M2 and len(here) >= WIDER * float(np.median(layers))
    return wide and len(under) <= EMPTY_BELOW * len(here)


def _half_thickness(above: Floats) -> float:
    """Three robust deviations of the points about the plane, between 3 and 10 cm."""
    near = np.abs(above[np.abs(above) <= LAYER_M])
    return float(np.clip(3 * ROBUST * np.median(near), 0.03, 0.1))


def _width(patch: Floats) -> float:
    """Width of a rectangle that spreads as little as the patch does in its narrow direction."""
    return float(np.sqrt(12 * max(np.linalg.eigvalsh(np.cov(patch[:, :2].T))[0], 0.0)))


def _grow(local: Floats, plane: Floats) -> Mask:
    """Mask of the patch and of the cells that go on from it, where the terrain leaves the plane."""
    keys = plan_keys(local)
    _, first, cell = np.unique(keys, return_index=True, return_inverse=True)
    low = local[first].copy()
    low[:, 2] -= on_plane(plane, low)
    above = local[:, 2] - on_plane(plane, local)
    ours = np.abs(low[:, 2]) <= LAYER_M
    for _ in range(MAX_STEPS):
        rest = np.flatnonzero(~ours)
        away, near = cKDTree(low[ours, :2]).query(low[rest, :2])
        new = rest[(away <= STEP_M) & (np.abs(low[rest, 2] - low[ours, 2][near]) <= LAYER_M)]
        if not len(new):
            break
        ours[new] = True
    thick = _half_thickness(above)
    return np.asarray(ours[cell] & (above - low[cell, 2] <= 2 * thick))
