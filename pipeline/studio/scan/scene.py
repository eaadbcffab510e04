"""The picture of a scan: points, axes and cylinders of a model, and of a second one; the browser draws it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from pipeline.model import Floats, Skeleton, TreeModel
from pipeline.studio.canvas import empty_plotter
from pipeline.studio.scan.colouring import LEAF, PAIR, REST, Legend, Mode, graph_of, painted, plain
from pipeline.studio.scan.making import Result, Shown
from pipeline.studio.scan.shapes import Shape, axes, cylinders, evenly, shares, zero_of

Together = Literal["over", "side"]
"""How two models are shown: one over the other in two colours, or side by side."""

AMBIENT, DIFFUSE = 0.35, 0.8
POINT_PX, LINE_PX = 2, 2
BESIDE = (0.7, -3.4, 0.45)
"""Where one looks from at first, as multiples of the tree's size from its middle."""

APART = 1.25
"""How far apart two models stand side by side, as a multiple of the first one's width."""

POINTS = ("cloud", "leaves", "rest")
LAYERS = (*POINTS, "axes", "wood")
SECOND = ("other_axes", "other_wood")


class Drawn(NamedTuple):
    """What is drawn.

    Attributes
    ----------
    legends : tuple of Legend
    shown, points : int
        Points that are drawn, of how many.
    """

    legends: tuple[Legend, ...]
    shown: int
    points: int


class ScanScene:
    """Points, axes and cylinders.

    Attributes
    ----------
    plotter : pyvista.Plotter
        Holds the scene; it never renders.
    """

    def __init__(self) -> None:
        self.plotter = empty_plotter()
        self._actors = {name: self._actor(name) for name in (*LAYERS, *SECOND)}
        self._held: dict[str, bool] = {}
        self._shapes: dict[str, tuple[object, bytes, Shape]] = {}

    def show(self, shown: Shown, mode: Mode, together: Together) -> Drawn:
        """Show a result, and the one that it is compared with."""
        self._held = dict.fromkeys((*LAYERS, *SECOND), False)
        zero = zero_of(graph_of(shown.result.tree))
        result, other = shown.result, shown.other
        paint = painted(result, mode)
        drawn, points = self._points(result, paint.points, zero)
        over = other is not None and together == "over"
        self._model("", result.tree, plain(len(paint.segments), PAIR[0]) if over else paint.segments, zero)
        if other is None:
            return Drawn((paint.legend,), drawn, points)
        moved = (
            zero
            if shown.compared is None or shown.compared.shift_xyz_m is None
            else zero + shown.compared.shift_xyz_m
        )
        if over:
            count = len(graph_of(other.tree)) - 1
            self._model("other_", other.tree, plain(count, PAIR[1]), moved)
            pair = Legend("Two models", classes=((PAIR[0], "this one (A)"), (PAIR[1], "the other one (B)")))
            return Drawn((pair, paint.legend), drawn, points)
        width = float(np.ptp(graph_of(result.tree).xyz[:, :2], axis=0).max())
        beside = painted(other, mode)
        self._model("other_", other.tree, beside.segments, moved - np.array([APART * width + 0.5, 0.0, 0.0]))
        legends = (paint.legend,) if beside.legend == paint.legend else (paint.legend, beside.legend)
        return Drawn(legends, drawn, points)

    def switch(self, layers: Mapping[str, bool]) -> None:
        """Show and hide what there is; a second model follows the first one."""
        for name, actor in self._actors.items():
            actor.visibility = self._held.get(name, False) and layers.get(name.removeprefix("other_"), True)

    def has(self) -> dict[str, bool]:
        """Return which layers there are."""
        return {name: self._held.get(name, False) for name in LAYERS}

    def look(self) -> None:
        """Stand where all is seen from its side, z up."""
        low, high = np.reshape(self.plotter.bounds, (3, 2)).T
        middle, size = (low + high) / 2, float((high - low).max())
        self.plotter.camera_position = [tuple(middle + size * np.array(BESIDE)), tuple(middle), (0, 0, 1)]
        self.plotter.renderer.ResetCamera()
        self.plotter.camera.is_set = True

    def _points(self, result: Result, colours: NDArray[np.uint8], zero: Floats) -> tuple[int, int]:
        """Put points into the scene; return how many of how many."""
        used = None if result.used is None else result.used.world
        kinds = [used, result.leaves, result.rest]
        counts = [0 if points is None else len(points) for points in kinds]
        drawn = shares(counts)
        for name, points, most, colour in zip(POINTS, kinds, drawn, (None, LEAF, REST), strict=True):
            if points is None or not most:
                continue
            chosen = evenly(len(points), most)
            rgb = plain(len(chosen), colour) if colour else colours[chosen]
            self._put(name, pv.PolyData((points[chosen] - zero).astype(np.float32)), rgb)
        return sum(drawn), sum(counts)

    def _model(
        self, front: str, tree: TreeModel | Skeleton, colours: NDArray[np.uint8], zero: Floats
    ) -> None:
        if len(colours) == 0:
            return
        lines = self._shape(f"{front}axes", tree, zero)
        ends = np.column_stack([np.full(len(lines.cells), 2), lines.cells])
        self._put(
            f"{front}axes",
            pv.PolyData(lines.vertices.astype(np.float32), lines=ends.ravel()),
            colours[lines.segment],
        )
        if isinstance(tree, TreeModel):
            bark = self._shape(f"{front}wood", tree, zero)
            corners = np.column_stack([np.full(len(bark.cells), 3), bark.cells])
            surface: Any = pv.PolyData(bark.vertices.astype(np.float32), corners.ravel())
            if bark.normals is not None:
                surface.point_data.active_normals = bark.normals.astype(np.float32)
            self._put(f"{front}wood", surface, colours[bark.segment])

    def _shape(self, name: str, tree: TreeModel | Skeleton, zero: Floats) -> Shape:
        """Return the shape of a tree, made once."""
        held = self._shapes.get(name)
        if held is None or held[0] is not tree or held[1] != zero.tobytes():
            make = name.endswith("wood") and isinstance(tree, TreeModel)
            shape = (
                cylinders(tree, zero) if make and isinstance(tree, TreeModel) else axes(graph_of(tree), zero)
            )
            held = self._shapes[name] = tree, zero.tobytes(), shape
        return held[2]

    def _put(self, name: str, data: Any, rgb: NDArray[np.uint8]) -> None:
        data.point_data["rgb"] = rgb
        data.point_data.active_scalars_name = "rgb"
        self._actors[name].mapper.SetInputData(data)
        self._held[name] = True

    def _actor(self, name: str) -> Any:
        """Put something without a shape into the scene, coloured as its points say."""
        start = pv.PolyData(np.zeros((1, 3), dtype=np.float32))
        start.point_data["rgb"] = plain(1)
        actor = self.plotter.add_mesh(
            start, scalars="rgb", rgb=True, reset_camera=False, show_scalar_bar=False,
            lighting=name.endswith("wood"), render=False,
        )  # fmt: skip
        actor.prop.ambient, actor.prop.diffuse = AMBIENT, DIFFUSE
        actor.prop.line_width, actor.prop.point_size = LINE_PX, POINT_PX
        if name in POINTS:
            actor.prop.style = "points"
        actor.visibility = False
        return actor
