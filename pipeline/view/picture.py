"""A picture of a cloud beside its model, drawn without a window."""

from __future__ import annotations

import os
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from pipeline.mesh import Mesh, TubeOptions, tubes
from pipeline.model import Floats, PointCloud, TreeModel
from pipeline.output import legible, whole_file
from pipeline.view.graphics import NoGraphicsError, prepare
from pipeline.view.options import PictureOptions

__all__ = ["NoGraphicsError", "picture"]

ORDERS = ("stem", "1st order", "2nd order", "3rd order", "4th and beyond")
ORDER_COLOURS = ("#6b4226", "#d98a04", "#2a9d5c", "#2477b3", "#a63d97")
"""Told apart with any colour vision (after Okabe and Ito, 2008)."""

CLOUD_COLOURS = ("#233f55", "#2f7f83", "#6fa04b")
"""Points from the ground to the top."""

INK, PALE = "#222222", "#777777"
ROWS = (0.12, 0.81, 0.07)
"""Shares of the picture's height: title, trees, legend."""

PANELS = (
    ("points", "front"),
    ("model", "front"),
    ("points", "turned by 90\u00b0"),
    ("model", "turned by 90\u00b0"),
)
MARGIN = 1.06
CAPTION = 0.09
"""Share of a panel's height kept free for its caption."""

FEW_POINTS = 150_000
THINNEST_PX = 1.6
"""Twigs are drawn at least so thick, lest they break up into dots."""


class Scene(NamedTuple):
    """What is drawn, relative to one origin, and the box around it."""

    points: Floats
    mesh: Mesh
    order: np.ndarray[Any, np.dtype[np.int64]]
    low: Floats
    high: Floats


def picture(
    tree: TreeModel,
    cloud: PointCloud,
    path: str | os.PathLike[str],
    *,
    title: str = "",
    options: PictureOptions | None = None,
) -> None:
    """Draw points and model side by side, from the front and turned by 90 degrees, as PNG.

    Parameters
    ----------
    tree : TreeModel
        Coloured by branch order.
    cloud : PointCloud
        The points that the model was made from.
    path : path-like
    title : str, optional
        The first line stands large above the picture, the second small below it.
    options : PictureOptions, optional

    Raises
    ------
    NoGraphicsError
        If there is no graphics library to draw with.
    OutputError
        If the file cannot be written.
    """
    options = options or PictureOptions()
    prepare()
    vista = import_module("pyvista")  # late: slow to load, and `prepare` must come before
    scene = _scene(tree, cloud, options)
    plotter = vista.Plotter(
        off_screen=True,
        shape=(3, 4),
        row_weights=ROWS,
        groups=[(0, slice(0, 4)), (2, slice(0, 4))],
        border=False,
        window_size=[options.width_px, options.height_px],
    )
    try:
        plotter.set_background("white")
        plotter.enable_anti_aliasing("msaa")
        _write_title(plotter, title, options)
        for number, (kind, view) in enumerate(PANELS):
            plotter.subplot(1, number)
            _draw_panel(vista, plotter, scene, (kind, view), options)
        _write_legend(vista, plotter, scene, options)
        with whole_file(path) as temporary:
            plotter.screenshot(str(temporary), return_img=False)
    finally:
        plotter.close()


def _scene(tree: TreeModel, cloud: PointCloud, options: PictureOptions) -> Scene:
    """Bring points and model to one origin, near which the float32 of graphics is enough."""
    skeleton = tree.skeleton
    points = cloud.xyz + (cloud.origin - skeleton.origin)
    if len(points) > options.most_points:
        points = points[np.linspace(0, len(points) - 1, options.most_points).astype(np.intp)]
    every = np.vstack([points, skeleton.xyz - tree.radius[:, None], skeleton.xyz + tree.radius[:, None]])
    low, high = every.min(axis=0), every.max(axis=0)
    pixel = 2 * _half_height(high - low, options) / (options.height_px * ROWS[1])
    thinnest = float(np.clip(THINNEST_PX / 2 * pixel, 0.001, 0.1))
    mesh = tubes(tree, options=TubeOptions(min_sides=options.least_sides, min_radius_m=thinnest))
    rank = np.zeros(len(skeleton.paths), dtype=np.int64)
    rank[skeleton.branch] = skeleton.order
    return Scene(points, mesh, np.minimum(rank[mesh.branch], len(ORDERS) - 1), low, high)


def _draw_panel(
    vista: Any, plotter: Any, scene: Scene, panel: tuple[str, str], options: PictureOptions
) -> None:
    kind, view = panel
    if kind == "points":
        _draw_points(vista, plotter, scene, options)
    else:
        _draw_model(vista, plotter, scene)
    _look(plotter, scene, turned=view != "front", options=options)
    text = f"{kind}, {view}"
    plotter.add_text(text, position=(0.056, 0.93), viewport=True, font_size=_size(13, options), color=PALE)


def _draw_points(vista: Any, plotter: Any, scene: Scene, options: PictureOptions) -> None:
    shades = vista.LookupTable(values=_ramp(CLOUD_COLOURS))
    shades.scalar_range = (scene.low[2], scene.high[2])
    plotter.add_mesh(
        vista.PolyData(scene.points),
        scalars=scene.points[:, 2],
        cmap=shades,
        style="points",
        point_size=_point_px(len(scene.points), options),
        lighting=False,
        show_scalar_bar=False,
    )


def _point_px(count: int, options: PictureOptions) -> float:
    """Size of a point: few points are drawn larger, lest they fade into the white."""
    sparse = float(np.clip((FEW_POINTS / max(count, 1)) ** 0.25, 1.0, 2.5))
    return options.point_px * sparse * options.width_px / 1800


def _draw_model(vista: Any, plotter: Any, scene: Scene) -> None:
    for rank, colour in enumerate(ORDER_COLOURS):
        faces = scene.mesh.faces[scene.order == rank]
        if len(faces):
            surface = vista.PolyData.from_regular_faces(scene.mesh.vertices, faces)
            plotter.add_mesh(surface, color=colour, ambient=0.25, diffuse=0.8, smooth_shading=False)


def _look(plotter: Any, scene: Scene, *, turned: bool, options: PictureOptions) -> None:
    """Look level at the middle, without perspective: all panels have one scale."""
    half = _half_height(scene.high - scene.low, options)
    centre = (scene.low + scene.high) / 2 + [0.0, 0.0, CAPTION * half]
    away = 10.0 * float(np.linalg.norm(scene.high - scene.low)) + 1.0
    camera = plotter.camera
    camera.position = centre + ([away, 0.0, 0.0] if turned else [0.0, -away, 0.0])
    camera.focal_point, camera.up = centre, (0.0, 0.0, 1.0)
    camera.parallel_projection = True
    camera.parallel_scale = half
    plotter.renderer.reset_camera_clipping_range()


def _half_height(size: Floats, options: PictureOptions) -> float:
    """Half the metres that a panel shows from bottom to top."""
    x, y, z = size.tolist()
    aspect = options.width_px / len(PANELS) / (options.height_px * ROWS[1])
    return MARGIN * float(max(z / (1 - CAPTION), max(x, y) / aspect, 0.1)) / 2


def _write_title(plotter: Any, title: str, options: PictureOptions) -> None:
    plotter.subplot(0, 0)
    name, _, rest = legible(title).partition("\n")
    plotter.add_text(name, position=(0.014, 0.5), viewport=True, font_size=_size(24, options), color=INK)
    plotter.add_text(rest, position=(0.014, 0.1), viewport=True, font_size=_size(15, options), color=INK)


def _write_legend(vista: Any, plotter: Any, scene: Scene, options: PictureOptions) -> None:
    """Name the colours that occur, and show how long some metres are."""
    plotter.subplot(2, 0)
    unit = options.width_px / 1800
    wide, high = options.width_px, options.height_px * ROWS[2]
    _flat_camera(plotter, wide, high)
    x = 0.014 * wide
    for rank in np.unique(scene.order).tolist():
        _bar(vista, plotter, (x, x + 24 * unit, 0.36 * high, 0.36 * high + 24 * unit), ORDER_COLOURS[rank])
        _note(plotter, ORDERS[rank], ((x + 36 * unit) / wide, 0.36), options)
        x += (80 + 15 * len(ORDERS[rank])) * unit
    metres, pixels = _scale_bar(scene, options)
    left = wide - 0.03 * wide - 80 * unit - pixels
    _bar(vista, plotter, (left, left + pixels, 0.48 * high, 0.48 * high + 5 * unit), INK)
    _note(plotter, f"{metres:g} m", ((left + pixels + 14 * unit) / wide, 0.36), options)


def _scale_bar(scene: Scene, options: PictureOptions) -> tuple[float, float]:
    """Choose a round length for the scale bar: metres, and pixels in the panels."""
    per_metre = options.height_px * ROWS[1] / (2 * _half_height(scene.high - scene.low, options))
    rounds = np.array([0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50])
    metres = float(rounds[np.argmin(np.abs(rounds * per_metre - options.width_px / 16))])
    return metres, metres * per_metre


def _flat_camera(plotter: Any, wide: float, high: float) -> None:
    """Let x and y of this panel be its pixels."""
    camera = plotter.camera
    camera.position, camera.focal_point = (wide / 2, high / 2, 10.0), (wide / 2, high / 2, 0.0)
    camera.up = (0.0, 1.0, 0.0)
    camera.parallel_projection = True
    camera.parallel_scale = high / 2
    camera.clipping_range = (1.0, 20.0)


def _bar(vista: Any, plotter: Any, box: tuple[float, float, float, float], colour: str) -> None:
    """Draw a filled rectangle (x from, to, y from, to)."""
    x0, x1, y0, y1 = box
    corners = np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]])
    face = vista.PolyData.from_regular_faces(corners, np.array([[0, 1, 2, 3]]))
    plotter.add_mesh(face, color=colour, lighting=False, reset_camera=False)


def _note(plotter: Any, text: str, position: tuple[float, float], options: PictureOptions) -> None:
    plotter.add_text(text, position=position, viewport=True, font_size=_size(13, options), color=INK)


def _size(points: float, options: PictureOptions) -> int:
    """Scale a font with the picture."""
    return max(6, round(points * options.width_px / 1800))


def _ramp(colours: tuple[str, ...]) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Blend colours into 256 steps of RGBA."""
    rgb = np.array([[int(c[k : k + 2], 16) for k in (1, 3, 5)] for c in colours], dtype=np.float64)
    at = np.linspace(0, len(colours) - 1, 256)
    mixed = [np.interp(at, np.arange(len(colours)), rgb[:, k]) for k in range(3)]
    return np.column_stack([*mixed, np.full(256, 255.0)]).astype(np.uint8)
