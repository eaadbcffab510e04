"""Pictures of a tree in some years of its life, all at one scale, and the film of them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from scipy.spatial import cKDTree

from pipeline.mesh import Mesh, TubeOptions, tubes
from pipeline.model import Floats, TreeModel
from pipeline.output import legible, whole_file
from pipeline.view.graphics import prepare

WIDTH_PX, HEIGHT_PX = 1200, 800
MARGIN = 1.12
OLD, NEW, GROUND, INK = "#6b4226", "#4f9d3a", "#b9b09a", "#222222"
"""Wood of the year drawn before, wood that has come since, the line of the ground."""
THINNEST_PX = 1.0
FRAME_MS, LAST_MS = 400, 2000
VIEWS = ((0.0, -1.0), (1.0, 0.0))
"""From where the two panels look: from the front, and turned by 90 degrees."""

Box = tuple[Floats, Floats]


def box_of(trees: Sequence[TreeModel]) -> Box:
    """Return the lowest and highest coordinates of all nodes, relative to the first tree's origin."""
    every = np.concatenate([tree.skeleton.xyz for tree in trees])
    return every.min(axis=0), every.max(axis=0)


def draw_year(
    tree: TreeModel, path: str | os.PathLike[str], *, before: TreeModel | None, box: Box, title: str
) -> None:
    """Draw a tree from two sides as PNG; what has grown since another year is green.

    Parameters
    ----------
    tree : TreeModel
    path : path-like
    before : TreeModel or None
        The tree in that other year; all is brown without it.
    box : tuple of two (3,) arrays
        What all pictures show, as of `box_of`.
    title : str

    Raises
    ------
    NoGraphicsError
        If there is no graphics library to draw with.
    OutputError
        If the file cannot be written.
    """
    prepare()
    vista = import_module("pyvista")  # late: slow to load, and `prepare` must come before
    mesh = tubes(tree, options=TubeOptions(min_sides=5, min_radius_m=_thinnest(box)))
    is_new = _is_new(mesh, tree, before)
    plotter = vista.Plotter(off_screen=True, shape=(1, 2), border=False, window_size=[WIDTH_PX, HEIGHT_PX])
    try:
        plotter.set_background("white")
        plotter.enable_anti_aliasing("msaa")
        for panel, view in enumerate(VIEWS):
            plotter.subplot(0, panel)
            for colour, faces in ((OLD, mesh.faces[~is_new]), (NEW, mesh.faces[is_new])):
                if len(faces):
                    surface = vista.PolyData.from_regular_faces(mesh.vertices, faces)
                    plotter.add_mesh(surface, color=colour, ambient=0.3, diffuse=0.75)
            _look(plotter, vista, box, view)
        plotter.subplot(0, 0)
        plotter.add_text(legible(title), position=(0.02, 0.955), viewport=True, font_size=13, color=INK)
        with whole_file(path) as temporary:
            plotter.screenshot(str(temporary), return_img=False)
    finally:
        plotter.close()


def film(frames: Sequence[Path], path: str | os.PathLike[str]) -> None:
    """Join pictures into an animated GIF that runs for ever; the last one stands longer.

    Parameters
    ----------
    frames : sequence of Path
        PNG files, at least one.
    path : path-like
    """
    pictures = []
    for frame in frames:
        with Image.open(frame) as picture:
            half = picture.convert("RGB").resize((WIDTH_PX // 2, HEIGHT_PX // 2), Image.Resampling.LANCZOS)
            pictures.append(half.quantize(colors=64, dither=Image.Dither.NONE))
    shown = [FRAME_MS] * (len(pictures) - 1) + [LAST_MS]
    with whole_file(path) as temporary:
        pictures[0].save(
            temporary, format="GIF", save_all=True, append_images=pictures[1:], duration=shown, loop=0
        )


def _is_new(mesh: Mesh, tree: TreeModel, before: TreeModel | None) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """(F,) which faces are of young wood: not there before, nor below what was."""
    if before is None:
        return np.zeros(len(mesh.faces), dtype=bool)
    graph = tree.skeleton
    was = {node.tobytes() for node in before.skeleton.xyz}
    old = [node.tobytes() in was for node in graph.xyz]
    parent = graph.parent.tolist()
    for i in range(len(tree) - 1, 0, -1):
        old[parent[i]] |= old[i]
    middle = (graph.xyz + graph.xyz[np.maximum(graph.parent, 0)]) / 2.0
    apart = 10.0 * float(np.ptp(graph.xyz, axis=0).max() + 1.0)  # so that no other branch is near
    nodes = cKDTree(np.column_stack([middle, apart * graph.branch]))
    _, nearest = nodes.query(np.column_stack([mesh.vertices[mesh.faces].mean(axis=1), apart * mesh.branch]))
    return np.asarray(~np.array(old)[nearest])


def _half(box: Box) -> float:
    """Half the metres that a panel shows from bottom to top."""
    x, y, z = (box[1] - box[0]).tolist()
    aspect = WIDTH_PX / len(VIEWS) / HEIGHT_PX
    return float(MARGIN * max(z, x / aspect, y / aspect, 0.2) / 2.0)


def _thinnest(box: Box) -> float:
    pixel = 2.0 * _half(box) / HEIGHT_PX
    return float(np.clip(THINNEST_PX / 2.0 * pixel, 0.001, 0.1))


def _look(plotter: Any, vista: Any, box: Box, view: tuple[float, float]) -> None:
    """Look level at the middle of the box, without perspective, and draw the ground."""
    half, centre = _half(box), (box[0] + box[1]) / 2.0
    away = 10.0 * float(np.linalg.norm(box[1] - box[0])) + 1.0
    across = np.array([-view[1], view[0], 0.0]) * half
    level = np.array([centre[0], centre[1], box[0][2]])
    plotter.add_mesh(vista.Line(level - across, level + across), color=GROUND, line_width=2, lighting=False)
    camera = plotter.camera
    camera.position = centre + away * np.array([*view, 0.0])
    camera.focal_point, camera.up = centre, (0.0, 0.0, 1.0)
    camera.parallel_projection = True
    camera.parallel_scale = half
    plotter.renderer.reset_camera_clipping_range()
