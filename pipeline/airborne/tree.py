"""One tree seen from the air: its place, its height, its crown, and what to know of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.airborne.ground import Terrain
from pipeline.airborne.outline import area, hull
from pipeline.airborne.raster import Mask
from pipeline.model import Floats

FOOT_SHARE = 0.7  # of the height: the foot is sought under the upper crown, not under side branches

Positions = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class AirborneTree:
    """One tree of a segmented cloud; coordinates are local to that cloud.

    Parameters
    ----------
    points : (N,) array of int64
        Its points, positions in the cloud, ascending.
    apex : (3,) array of float64
        Its highest point, in metres.
    ground_z : float
        Height of the terrain at the apex, in metres.
    base : (2,) array of float64
        Where the stem most likely stands, in metres.
    crown : (K, 2) array of float64
        Convex outline in plan, anticlockwise and not closed, in metres.
    crown_area_m2, crown_diameter_m : float
        Area of the outline, and the diameter of the circle of that area.
    first_return_density : float
        The tree's first returns on a square metre of its outline.
    flags : tuple of str
        Sorted: `near_building`, `no_ground`, `understory`.
    """

    points: Positions
    apex: Floats
    ground_z: float
    base: Floats
    crown: Floats
    crown_area_m2: float
    crown_diameter_m: float
    first_return_density: float
    flags: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Scene:
    """What every tree is described from."""

    xyz: Floats
    height: Floats
    cells: NDArray[np.int32]
    first_return: Mask
    near_building: Mask
    terrain: Terrain
    shift: Floats


def described(scene: Scene, points: Positions, found_as: tuple[str, ...]) -> AirborneTree:
    """Describe the tree of some points."""
    xyz = scene.xyz[points]
    apex = _apex(xyz)
    outline = hull(xyz[:, :2])
    raster = scene.terrain.raster
    ground_z = float(raster.at(apex[None, :2])[0])
    size = area(outline)
    flags = set(found_as)
    if scene.near_building[scene.cells[points]].any():
        flags.add("near_building")
    col, row = np.floor((apex[:2] - raster.corner) / raster.cell_m).astype(int)
    if scene.terrain.found[row, col]:
        flags.add("no_ground")
    firsts = int(np.count_nonzero(scene.first_return[points]))
    return AirborneTree(
        points,
        apex + scene.shift,
        ground_z + float(scene.shift[2]),
        _base(xyz, scene.height[points], apex) + scene.shift[:2],
        outline + scene.shift[:2],
        size,
        float(np.sqrt(4 * size / np.pi)),
        firsts / size if size > 0 else 0.0,
        tuple(sorted(flags)),
    )


def _apex(xyz: Floats) -> Floats:
    """(3,) highest point; of several the westernmost, then the southernmost."""
    tops = xyz[xyz[:, 2] == xyz[:, 2].max()]
    return np.asarray(tops[np.lexsort((tops[:, 1], tops[:, 0]))[0]] if len(tops) > 1 else tops[0])


def _base(xyz: Floats, height: Floats, apex: Floats) -> Floats:
    """Plan position of the stem's foot: halfway from the apex to the middle of the upper crown.

    The apex of a broad crown lies anywhere on it, the middle of a small one is drawn to its sunny side.
    """
    upper = xyz[height >= FOOT_SHARE * height.max(), :2]
    half = (len(upper) - 1) // 2
    middle = np.partition(upper, half, axis=0)[half]
    return np.asarray((middle + apex[:2]) / 2.0)
