"""Trees to draw, and what is to hold of every drawing."""

from __future__ import annotations

from collections import Counter

import numpy as np
import trimesh

from pipeline.mesh import Mesh
from pipeline.mesh.axes import Axes
from pipeline.model import Floats, Ints, Skeleton, TreeModel


def tree_of(xyz: object, parent: object, radius: object) -> TreeModel:
    skeleton = Skeleton(np.array(xyz, dtype=float), np.array(parent), np.array([1e5, 4e5, 0.0]), "EPSG:28992")
    count = len(skeleton)
    return TreeModel(skeleton, np.array(radius, dtype=float), np.zeros(count), np.full(count, np.nan))


def axis_of(xyz: object, radius: float = 0.01) -> TreeModel:
    count = len(np.array(xyz))
    return tree_of(xyz, np.arange(-1, count - 1), np.full(count, radius))


def singly(axes: Axes) -> list[Axes]:
    """Return every axis by itself."""
    each = np.repeat(axes.branch, np.diff(axes.first))
    return [axes.only(each == branch) for branch in axes.branch]


def solids(mesh: Mesh) -> list[trimesh.Trimesh]:
    return [
        trimesh.Trimesh(mesh.vertices, mesh.faces[mesh.branch == b], process=False)
        for b in np.unique(mesh.branch)
    ]


def assert_proper(mesh: Mesh) -> None:
    """Every tube is closed, faces outward, and keeps all that while its corners snap to a millimetre."""
    owner: dict[int, int] = {}
    for b in np.unique(mesh.branch):
        faces = mesh.faces[mesh.branch == b]
        for v in np.unique(faces).tolist():
            assert owner.setdefault(v, b) == b, "two tubes share a vertex"
        for step in (1e-4, 1e-3):
            _, snapped = np.unique(np.rint(mesh.vertices[faces.ravel()] / step), axis=0, return_inverse=True)
            corners = snapped.reshape(-1, 3).tolist()
            assert all(len(set(face)) == 3 for face in corners), f"a face collapses at {step} m"
            edges = Counter((f[k], f[k - 2]) for f in corners for k in range(3))
            assert set(edges.values()) == {1}
            assert all((b, a) in edges for a, b in edges)
        assert mesh.branch_volume[b] > 0
    assert np.array_equal(np.unique(mesh.faces), np.arange(len(mesh.vertices)))


def random_tree(count: int, seed: int) -> TreeModel:
    """Return a tapering tree with smooth axes, numbered path by path."""
    generator = np.random.default_rng(seed)
    xyz, parent, radius = [np.zeros(3)], [-1], [0.15]
    feet = [(0, np.array([0.0, 0.0, 1.0]), 0.15, count // 8)]
    while feet and len(xyz) < count:
        at, heading, thick, steps = feet.pop(0)
        for _ in range(min(steps, count - len(xyz))):
            heading = heading + generator.normal(0, 0.08, 3)
            heading /= np.linalg.norm(heading)
            xyz.append(xyz[at] + heading * generator.uniform(0.03, 0.12))
            parent.append(at)
            thick = max(0.97 * thick, 0.002)
            radius.append(thick)
            at = len(xyz) - 1
            if steps > 4 and generator.random() < 0.4:
                side = generator.normal(size=3)
                feet.append((at, side / np.linalg.norm(side), thick / 2, steps // 2))
    return tree_of(xyz, parent, radius)


def inside(points: Floats, vertices: Floats, faces: Ints) -> np.ndarray:
    """Tell which points a closed surface winds around (solid angles of its triangles)."""
    a, b, c = (vertices[faces[:, k]][None] - points[:, None] for k in range(3))
    la, lb, lc = (np.linalg.norm(side, axis=2) for side in (a, b, c))
    above = (a * np.cross(b, c)).sum(axis=2)
    below = la * lb * lc + (a * b).sum(axis=2) * lc + (b * c).sum(axis=2) * la + (c * a).sum(axis=2) * lb
    return np.arctan2(above, below).sum(axis=1) / (2 * np.pi) > 0.5


def distance(points: Floats, line: Floats) -> Floats:
    """Return how far points are from a crooked line."""
    step = np.diff(line, axis=0)
    square = np.maximum((step * step).sum(axis=1), 1e-30)
    off = points[:, None] - line[:-1]
    share = np.clip((off * step).sum(axis=2) / square, 0, 1)
    return np.linalg.norm(off - share[..., None] * step, axis=2).min(axis=1)
