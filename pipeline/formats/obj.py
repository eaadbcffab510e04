"""Surfaces as Wavefront OBJ: text that every 3-D program reads, with its materials in a file beside it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from pipeline.mesh import Mesh
from pipeline.mesh.triangles import BARK_RGB, LEAF_RGB
from pipeline.model import Floats, Ints
from pipeline.output import write_text

MATERIALS = f"""# materials of a tree
newmtl bark
Kd {" ".join(map(str, BARK_RGB))}
Ks 0 0 0
illum 1

newmtl leaf
Kd {" ".join(map(str, LEAF_RGB))}
Ks 0 0 0
illum 1
"""


def write(mesh: Mesh, path: str | os.PathLike[str], *, world: bool = False) -> None:
    """Write a mesh as OBJ, and its materials beside it as MTL.

    Coordinates are metres, z up, with six decimals. OBJ knows no reference system, and most of its
    readers keep no more than seven digits; so coordinates are local, and a comment says of what:
    ``# origin x y z EPSG:n``. Every branch is a group ``branch_n`` of the object ``bark``; the leaves are the
    object ``leaves``. Smooth meshes have vertex normals.

    Parameters
    ----------
    mesh : Mesh
    path : path-like
        The materials get the same name with ``.mtl``, blanks turned to underscores.
    world : bool, optional
        Write whole coordinates, for readers with 64 bits.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    target = Path(path)
    beside = target.with_name("_".join(target.stem.split()) + ".mtl")
    write_text(beside, MATERIALS)
    write_text(target, "".join(_lines(mesh, beside.name, world=world)))


def _lines(mesh: Mesh, materials: str, *, world: bool) -> Iterator[str]:
    """Yield the text piece by piece."""
    mesh = mesh.near()
    origin = np.zeros(3) if world else mesh.origin
    crs = mesh.crs if mesh.crs and mesh.crs.isascii() and len(mesh.crs.split()) == 1 else ""
    yield "# a tree as closed tubes: metres, z up; add the origin for whole coordinates\n"
    yield " ".join(["# origin", *map(repr, origin.tolist()), crs]).rstrip() + "\n"
    yield f"mtllib {materials}\n"
    yield _rows("v %.6f %.6f %.6f\n", np.round(mesh.world if world else mesh.vertices, 6))
    if mesh.normals is not None:
        yield _rows("vn %.4f %.4f %.4f\n", np.round(mesh.normals, 4))
    smooth = mesh.normals is not None
    bark = np.flatnonzero(~mesh.leaf)
    bark = bark[np.argsort(mesh.branch[bark], kind="stable")]
    if len(bark):
        yield "o bark\nusemtl bark\n"
        for part in np.split(bark, np.flatnonzero(np.diff(mesh.branch[bark])) + 1):
            yield f"g branch_{mesh.branch[part[0]]}\n"
            yield _faces(mesh.faces[part], smooth=smooth)
    if mesh.leaf.any():
        yield "o leaves\ng leaves\nusemtl leaf\n"
        yield _faces(mesh.faces[mesh.leaf], smooth=smooth)


def _rows(line: str, values: Floats) -> str:
    """Write every row by one pattern, zero without a sign."""
    return line * len(values) % tuple((values + 0.0).ravel().tolist())


def _faces(faces: Ints, *, smooth: bool) -> str:
    """Write triangles, counted from 1; a vertex and its normal have the same number."""
    corner = faces.astype(np.int64) + 1
    if smooth:
        return "f %d//%d %d//%d %d//%d\n" * len(corner) % tuple(np.repeat(corner.ravel(), 2).tolist())
    return "f %d %d %d\n" * len(corner) % tuple(corner.ravel().tolist())
