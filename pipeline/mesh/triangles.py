"""`Mesh`: triangles that say which branch they belong to, and whether they are bark or leaf."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import ModelError
from pipeline.geometry.compiled import compiled
from pipeline.mesh.vector import cross, length, minus, mix, put, row
from pipeline.model import Floats, Ints

Flags = NDArray[np.bool_]

BARK_RGB = (0.44, 0.33, 0.24)
LEAF_RGB = (0.35, 0.53, 0.22)
"""Colours of the materials in files that have some, red, green and blue from 0 to 1."""

FAR_M = 1000.0
"""Beyond this distance from the zero, float32 is coarser than 0.06 mm: the zero is moved."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles that say which branch they belong to.

    Parameters
    ----------
    vertices : (V, 3) array of float64
        Metres relative to `origin`; no tube shares a vertex with another.
    faces : (F, 3) array of int32
        Corners of each triangle, counter-clockwise seen from outside.
    branch : (F,) array of int32
        Branch number of each face, as in `Skeleton.branch`; of a leaf, that of its twig.
    origin : (3,) array of float64
        Coordinates of the local zero.
    crs : str or None
        As in `PointCloud`.
    leaf : (F,) array of bool, optional
        Which faces are leaves; none where it is left out.
    normals : (V, 3) array of float64, optional
        Unit vectors for smooth shading; None where faces are flat.
    uv : (F, 3, 2) array of float64, optional
        Where in its picture every corner of a face lies, in widths and heights of the picture from its
        lower left; None where there are no pictures. Faces on both sides of a seam differ in it, so the
        vertices stay one.

    Raises
    ------
    ModelError
        If a face names a vertex that is not there, or the arrays differ in length.
    """

    vertices: Floats
    faces: Ints
    branch: Ints
    origin: Floats = field(default_factory=lambda: np.zeros(3))
    crs: str | None = None
    leaf: Flags = field(default_factory=lambda: np.zeros(0, dtype=bool))
    normals: Floats | None = None
    uv: Floats | None = None

    def __post_init__(self) -> None:
        vertices = np.asarray(self.vertices, dtype=np.float64).reshape(-1, 3).view()
        faces = np.asarray(self.faces, dtype=np.int32).reshape(-1, 3).view()
        branch = np.asarray(self.branch, dtype=np.int32).view()
        origin = np.asarray(self.origin, dtype=np.float64).view()
        leaf = np.asarray(self.leaf, dtype=bool).view()
        if not len(leaf):
            leaf = np.zeros(len(faces), dtype=bool)
        if branch.shape != (len(faces),) or origin.shape != (3,) or leaf.shape != branch.shape:
            msg = (
                f"a mesh of {len(faces)} faces has branch {branch.shape}, leaf {leaf.shape} "
                f"and origin {origin.shape}; give one entry a face, and three coordinates"
            )
            raise ModelError(msg)
        if len(faces) and (faces.min() < 0 or faces.max() >= len(vertices)):
            msg = f"a face names a vertex outside 0 to {len(vertices) - 1}; build the faces anew"
            raise ModelError(msg)
        held: dict[str, NDArray[Any]] = {
            "vertices": vertices,
            "faces": faces,
            "branch": branch,
            "origin": origin,
            "leaf": leaf,
        }
        if self.normals is not None:
            held["normals"] = np.asarray(self.normals, dtype=np.float64).view()
            if held["normals"].shape != vertices.shape:
                msg = f"{len(vertices)} vertices have normals {held['normals'].shape}; give one a vertex"
                raise ModelError(msg)
        if self.uv is not None:
            held["uv"] = np.asarray(self.uv, dtype=np.float64).view()
            if held["uv"].shape != (len(faces), 3, 2):
                msg = f"{len(faces)} faces have uv {held['uv'].shape}; give two numbers a corner"
                raise ModelError(msg)
        for name, array in held.items():
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @cached_property
    def world(self) -> Floats:
        """(V, 3) coordinates in the mesh's own reference system."""
        return np.asarray(self.vertices + self.origin)

    @cached_property
    def branch_volume(self) -> Floats:
        """(B,) volume of each tube in cubic metres, by branch number; 0 where none is drawn."""
        bark = ~self.leaf
        if not bark.any():
            return np.zeros(0)
        a, b, c = (self.vertices[self.faces[bark, k]] for k in range(3))
        six = np.einsum("ij,ij->i", a, np.cross(b, c))
        return np.asarray(np.bincount(self.branch[bark], six) / 6, dtype=np.float64)

    def near(self) -> Mesh:
        """Return the mesh with its zero so near that float32 keeps a tenth of a millimetre.

        Files and programs of float32 need it. A mesh that is near already is returned as it is; else
        the zero moves to whole metres beside its lowest corner.
        """
        if not len(self.vertices) or np.abs(self.vertices).max() <= FAR_M:
            return self
        shift = np.floor(self.vertices.min(axis=0))
        return replace(self, vertices=self.vertices - shift, origin=self.origin + shift)

    def only(self, faces: Flags) -> Mesh:
        """Return the chosen faces, with the vertices they use.

        Parameters
        ----------
        faces : (F,) array of bool
        """
        used, corner = np.unique(self.faces[faces], return_inverse=True)
        return replace(
            self,
            vertices=self.vertices[used],
            faces=corner.reshape(-1, 3).astype(np.int32),
            branch=self.branch[faces],
            leaf=self.leaf[faces],
            normals=None if self.normals is None else self.normals[used],
            uv=None if self.uv is None else self.uv[faces],
        )


def empty(origin: Floats, crs: str | None) -> Mesh:
    """Return a mesh without faces."""
    none = np.zeros((0, 3), dtype=np.int32)
    return Mesh(np.zeros((0, 3)), none, none[:, 0], origin, crs)


def together(first: Mesh, second: Mesh) -> Mesh:
    """Put two meshes of one origin into one, vertices and faces of `first` before those of `second`."""
    normals, uv = None, None
    if first.normals is not None and second.normals is not None:
        normals = np.concatenate([first.normals, second.normals])
    if first.uv is not None and second.uv is not None:
        uv = np.concatenate([first.uv, second.uv])
    return Mesh(
        np.concatenate([first.vertices, second.vertices]),
        np.concatenate([first.faces, second.faces + len(first.vertices)]),
        np.concatenate([first.branch, second.branch]),
        first.origin,
        first.crs,
        np.concatenate([first.leaf, second.leaf]),
        normals,
        uv,
    )


def with_normals(mesh: Mesh, flat: Flags) -> Mesh:
    """Return the mesh with a normal at every vertex: the mean of its faces, by area.

    Parameters
    ----------
    mesh : Mesh
    flat : (F,) array of bool
        Faces that do not bend the shade of their corners, such as the ends of a tube.
    """
    return replace(mesh, normals=_normals(mesh.vertices, mesh.faces, np.where(flat, 1e-9, 1.0)))


@compiled
def _normals(vertices: Floats, faces: Ints, weight: Floats) -> Floats:
    """(V, 3) mean directions of the faces around every vertex; straight up where there are none.

    Even weak faces count where there is nothing else.
    """
    square = np.empty((len(faces), 3))
    for f in range(len(faces)):
        foot = row(vertices, faces[f, 0])
        upright = cross(minus(row(vertices, faces[f, 1]), foot), minus(row(vertices, faces[f, 2]), foot))
        put((weight[f] * upright[0], weight[f] * upright[1], weight[f] * upright[2]), square, f)
    normals = np.zeros((len(vertices), 3))
    for k in range(3):
        for f in range(len(faces)):
            v = faces[f, k]
            put(mix(1.0, row(normals, v), 1.0, row(square, f)), normals, v)
    for v in range(len(vertices)):
        total = row(normals, v)
        size = length(total)
        if size > 0:
            put((total[0] / size, total[1] / size, total[2] / size), normals, v)
        else:
            put((0.0, 0.0, 1.0), normals, v)
    return normals
