"""The picture: bark, leaves and points of the crown in one scene, which the browser draws by itself."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
import pyvista as pv

from pipeline.mesh import Mesh
from pipeline.mesh.triangles import with_normals
from pipeline.model import Floats
from pipeline.studio.modelling import RGB, Modelled
from pipeline.synthetic.colonization.painting import leaf_picture
from pipeline.view.graphics import NoGraphicsError, prepare

SKY, HORIZON = "#dfe7ee", "#f7f7f4"
POINTS_RGB = (0.16, 0.42, 0.68)
POINT_PX = 3
AMBIENT, DIFFUSE = 0.35, 0.85
WHITE = (255, 255, 255)
MOST_LEAF_FACES = 400_000
"""Triangles of leaves that a browser draws at ease; of more, every second or third leaf is shown."""

BESIDE = (1.0, -3.4, 0.45)
"""Where one looks from at first, as multiples of the tree's height from its middle."""


class Scene:
    """Bark, leaves and points.

    Attributes
    ----------
    plotter : pyvista.Plotter
        Holds the scene; it never renders.
    """

    def __init__(self) -> None:
        with suppress(NoGraphicsError):  # nothing is drawn here, so that none is needed
            prepare()
        plotter: Any = pv.Plotter
        self.plotter = plotter(off_screen=True)
        self.plotter.set_background(HORIZON, top=SKY)
        self._bark = self._actor(lighting=True)
        self._leaves = self._actor(lighting=True)
        self._points = self._actor(lighting=False)
        self._points.prop.style, self._points.prop.point_size = "points", POINT_PX
        self._points.prop.color = POINTS_RGB
        self._points.visibility = False
        self._wood: Mesh | None = None
        self._foliage: Mesh | None = None
        self._holes = True
        self._spray = _texture(holes=True)
        self._leaves.texture = self._spray

    def show(self, modelled: Modelled) -> None:
        """Show a tree; a mesh that is shown already only gets its colours."""
        if modelled.wood is not self._wood:
            self._wood = modelled.wood
            self._bark.mapper.SetInputData(bark_surface(modelled.wood))
        if modelled.foliage is not self._foliage:
            self._foliage = modelled.foliage
            self._leaves.mapper.SetInputData(leaf_surface(modelled.foliage, modelled.options.leaf_type))
            self._dress(modelled)
        self.colour(modelled.bark, modelled.leaf)

    def colour(self, bark: RGB, leaf: RGB) -> None:
        """Give bark and leaves their colours."""
        self._bark.prop.color, self._leaves.prop.color = bark, leaf

    def _dress(self, modelled: Modelled) -> None:
        """Put the picture of a leaf on the leaves; it is white, the colour is the leaves' own."""
        holes = modelled.options.leaf_type != "triangle"
        if holes != self._holes:
            self._holes = holes
            self._spray.SetInputData(_texture(holes=holes).to_image())

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
    """Return the bark with smooth normals."""
    smooth = with_normals(mesh, np.zeros(len(mesh.faces), dtype=bool))
    surface = _surface(smooth)
    if smooth.normals is not None:
        surface.point_data.active_normals = smooth.normals.astype(np.float32)
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


def _texture(*, holes: bool) -> Any:
    make: Any = pv.Texture
    return make(leaf_picture(WHITE, 0, holes=holes))


def _surface(mesh: Mesh) -> Any:
    corners = np.column_stack([np.full(len(mesh.faces), 3), mesh.faces])
    return pv.PolyData(mesh.vertices.astype(np.float32), corners.ravel())
