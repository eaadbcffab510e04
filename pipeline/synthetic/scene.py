"""What a scanner looks at: a tree with or without leaves, its neighbours and the ground, as triangles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray
from pydantic import Field

from pipeline.errors import NotATreeError
from pipeline.geometry.surface import Tubes, nearest_tube
from pipeline.mesh import Mesh, MeshOptions, build
from pipeline.model import Floats, Ints, Skeleton, TreeModel
from pipeline.options import Options
from pipeline.synthetic.ground import Terrain, disc, terrain
from pipeline.synthetic.tubes import TubeTreeOptions, grow_tubes

WOOD, LEAF, GROUND, NEIGHBOUR = range(4)
SURFACES = ("wood", "leaf", "ground", "neighbour")
"""What a return comes from, by number; leaves of a neighbour are of the neighbour."""
LEAF_AREA = 0.31 * 0.87
"""Mean area of a leaf, as a share of the square of its nominal length: half its width, and its spread."""
MOST_LEAVES = 200
"""On one twig."""
SHORTEST_NEIGHBOUR_M, TALLEST_NEIGHBOUR_M = 2.0, 40.0


class SceneOptions(Options):
    """What stands there."""

    seed: int = Field(default=1, ge=0, description="the same seed gives the same scan")
    leaves: bool = Field(default=False, description="whether trees bear leaves")
    leaf_area_index: float = Field(
        default=2.0, gt=0, le=10, description="area of the leaves as a multiple of the crown's in plan"
    )
    leaf_size_m: float = Field(default=0.09, gt=0, le=0.5, description="length of a leaf in metres")
    leaf_zone_m: float = Field(
        default=0.6, gt=0, le=5, description="leaves grow on the last so many metres of every twig"
    )
    ground_radius_m: float = Field(
        default=4.0, ge=0, le=50, description="radius of the ground around the foot in metres; 0: none"
    )
    ground_slope_deg: float = Field(default=0.0, ge=0, le=45, description="slope of the ground in degrees")
    ground_roughness_m: float = Field(
        default=0.01, ge=0, le=0.5, description="standard deviation of the ground's bumps in metres"
    )
    neighbours: int = Field(default=0, ge=0, le=12, description="number of trees around this one")
    neighbour_distance_m: float = Field(
        default=5.0, gt=0, le=50, description="mean distance of the neighbours' stems in metres"
    )
    margin_m: float = Field(
        default=1.0, ge=0, le=50, description="returns farther beyond the crown are not kept, in metres"
    )
    facet_m: float = Field(
        default=0.0002, gt=0, le=0.02, description="largest gap of a flat side from round bark in metres"
    )


@dataclass(frozen=True, eq=False)
class Scene:
    """Triangles around the foot of the tree, which is their zero.

    Parameters
    ----------
    tree : TreeModel
        The one whose truth is wanted.
    vertices : (V, 3) array of float64
        Metres from the foot.
    faces : (F, 3) array of int32
    surface : (F,) array of uint8
        Index into `SURFACES`.
    branch : (F,) array of int32
        Branch of the tree (of a leaf: its twig); -1 elsewhere.
    ground : Terrain
    others : tuple of TreeModel
        The neighbours, their coordinates relative to the foot of the tree.
    """

    tree: TreeModel
    vertices: Floats
    faces: Ints
    surface: NDArray[np.uint8]
    branch: Ints
    ground: Terrain
    others: tuple[TreeModel, ...]

    @cached_property
    def foot(self) -> Floats:
        """(3,) foot of the tree, relative to the tree's origin."""
        return np.asarray(self.tree.skeleton.xyz[0])

    @cached_property
    def own(self) -> Floats:
        """(K, 3) corners of the tree's own triangles."""
        return np.asarray(self.vertices[self.faces[self.surface <= LEAF]].reshape(-1, 3))

    @cached_property
    def crown_radius(self) -> float:
        """How far the tree reaches from its foot in plan, metres."""
        return float(np.hypot(self.own[:, 0], self.own[:, 1]).max())

    @cached_property
    def height(self) -> float:
        """How far the tree reaches above its foot, metres."""
        return float(self.own[:, 2].max())

    def inside_wood(self, place: Floats) -> bool:
        """Return whether a place relative to the foot lies inside the wood of any tree."""
        return any(_inside(place, tree, zero) for tree, zero in self._standing())

    def _standing(self) -> list[tuple[TreeModel, Floats]]:
        return [(self.tree, self.foot), *((other, np.zeros(3)) for other in self.others)]


def set_scene(tree: TreeModel, options: SceneOptions, rng: Generator) -> Scene:
    """Draw the tree, what stands around it and the ground.

    Raises
    ------
    NotATreeError
        If the tree has no length that could be drawn.
    """
    foot = tree.skeleton.xyz[0]
    ground = terrain(options.ground_slope_deg, options.ground_roughness_m, rng)
    own = drawn(tree, options)
    if not len(own.faces):
        msg = "the tree has no wood that could be scanned; give a model of at least one segment"
        raise NotATreeError(msg)
    others = _neighbours(float(np.ptp(tree.skeleton.xyz[:, 2])), ground, options, rng)
    meshes = [drawn(other, options) for other in others]
    soil, squares = disc(ground, options.ground_radius_m)
    vertices = [own.vertices - foot, *(mesh.vertices for mesh in meshes), soil]
    faces = [own.faces, *(mesh.faces for mesh in meshes), squares]
    placed = np.cumsum([0, *(len(part) for part in vertices)])
    surface = [np.where(own.leaf, LEAF, WOOD)]
    surface += [np.full(len(mesh.faces), NEIGHBOUR) for mesh in meshes]
    surface.append(np.full(len(squares), GROUND))
    branch = np.full(sum(len(part) for part in faces), -1, dtype=np.int32)
    branch[: len(own.faces)] = own.branch
    return Scene(
        tree,
        np.concatenate(vertices),
        np.concatenate([part + start for part, start in zip(faces, placed[:-1], strict=True)]),
        np.concatenate(surface).astype(np.uint8),
        branch,
        ground,
        tuple(others),
    )


def drawn(tree: TreeModel, options: SceneOptions) -> Mesh:
    """Draw a tree as round as `facet_m` asks, with its thinnest twigs and, if wanted, its leaves."""
    fine = MeshOptions(
        min_radius_m=0.0005,
        max_deviation_m=options.facet_m,
        min_edge_m=0.001,
        min_sides=4 if options.facet_m > 0.001 else 6,
        max_sides=64,
    )
    if not options.leaves:
        return build(tree, options=fine)
    leafy = {
        "leaves": "quads",
        "leaf_size_m": options.leaf_size_m,
        "leaf_zone_m": options.leaf_zone_m,
        "leaves_per_tip": _leaves_per_twig(tree, options),
        "seed": options.seed,
    }
    return build(tree, options=fine.model_copy(update=leafy))


def _leaves_per_twig(tree: TreeModel, options: SceneOptions) -> int:
    """Return how many leaves each twig needs for the leaf area index."""
    twigs = tree.skeleton.xyz[tree.skeleton.tips, :2]
    spread = np.linalg.norm(twigs - twigs.mean(axis=0), axis=1)
    crown_m2 = np.pi * max(float(np.percentile(spread, 95)), 0.3) ** 2
    leaf_m2 = LEAF_AREA * options.leaf_size_m**2
    wanted = options.leaf_area_index * crown_m2 / leaf_m2 / len(tree.skeleton.paths)
    return int(np.clip(round(wanted), 1, MOST_LEAVES))


def _neighbours(height: float, ground: Terrain, options: SceneOptions, rng: Generator) -> list[TreeModel]:
    """Grow trees of about the same height in all directions."""
    first = rng.uniform(0, 2 * np.pi)
    trees = []
    for k in range(options.neighbours):
        azimuth = first + 2 * np.pi * (k + rng.uniform(-0.25, 0.25)) / options.neighbours
        away = options.neighbour_distance_m * rng.uniform(0.85, 1.15)
        tall = float(np.clip(height * rng.uniform(0.8, 1.1), SHORTEST_NEIGHBOUR_M, TALLEST_NEIGHBOUR_M))
        how = TubeTreeOptions(
            seed=int(rng.integers(2**31)), height_m=tall, trunk_radius_m=0.015 * tall, max_order=2
        )
        xy = away * np.array([np.cos(azimuth), np.sin(azimuth)])
        trees.append(_moved(grow_tubes(how), np.append(xy, ground.height(xy[None]))))
    return trees


def _moved(tree: TreeModel, shift: Floats) -> TreeModel:
    skeleton = tree.skeleton
    return replace(tree, skeleton=Skeleton(skeleton.xyz + shift, skeleton.parent))


def _inside(place: Floats, tree: TreeModel, zero: Floats) -> bool:
    """Return whether a place lies inside one of the tree's tubes."""
    xyz, parent = tree.skeleton.xyz - zero, tree.skeleton.parent[1:]
    tubes = Tubes(xyz[parent], xyz[1:], tree.start_radius[1:], tree.radius[1:])
    return bool(nearest_tube(place[None], tubes).surface[0] < 0)
