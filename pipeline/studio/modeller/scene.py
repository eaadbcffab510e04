"""The picture: bark, leaves, twigs that grow and points of the crown, which the browser draws by itself."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from pipeline.mesh import Mesh
from pipeline.mesh.triangles import with_normals
from pipeline.model import Floats
from pipeline.studio.canvas import empty_plotter
from pipeline.studio.modeller.modelling import Modelled
from pipeline.studio.modeller.pictures import Pixels
from pipeline.synthetic.colonization.painting import leaf_picture

Twigs = tuple[Floats, NDArray[np.integer]]
"""Nodes and their parents."""

POINTS_RGB = (0.16, 0.42, 0.68)
TWIGS_RGB = (0.35, 0.25, 0.16)
POINT_PX = 3
AMBIENT, DIFFUSE = 0.35, 0.85
WHITE = (255, 255, 255)
PLAIN_RGB = (1.0, 1.0, 1.0)
SPRAYS = {holes: leaf_picture(WHITE, 0, holes=holes) for holes in (False, True)}
"""What is painted on leaves, white: the colour is the leaves' own."""
MOST_LEAF_FACES = 400_000
"""Triangles of leaves that a browser draws at ease; of more, every second or third leaf is shown."""

BESIDE = (1.0, -3.4, 0.45)
"""Where one looks from at first, as multiples of the tree's height from its middle."""


class Scene:
    """Bark, leaves, twigs and points.

    Attributes
    ----------
    plotter : pyvista.Plotter
        Holds the scene; it never renders.
    bark, leaves : pyvista.Actor
    """

    def __init__(self) -> None:
        self.plotter = empty_plotter()
        self.bark, self.leaves = self._actor(lighting=True), self._actor(lighting=True)
        self._twigs, self._points = self._actor(lighting=False), self._actor(lighting=False)
        self._twigs.prop.color, self._points.prop.color = TWIGS_RGB, POINTS_RGB
        self._points.prop.style, self._points.prop.point_size = "points", POINT_PX
        self._twigs.visibility = self._points.visibility = False
        self._made: dict[str, tuple[Mesh, Any]] = {}
        self._worn: dict[tuple[str, int], tuple[Any, Pixels | None]] = {}

    def prepare(self, modelled: Modelled) -> tuple[Any, Any]:
        """Make the surfaces of bark and leaves, where they are others than the last; in any thread."""
        kind = modelled.options.leaf_type
        bark = self._once("bark", modelled.wood, bark_surface)
        return bark, self._once("leaves", modelled.foliage, lambda mesh: leaf_surface(mesh, kind))

    def show(self, modelled: Modelled) -> None:
        """Show a tree; a mesh that is shown already only gets its colours."""
        self._dress(modelled)
        for actor, surface in zip((self.bark, self.leaves), self.prepare(modelled), strict=True):
            if actor.mapper.GetInput() is not surface:
                actor.mapper.SetInputData(surface)
        self.grow(None)

    def _once(self, name: str, mesh: Mesh, make: Callable[[Mesh], Any]) -> Any:
        last, surface = self._made.get(name, (None, None))
        if last is not mesh:
            surface = make(mesh)
            self._made[name] = mesh, surface
        return surface

    def _dress(self, modelled: Modelled) -> None:
        """Give bark and leaves pictures of theirs, or their colours and what is painted."""
        skin, spray = modelled.skin, modelled.spray
        painted = SPRAYS[modelled.options.leaf_type != "triangle"]
        self.bark = self._wearing("bark", self.bark, skin)
        self.leaves = self._wearing("leaves", self.leaves, painted if spray is None else spray)
        self.bark.prop.color = modelled.bark if skin is None else PLAIN_RGB
        self.leaves.prop.color = modelled.leaf if spray is None else PLAIN_RGB

    def _wearing(self, part: str, actor: Any, pixels: Pixels | None) -> Any:
        """Return the actor that bears a picture, and put it in the place of the one that is shown.

        A browser does not draw another picture on what it has drawn, and knows things by where they lie in
        memory: every picture has an actor of its own, which is kept.
        """
        if (part, id(pixels)) not in self._worn:
            other = self._actor(lighting=True)
            if pixels is not None:
                other.texture = _texture(pixels)
            self._worn[part, id(pixels)] = other, pixels
        other = self._worn[part, id(pixels)][0]
        actor.visibility = False
        return other

    @property
    def growing(self) -> bool:
        """Whether twigs are shown instead of a tree."""
        return bool(self._twigs.visibility)

    def grow(self, nodes: Twigs | None) -> None:
        """Show the nodes of a growth and their parents instead of the tree, or the tree again."""
        if nodes is not None:
            self._twigs.mapper.SetInputData(_lines(*nodes))
        self._twigs.visibility = nodes is not None
        self.bark.visibility = self.leaves.visibility = nodes is None

    @property
    def shaping(self) -> bool:
        """Whether points of a crown are shown."""
        return bool(self._points.visibility)

    def shape(self, points: Floats | None) -> None:
        """Show the points of the crown that is being shaped, or none."""
        if points is not None:
            self._points.mapper.SetInputData(pv.PolyData(points.astype(np.float32)))
        self._points.visibility = points is not None

    def look(self) -> None:
        """Stand where the whole tree is seen from its side, z up."""
        low, high = np.reshape(self.plotter.bounds, (3, 2)).T
        middle, size = (low + high) / 2, float((high - low).max())
        self.plotter.camera_position = [tuple(middle + size * np.array(BESIDE)), tuple(middle), (0, 0, 1)]
        self.plotter.renderer.ResetCamera()
        self.plotter.camera.is_set = True

    def _actor(self, *, lighting: bool) -> Any:
        """Put something without a shape into the scene."""
        start = pv.PolyData(np.zeros((1, 3), dtype=np.float32))
        actor = self.plotter.add_mesh(
            start, reset_camera=False, show_scalar_bar=False, lighting=lighting, render=False
        )
        actor.prop.ambient, actor.prop.diffuse = AMBIENT, DIFFUSE
        return actor


def bark_surface(mesh: Mesh) -> Any:
    """Return the bark with smooth normals; with places in a picture its corners are the triangles' own."""
    smooth = with_normals(mesh, np.zeros(len(mesh.faces), dtype=bool))
    normals = np.asarray(smooth.normals, dtype=np.float32)
    if smooth.uv is None:
        surface = _surface(smooth)
        surface.point_data.active_normals = normals
        return surface
    corners = smooth.faces.ravel()
    apart = np.arange(len(corners), dtype=np.int32).reshape(-1, 3)
    surface = _surface(replace(smooth, vertices=smooth.vertices[corners], faces=apart, normals=None))
    surface.point_data.active_normals = normals[corners]
    surface.active_texture_coordinates = smooth.uv.reshape(-1, 2).astype(np.float32)
    return surface


def leaf_surface(mesh: Mesh, leaf_type: str) -> Any:
    """Return the leaves, every second or third of them where there are very many."""
    count = len(mesh.faces)
    if not count:
        return pv.PolyData(np.zeros((1, 3), dtype=np.float32))
    each = 1 if leaf_type == "triangle" else 4 if leaf_type.endswith("cross-foil") else 2
    every = -(-count // MOST_LEAF_FACES)
    leaves = mesh if every == 1 else mesh.only((np.arange(count) // each) % every == 0)
    surface = _surface(leaves)
    if leaves.uv is not None:  # no two leaves share a corner, so that each has one place in the picture
        places = np.zeros((len(leaves.vertices), 2), dtype=np.float32)
        places[leaves.faces] = leaves.uv
        surface.active_texture_coordinates = places
    return surface


def _lines(xyz: Floats, parent: NDArray[np.integer]) -> Any:
    """Return a line from every node to its parent."""
    child = np.flatnonzero(parent >= 0)
    lines = np.column_stack([np.full(len(child), 2), parent[child], child])
    return pv.PolyData(xyz.astype(np.float32), lines=lines.ravel())


def _texture(pixels: Pixels) -> Any:
    make: Any = pv.Texture
    return make(pixels)


def _surface(mesh: Mesh) -> Any:
    corners = np.column_stack([np.full(len(mesh.faces), 3), mesh.faces])
    return pv.PolyData(mesh.vertices.astype(np.float32), corners.ravel())
