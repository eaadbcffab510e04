"""The picture of a year: its wood, what is picked on it, and the ground; the browser draws it."""

from __future__ import annotations

from collections import OrderedDict
from typing import Any, Literal

import numpy as np
import pyvista as pv

from pipeline.growth.state import Mask
from pipeline.model import Floats
from pipeline.studio.canvas import empty_plotter
from pipeline.studio.years.growing import Year
from pipeline.studio.years.limbs import Branch, Limbs
from pipeline.studio.years.rods import Rods, extent_of, rods

Colouring = Literal["age", "order", "source", "wood"]
COLOURINGS = {"age": "New wood", "order": "Order", "source": "Radius source", "wood": "Plain"}

AMBIENT, DIFFUSE = 0.35, 0.85
WOOD, YOUNG, NEWEST = (112, 80, 56), (122, 142, 66), (88, 178, 58)
"""Wood that stood at the start, that has grown since, and that is of the shown year."""
ORDERS = ((112, 80, 56), (196, 120, 52), (120, 150, 60), (60, 130, 170), (140, 90, 170), (190, 80, 110))
SOURCES = ((47, 120, 180), (120, 170, 90), (214, 150, 60))
"""Measured, propagated, allometric."""
PICKED, BORNE, PLACE = "#e53935", "#ffb300", "#111111"
"""The picked axis, what it bears above the picked place, and that place."""
KEPT = 40  # years whose bark is kept, so that the slider is quick
SWELL, LEAST = 1.25, 0.0014
"""How much thicker than wood its mark is, and the least radius of it, as a share of the tree's extent."""
BESIDE = (1.0, -3.4, 0.45)


class Scene:
    """Wood, marks and ground.

    Attributes
    ----------
    plotter : pyvista.Plotter
        Holds the scene; it never renders.
    """

    def __init__(self) -> None:
        self.plotter = empty_plotter()
        self._wood = self._actor()
        self._wood.mapper.SetScalarModeToUsePointData()
        self._axis, self._borne, self._place = self._actor(PICKED), self._actor(BORNE), self._actor(PLACE)
        self._bark: OrderedDict[int, tuple[Year, Rods, dict[str, Any]]] = OrderedDict()

    def show(self, year: Year, colouring: Colouring) -> None:
        """Show a year."""
        self._wood.mapper.SetInputData(self._surface(year, colouring))
        self._wood.visibility = len(year.tree) > 1

    def mark(self, limbs: Limbs | None, branch: Branch | None) -> None:
        """Mark a branch, or none."""
        for actor in (self._axis, self._borne, self._place):
            actor.visibility = branch is not None
        if limbs is None or branch is None:
            return
        borne = limbs.above(branch.metamer)
        axis = (limbs.axis == branch.start) & (np.arange(len(borne)) > 0)
        _put(self._axis, _tubes(limbs, axis))
        self._borne.visibility = bool((borne & ~axis).any())
        _put(self._borne, _tubes(limbs, borne & ~axis))
        size = max(0.9 * float(limbs.width[branch.metamer]), 3.0 * LEAST * extent_of(limbs.end))
        ball: Any = pv.Sphere
        _put(self._place, ball(radius=size, center=branch.place, theta_resolution=16, phi_resolution=16))

    def look(self) -> None:
        """Stand where the whole tree is seen from its side, z up."""
        low, high = np.reshape(self._wood.bounds, (3, 2)).T
        middle, size = (low + high) / 2, float((high - low).max())
        self.plotter.camera_position = [tuple(middle + size * np.array(BESIDE)), tuple(middle), (0, 0, 1)]
        self.plotter.renderer.ResetCamera(self._wood.bounds)
        self.plotter.camera.is_set = True

    def _surface(self, year: Year, colouring: Colouring) -> Any:
        """Return the bark of a year, from what is kept or anew."""
        key = id(year)
        if key not in self._bark or self._bark[key][0] is not year:
            self._bark[key] = (year, rods(year.tree), {})
        self._bark.move_to_end(key)
        while len(self._bark) > KEPT:
            self._bark.popitem(last=False)
        _, bark, made = self._bark[key]
        if colouring not in made:
            made.clear()
            surface = _polygons(bark.vertices, bark.faces)
            surface.point_data.active_normals = bark.normals
            surface.point_data["rgb"] = colours_of(year, colouring)[bark.node]
            surface.point_data.active_scalars_name = "rgb"
            made[colouring] = surface
        return made[colouring]

    def _actor(self, colour: str | None = None) -> Any:
        """Put something without a shape into the scene; without a colour it has its own."""
        start = pv.PolyData(np.zeros((1, 3), dtype=np.float32))
        own: dict[str, Any] = {"color": colour}
        if colour is None:
            start.point_data["rgb"] = np.zeros((1, 3), dtype=np.uint8)
            own = {"scalars": "rgb", "rgb": True}
        actor = self.plotter.add_mesh(start, reset_camera=False, show_scalar_bar=False, render=False, **own)
        actor.prop.ambient, actor.prop.diffuse = AMBIENT, DIFFUSE
        actor.visibility = False
        return actor


def colours_of(year: Year, colouring: Colouring) -> Any:
    """(N, 3) colours of the nodes of a year's tree, uint8."""
    tree = year.tree
    if colouring == "order":
        return np.array(ORDERS, dtype=np.uint8)[np.minimum(tree.skeleton.order, len(ORDERS) - 1)]
    if colouring == "source":
        return np.array(SOURCES, dtype=np.uint8)[tree.radius_source]
    colours = np.tile(np.array(WOOD, dtype=np.uint8), (len(tree), 1))
    if colouring == "age":
        born = born_of(year)
        colours[born > 0] = YOUNG
        colours[(born == year.number) & (born > 0)] = NEWEST
    return colours


def born_of(year: Year) -> Floats:
    """(N,) year in which the wood below each node has grown; 0 or less for what was there before.

    A node of young wood is the end of a metamer, to the bit; a node of scanned wood is in general not.
    """
    ends = year.limbs.end
    known = {end.tobytes(): born for end, born in zip(ends, year.limbs.birth_year.tolist(), strict=True)}
    return np.array([known.get(node.tobytes(), 0) for node in year.tree.skeleton.xyz])


def _tubes(limbs: Limbs, which: Mask) -> Any:
    """Return thick lines along some metamers."""
    rows = np.flatnonzero(which)
    if not len(rows):
        return pv.PolyData(np.zeros((1, 3), dtype=np.float32))
    points = np.stack([limbs.begin[rows], limbs.end[rows]], axis=1).reshape(-1, 3).astype(np.float32)
    lines = np.column_stack([np.full(len(rows), 2), np.arange(2 * len(rows)).reshape(-1, 2)])
    drawn: Any = pv.PolyData(points, lines=lines.ravel())
    radius = np.maximum(SWELL * limbs.width[rows] / 2.0, LEAST * extent_of(limbs.end))
    drawn.point_data["radius"] = np.repeat(radius, 2).astype(np.float32)
    tube = drawn.tube(scalars="radius", absolute=True, n_sides=6, capping=True).triangulate()
    tube.clear_data()
    return tube


def _polygons(vertices: Floats, faces: Any) -> Any:
    make: Any = pv.PolyData.from_regular_faces
    return make(vertices, faces)


def _put(actor: Any, shape: Any) -> None:
    actor.mapper.SetInputData(shape)
