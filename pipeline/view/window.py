"""One tree, cloud or mesh to look at: in a window, or as a picture."""

from __future__ import annotations

import os
from importlib import import_module
from typing import Any

import numpy as np

from pipeline.mesh import TubeOptions, tubes
from pipeline.model import Floats, PointCloud, Skeleton, TreeModel
from pipeline.output import whole_file
from pipeline.view.graphics import NoGraphicsError, prepare
from pipeline.view.picture import CLOUD_COLOURS, ORDER_COLOURS

MOST_POINTS = 500_000
THINNEST_M = 0.003
POINT_PX = 2.0
LINE_PX = 2.0
SIZE_PX = (1000, 1200)


def show(held: TreeModel | Skeleton | PointCloud | tuple[Floats, Any], title: str) -> None:
    """Open a window, and return when it is closed.

    Parameters
    ----------
    held : TreeModel, Skeleton, PointCloud, or (vertices, faces)
        Branch orders and heights have the colours of the pictures.
    title : str
        Of the window.

    Raises
    ------
    NoGraphicsError
        If there is no display.
    """
    if not (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or os.name == "nt"):
        msg = "no window can be opened: there is no display; draw with --screenshot F.png or --html F.html"
        raise NoGraphicsError(msg)
    plotter = _plotter(held, off_screen=False)
    plotter.show(title=title)


def screenshot(
    held: TreeModel | Skeleton | PointCloud | tuple[Floats, Any], path: str | os.PathLike[str]
) -> None:
    """Draw as PNG, as `show` would.

    Raises
    ------
    NoGraphicsError
        If there is no graphics library to draw with.
    OutputError
        If the file cannot be written.
    """
    plotter = _plotter(held, off_screen=True)
    try:
        with whole_file(path) as temporary:
            plotter.screenshot(str(temporary), return_img=False)
    finally:
        plotter.close()


def _plotter(held: TreeModel | Skeleton | PointCloud | tuple[Floats, Any], *, off_screen: bool) -> Any:
    if off_screen:
        prepare()
    vista = import_module("pyvista")  # late: slow to load, and `prepare` must come before
    plotter = vista.Plotter(off_screen=off_screen, window_size=list(SIZE_PX))
    plotter.set_background("white")
    if isinstance(held, TreeModel):
        _add_tree(vista, plotter, held)
    elif isinstance(held, Skeleton):
        _add_skeleton(vista, plotter, held)
    elif isinstance(held, PointCloud):
        _add_points(vista, plotter, held.xyz)
    else:
        vertices, faces = held
        surface = vista.PolyData.from_regular_faces(vertices - vertices.mean(axis=0), faces)
        plotter.add_mesh(surface, color=ORDER_COLOURS[0])
    plotter.view_xz()
    return plotter


def _add_tree(vista: Any, plotter: Any, tree: TreeModel) -> None:
    skeleton = tree.skeleton
    mesh = tubes(tree, options=TubeOptions(min_radius_m=THINNEST_M))
    rank = np.zeros(len(skeleton.paths), dtype=np.int64)
    rank[skeleton.branch] = skeleton.order
    order = np.minimum(rank[mesh.branch], len(ORDER_COLOURS) - 1)
    for number, colour in enumerate(ORDER_COLOURS):
        faces = mesh.faces[order == number]
        if len(faces):
            plotter.add_mesh(vista.PolyData.from_regular_faces(mesh.vertices, faces), color=colour)


def _add_skeleton(vista: Any, plotter: Any, skeleton: Skeleton) -> None:
    order = np.minimum(skeleton.order, len(ORDER_COLOURS) - 1)
    for number, colour in enumerate(ORDER_COLOURS):
        nodes = np.flatnonzero((order == number) & (skeleton.parent >= 0))
        if len(nodes):
            ends = np.column_stack([np.full(len(nodes), 2), skeleton.parent[nodes], nodes])
            lines = vista.PolyData(np.asarray(skeleton.xyz), lines=ends.ravel())
            plotter.add_mesh(lines, color=colour, line_width=LINE_PX)


def _add_points(vista: Any, plotter: Any, xyz: Floats) -> None:
    if len(xyz) > MOST_POINTS:
        xyz = xyz[np.linspace(0, len(xyz) - 1, MOST_POINTS).astype(np.intp)]
    plotter.add_mesh(
        vista.PolyData(np.asarray(xyz)),
        scalars=xyz[:, 2],
        cmap=list(CLOUD_COLOURS),
        style="points",
        point_size=POINT_PX,
        lighting=False,
        show_scalar_bar=False,
    )
