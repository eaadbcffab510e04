"""Vertices and solids: the tubes of a tree on a grid of whole steps, and the hull around them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from pipeline.cityjson.options import CityjsonOptions
from pipeline.mesh import Mesh, TubeOptions, tubes
from pipeline.model import Floats, TreeModel

Whole = NDArray[np.int64]

HULL_SHARE = 0.02
"""Corners of the hull stand at least this far apart, as a share of its diagonal: it is a sketch."""

FLATTEST_M = 0.002
"""A hull triangle is at least this wide, so that it survives snapping to a millimetre."""


def solids(
    tree: TreeModel, options: CityjsonOptions
) -> tuple[list[dict[str, Any]], Whole, NDArray[np.int64]]:
    """Draw a tree as CityJSON solids.

    Parameters
    ----------
    tree : TreeModel
    options : CityjsonOptions

    Returns
    -------
    geometry : list of dict
        One ``Solid`` each: the hull (lod 1), the tubes of the main branches (2), of all branches (3).
    vertices : (V, 3) array of int64
        Steps of `vertex_step_m` from `translate`; none twice, all used.
    translate : (3,) array of int64
        World coordinates of the vertices' zero, whole metres.
    """
    mesh = tubes(tree, options=TubeOptions(max_deviation_m=options.max_deviation_m))
    vertices, faces, translate = on_grid(mesh, options.vertex_step_m)
    parts: list[tuple[str, NDArray[Any]]] = []
    if "1" in options.lods and len(vertices):
        parts += [("1", shell) for shell in (hull(vertices, options.vertex_step_m),) if shell is not None]
    cuts = np.flatnonzero(np.diff(mesh.branch)) + 1
    by_branch = np.split(faces, cuts) if len(faces) else []
    number = mesh.branch[np.concatenate([[0], cuts])] if len(faces) else []
    main = main_branches(tree, options.main_share)
    if "2" in options.lods:
        parts += [("2", shell) for b, shell in zip(number, by_branch, strict=True) if main[b]]
    if "3" in options.lods:
        parts += [("3", shell) for shell in by_branch]
    vertices, shells = only_used(vertices, [shell for _, shell in parts])
    geometry = [
        {"type": "Solid", "lod": lod, "boundaries": [shell[:, None, :].tolist()]}
        for (lod, _), shell in zip(parts, shells, strict=True)
    ]
    return geometry, vertices, translate


def on_grid(mesh: Mesh, step: float) -> tuple[Whole, Whole, Whole]:
    """Round the vertices of a mesh to whole steps and merge those that become one.

    Parameters
    ----------
    mesh : Mesh
    step : float
        Metres.

    Returns
    -------
    vertices : (V, 3) array of int64
        Steps from `translate`, in the order of their first use.
    faces : (F, 3) array of int64
    translate : (3,) array of int64
        World coordinates of the zero, whole metres.
    """
    low = mesh.vertices.min(axis=0) if len(mesh.vertices) else np.zeros(3)
    translate = np.floor(low + mesh.origin)
    rounded = np.rint((mesh.vertices + (mesh.origin - translate)) / step).astype(np.int64)
    order = np.lexsort(rounded.T)
    first = np.ones(len(order), dtype=bool)
    first[1:] = (rounded[order[1:]] != rounded[order[:-1]]).any(axis=1)
    group = np.empty(len(order), dtype=np.int64)
    group[order] = np.cumsum(first) - 1
    speaker = np.full(int(first.sum()), len(order), dtype=np.int64)
    np.minimum.at(speaker, group, np.arange(len(order)))
    rank = np.empty(len(speaker), dtype=np.int64)
    rank[np.argsort(speaker)] = np.arange(len(speaker))
    return rounded[np.sort(speaker)], rank[group][mesh.faces], translate.astype(np.int64)


def main_branches(tree: TreeModel, share: float) -> NDArray[np.bool_]:
    """Tell which branches are main ones: the stem, and whatever is thick and grows from a main one.

    Parameters
    ----------
    tree : TreeModel
    share : float
        How thick a branch is at its start, as a share of the thickest radius of the stem.

    Returns
    -------
    (B,) array of bool
    """
    paths = tree.skeleton.paths
    limit = share * float(tree.radius[paths[0]].max())
    main = np.zeros(len(paths), dtype=bool)
    main[0] = True
    for b, above in enumerate(tree.skeleton.branch_parent.tolist()):
        if b:
            main[b] = main[above] and tree.start_radius[paths[b][1]] >= limit
    return main


def hull(vertices: Whole, step: float) -> NDArray[np.int64] | None:
    """Wrap the vertices in a coarse convex hull of well-shaped triangles.

    Parameters
    ----------
    vertices : (V, 3) array of int64
        Steps.
    step : float
        Metres.

    Returns
    -------
    (F, 3) array of int64 or None
        Corners into `vertices`, counter-clockwise from outside. None where the vertices are flat.
    """
    points = vertices.astype(np.float64)
    corners, _ = _wrapped(points, np.arange(len(points)))
    if corners is None:
        return None
    outermost = np.unique(corners)
    spacing = HULL_SHARE * float(np.linalg.norm(np.ptp(points, axis=0)))
    while spacing * step >= FLATTEST_M / 2:
        faces, width = _wrapped(points, outermost[spread(points[outermost], spacing)])
        if faces is not None and width * step >= FLATTEST_M:
            return faces
        spacing /= 2
    return None


def spread(points: Floats, spacing: float) -> NDArray[np.int64]:
    """Choose points that stand at least `spacing` apart and leave none farther than that from a chosen one.

    Parameters
    ----------
    points : (P, 3) array of float64
    spacing : float

    Returns
    -------
    (K,) array of int64
        Sorted positions. The first choice is the point that comes first by x, y, z; then always the farthest.
    """
    chosen = [int(np.lexsort(points.T[::-1])[0])]
    away = np.linalg.norm(points - points[chosen[0]], axis=1)
    while away.max() >= spacing:
        chosen.append(int(np.argmax(away)))
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.sort(np.array(chosen, dtype=np.int64))


def only_used(vertices: Whole, shells: list[NDArray[Any]]) -> tuple[Whole, list[NDArray[Any]]]:
    """Drop the vertices that no shell names, and renumber."""
    used = np.zeros(len(vertices), dtype=bool)
    for shell in shells:
        used[shell] = True
    number = np.cumsum(used) - 1
    return vertices[used], [number[shell] for shell in shells]


def _wrapped(points: Floats, chosen: NDArray[np.int64]) -> tuple[NDArray[np.int64] | None, float]:
    """Return the outward triangles of the hull of the chosen points, and the width of the flattest."""
    if len(chosen) < 4:
        return None, 0.0
    try:
        shell = ConvexHull(points[chosen])
    except QhullError:  # all in one plane
        return None, 0.0
    faces = chosen[shell.simplices]
    a, b, c = (points[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    inward = np.einsum("ij,ij->i", normal, shell.equations[:, :3]) < 0
    faces[inward] = faces[inward][:, ::-1]
    longest = np.max(
        [np.linalg.norm(b - a, axis=1), np.linalg.norm(c - b, axis=1), np.linalg.norm(a - c, axis=1)], 0
    )
    return faces, float((np.linalg.norm(normal, axis=1) / longest).min())
