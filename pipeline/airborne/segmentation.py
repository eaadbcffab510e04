"""From an airborne cloud to single trees: terrain, vegetation, canopy, crowns, and their points.

What is said of a tree depends on the points within 20 m of its apex alone, so that a tile cut into
cells with that much overlap gives the same trees as the whole tile, to the bit.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from scipy import ndimage

from pipeline.airborne.canopy import canopy
from pipeline.airborne.crowns import METHODS, CrownOptions
from pipeline.airborne.ground import GROUND, Terrain, terrain
from pipeline.airborne.raster import STEPS, Grid, Mask, Raster, snapped
from pipeline.airborne.tree import AirborneTree, Positions, Scene, described
from pipeline.airborne.vegetation import VegetationOptions, vegetation
from pipeline.model import Floats, PointCloud

__all__ = ["AirborneTree", "SegmentationOptions", "Segmented", "segment"]

BUILDING = 6
PLANTS = (3, 4, 5)  # low, medium and high vegetation: believed
NO_PLANTS = (
    2,
    6,
    7,
    9,
    13,
    14,
    17,
    18,
    26,
)  # ground, building, noise, water, wires, bridges, civil structures
NOISE = (7, 18)
NO_TERRAIN = (6, 7, 9, 14, 17, 18, 26)  # among these no filter looks for ground
NEAR_BUILDING_M = 1.5
FEWEST = 20  # a cloud of fewer points holds no tree


class SegmentationOptions(VegetationOptions, CrownOptions):
    """Which points are vegetation, and how they are shared out to trees."""

    detector: Literal["prominence", "maxima", "peaks"] = Field(
        default="prominence", description="how crowns are told apart"
    )
    cell_m: float = Field(
        default=0.5, ge=0.1, le=5, description="side of a cell of terrain and canopy in metres"
    )
    smooth_cells: float = Field(
        default=0.6, ge=0, le=5, description="standard deviation of the canopy's smoothing in cells"
    )
    min_height_m: float = Field(
        default=2.0, ge=0.5, le=20, description="lowest crown point above the ground in metres"
    )
    max_height_m: float = Field(
        default=80.0, ge=5, le=150, description="highest believable point above the ground in metres"
    )
    understory: bool = Field(default=False, description="look for small trees below the canopy as well")


@dataclass(frozen=True, eq=False)
class Segmented:
    """What an airborne cloud was found to hold.

    Parameters
    ----------
    trees : tuple of AirborneTree
        By world x of the apex, then y.
    terrain : Raster
        Height of the ground, local, in metres.
    vegetation : (P,) array of bool
        The points that are vegetation.
    """

    trees: tuple[AirborneTree, ...]
    terrain: Raster
    vegetation: NDArray[np.bool_] = field(repr=False)


def segment(
    cloud: PointCloud, *, ground: PointCloud | None = None, options: SegmentationOptions | None = None
) -> Segmented:
    """Find the trees of an airborne cloud.

    Parameters
    ----------
    cloud : PointCloud
        With ``classification`` and ``return_number`` where they are known.
    ground : PointCloud, optional
        Further points that are ground, in the same reference system.
    options : SegmentationOptions, optional

    Returns
    -------
    Segmented
        Without trees where there is no vegetation, or fewer than 20 points.
    """
    options = options or SegmentationOptions()
    xyz, origin = snapped(cloud.xyz, cloud.origin)
    kinds = _attribute(cloud, "classification")
    grid = Grid.over(xyz, origin, options.cell_m)
    soil = _terrain(xyz, kinds, origin, ground, grid)
    height = soil.above(xyz)
    plants = _plants(xyz, origin, kinds, height, options)
    if len(xyz) < FEWEST:
        plants[:] = False
    cells = grid.cells(xyz)
    near = _widened(_occupied(cells[kinds == BUILDING], grid), NEAR_BUILDING_M / grid.cell_m)
    scene = Scene(
        xyz, height, cells, _attribute(cloud, "return_number") <= 1, near, soil, origin - cloud.origin
    )
    trees: list[AirborneTree] = []
    for members, flag in _members(scene, plants, grid, options):
        trees.append(described(scene, members, flag))
    trees.sort(key=lambda t: tuple(t.apex))
    raster = Raster(soil.raster.values + scene.shift[2], soil.raster.corner + scene.shift[:2], grid.cell_m)
    return Segmented(tuple(trees), raster, plants)


def _attribute(cloud: PointCloud, name: str) -> NDArray[np.int64]:
    """(P,) an attribute as whole numbers, 0 where the cloud has none."""
    held = cloud.attributes.get(name)
    return np.zeros(len(cloud), np.uint8) if held is None else np.asarray(held)


def _terrain(
    xyz: Floats, kinds: NDArray[np.int64], origin: Floats, ground: PointCloud | None, grid: Grid
) -> Terrain:
    is_ground, usable = kinds == GROUND, ~np.isin(kinds, NO_TERRAIN)
    if ground is None or not len(ground):
        return terrain(xyz, is_ground, usable, grid)
    more = np.rint((ground.xyz + (ground.origin - origin)) * STEPS) / STEPS
    low, size = grid.corner, np.array(grid.shape[::-1]) * grid.cell_m
    more = more[((more[:, :2] >= low) & (more[:, :2] < low + size)).all(axis=1)]
    known = np.ones(len(more), dtype=bool)
    return terrain(
        np.concatenate([xyz, more]),
        np.concatenate([is_ground, known]),
        np.concatenate([usable, known]),
        grid,
    )


def _plants(
    xyz: Floats, origin: Floats, kinds: NDArray[np.int64], height: Floats, options: SegmentationOptions
) -> Mask:
    """(P,) mask of the vegetation: classed so, or found to be by its shape."""
    with np.errstate(invalid="ignore"):  # no height where there is no ground
        tall = (height > options.min_height_m) & (height <= options.max_height_m)
    out = tall & np.isin(kinds, PLANTS)
    asked = np.flatnonzero(tall & ~out & ~np.isin(kinds, NO_PLANTS))
    out[asked] = vegetation(xyz, origin, options, asked)
    return np.asarray(out)


def _occupied(cells: NDArray[np.int32], grid: Grid) -> Mask:
    mask = np.zeros(grid.shape[0] * grid.shape[1], dtype=bool)
    mask[cells] = True
    return mask.reshape(grid.shape)


def _widened(mask: Mask, cells: float) -> Mask:
    """Mask of the cells within so many cells of the mask's, laid flat."""
    if not mask.any():
        return mask.ravel()
    reach = int(cells)
    row, col = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    return np.asarray(ndimage.binary_dilation(mask, row**2 + col**2 <= cells**2).ravel())


def _members(
    scene: Scene, plants: Mask, grid: Grid, options: SegmentationOptions
) -> list[tuple[Positions, tuple[str, ...]]]:
    """Return the points of every tree, and the flag of the pass that found it."""
    found, left = _one_pass(scene, np.flatnonzero(plants), grid, options)
    out: list[tuple[Positions, tuple[str, ...]]] = [(points, ()) for points in found]
    if options.understory:
        below, found = left, []
        for points, _ in out:
            gap = _gap(scene.height[points])
            below = np.concatenate([below, points[scene.height[points] < gap]])
            found.append(points[scene.height[points] >= gap])
        out = [(points, ()) for points in found]
        out += [(points, ("understory",)) for points in _one_pass(scene, np.sort(below), grid, options)[0]]
    return out


GAP_M = 2.0  # an empty layer this thick, in the lower 60 % of a tree, parts it from what grows below it


def _gap(height: Floats) -> float:
    """Height above which a tree's crown stands, clear of what grows below it; 0 where nothing does."""
    ordered = np.sort(height)
    wide = np.flatnonzero((np.diff(ordered) >= GAP_M) & (ordered[1:] <= 0.6 * ordered[-1]))
    return float(ordered[wide[-1] + 1]) if len(wide) else 0.0


def _one_pass(
    scene: Scene, plants: Positions, grid: Grid, options: SegmentationOptions
) -> tuple[list[Positions], Positions]:
    """Return the points of every tree of a canopy, and those that belong to none."""
    chm = canopy(scene.height[plants], scene.cells[plants], grid, options.smooth_cells)
    crowns = METHODS[options.detector](chm, grid.cell_m, options).ravel().astype(np.int32)
    top = crowns[scene.cells[plants]]
    order = np.argsort(top, kind="stable")
    top, plants = top[order], plants[order]
    del order  # a cloud of millions of points is not held more often than need be
    first = np.flatnonzero(np.diff(top, prepend=-2))
    groups = np.split(plants, first[1:]) if len(plants) else []
    tops = top[first].tolist()
    left = [g for g, t in zip(groups, tops, strict=True) if t < 0 or len(g) < options.min_points]
    kept = [g for g, t in zip(groups, tops, strict=True) if t >= 0 and len(g) >= options.min_points]
    return kept, np.concatenate([*left, np.empty(0, np.int64)]).astype(np.int64)
