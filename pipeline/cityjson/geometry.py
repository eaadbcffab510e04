"""Shells and lines: the tubes of a tree on a grid of whole steps, the hull around them, the axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from pipeline.cityjson.grid import Whole, merged, only_used, steps
from pipeline.cityjson.options import CityjsonOptions
from pipeline.mesh import Mesh, TubeOptions, tubes
from pipeline.mesh.surface import axes_of, drawn
from pipeline.model import Floats, TreeModel

HULL_SHARE = 0.02
"""Corners of the hull stand at least this far apart, as a share of its diagonal: it is a sketch."""

FLATTEST_M = 0.002
"""A hull triangle is at least this wide, so that it survives snapping to a millimetre."""


@dataclass(frozen=True, eq=False)
class Drawing:
    """A tree as shells and lines on a grid.

    Parameters
    ----------
    shells : list of (lod, branch, faces)
        Faces are (F, 3) arrays of int64; the branch of the hull is -1.
    lines : list of (K,) array of int64
        Vertices along every branch from its foot; empty unless asked for.
    lines_tell_nodes : bool
        Whether every node has a vertex of its own, in the order of the nodes.
    vertices : (V, 3) array of int64
        Steps of `vertex_step_m` from `translate`; none twice, all used.
    translate : (3,) array of float64
        World coordinates of the vertices' zero.
    """

    shells: list[tuple[str, int, Whole]]
    lines: list[Whole]
    lines_tell_nodes: bool
    vertices: Whole
    translate: Floats


def draw(tree: TreeModel, options: CityjsonOptions, *, translate: Floats | None, lines: bool) -> Drawing:
    """Draw a tree: its hull (lod 1), the tubes of the main branches (2), of all branches (3).

    Parameters
    ----------
    tree : TreeModel
    options : CityjsonOptions
    translate : (3,) array of float64 or None
        World coordinates of the vertices' zero; None for the whole metres below the lowest corner.
    lines : bool
        Whether the axes of the branches are drawn too.

    Returns
    -------
    Drawing
    """
    whole = "3" in options.lods
    mesh = _bark(tree, options, whole=whole)
    if translate is None:
        low = mesh.vertices.min(axis=0) if len(mesh.vertices) else np.zeros(3)
        translate = np.floor(low + mesh.origin)
    points = mesh.vertices if whole and not lines else np.concatenate([mesh.vertices, tree.skeleton.xyz])
    vertices, number = merged(steps(points, mesh.origin, translate, options.vertex_step_m))
    bark, node = number[: len(mesh.vertices)], number[len(mesh.vertices) :]
    # the hull is that of the bark, or of the nodes where most of the bark is not drawn
    within = vertices[: (bark if whole else number).max(initial=-1) + 1]
    shells = _shells(tree, mesh, bark[mesh.faces], within, options)
    axes = [node[path] for path in tree.skeleton.paths] if lines else []
    vertices, parts = only_used(vertices, [*(faces for _, _, faces in shells), *axes])
    named = [
        (lod, branch, faces) for (lod, branch, _), faces in zip(shells, parts[: len(shells)], strict=True)
    ]
    told = bool((np.diff(node) > 0).all())
    return Drawing(named, parts[len(shells) :], told, vertices, translate)


def _bark(tree: TreeModel, options: CityjsonOptions, *, whole: bool) -> Mesh:
    """Return the tubes of all branches, or of the main ones alone."""
    how = TubeOptions(max_deviation_m=options.max_deviation_m)
    if whole:
        return tubes(tree, options=how)
    main = main_branches(tree, options.main_share)
    mesh, _ = drawn(axes_of(tree, how, main), tree.skeleton, how)
    return mesh


def _shells(
    tree: TreeModel, mesh: Mesh, faces: Whole, vertices: Whole, options: CityjsonOptions
) -> list[tuple[str, int, Whole]]:
    """Return the levels that are wanted; a tree that draws nothing has none."""
    if not len(faces):
        return []
    shells: list[tuple[str, int, Whole]] = []
    if "1" in options.lods:
        shells += [
            ("1", -1, shell) for shell in (hull(vertices, options.vertex_step_m),) if shell is not None
        ]
    cuts = np.flatnonzero(np.diff(mesh.branch)) + 1
    number = mesh.branch[np.concatenate([[0], cuts])].tolist()
    tube = list(zip(number, np.split(faces, cuts), strict=True))
    if "2" in options.lods:
        main = main_branches(tree, options.main_share)
        shells += [("2", b, shell) for b, shell in tube if main[b]]
    if "3" in options.lods:
        shells += [("3", b, shell) for b, shell in tube]
    return shells


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
