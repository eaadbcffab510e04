"""Surfaces as Wavefront OBJ: text that every 3-D program reads, with its materials in a file beside it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.mesh import Mesh
from pipeline.mesh.look import PLAIN, RGB, Look
from pipeline.model import Floats, Ints
from pipeline.output import write_bytes, write_text


def write(mesh: Mesh, path: str | os.PathLike[str], *, world: bool = False, look: Look = PLAIN) -> None:
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
    look : Look, optional
        Colours, and pictures where the mesh has uv; these lie beside as ``_bark.png`` and ``_leaf.png``.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    target = Path(path)
    beside = target.with_name(_name(target) + ".mtl")
    for picture, content in pictures(target, look).items() if mesh.uv is not None else ():
        write_bytes(picture, content)
    write_text(beside, _materials(target, look if mesh.uv is not None else _unpainted(look)))
    write_text(target, "".join(_lines(mesh, beside.name, world=world)))


def pictures(path: Path, look: Look) -> dict[Path, bytes]:
    """Return the picture files that stand beside an OBJ file, with their content."""
    held = {"bark": look.bark_png, "leaf": look.leaf_png}
    return {_picture(path, part): content for part, content in held.items() if content is not None}


def _name(path: Path) -> str:
    """Return the name of the files beside, without blanks."""
    return "_".join(path.stem.split())


def _picture(path: Path, part: str) -> Path:
    return path.with_name(f"{_name(path)}_{part}.png")


def _unpainted(look: Look) -> Look:
    return look._replace(bark_png=None, leaf_png=None)


def _materials(path: Path, look: Look) -> str:
    """Describe the materials; readers multiply the colour with the picture, which bears its own."""
    parts = [
        _material("bark", look.bark, path, painted=look.bark_png is not None),
        _material("leaf", look.leaf, path, painted=look.leaf_png is not None),
    ]
    return "# materials of a tree\n" + "\n".join(parts)


def _material(part: str, colour: RGB, path: Path, *, painted: bool) -> str:
    name = _picture(path, part).name
    holes = f"map_d {name}\n" if part == "leaf" else ""
    shown = (1.0, 1.0, 1.0) if painted else colour
    maps = f"map_Kd {name}\n{holes}" if painted else ""
    return f"newmtl {part}\nKd {' '.join(f'{round(c, 4):g}' for c in shown)}\nKs 0 0 0\nillum 1\n{maps}"


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
    smooth, place = mesh.normals is not None, None
    if mesh.uv is not None:
        places, number = np.unique(np.round(mesh.uv.reshape(-1, 2), 5), axis=0, return_inverse=True)
        place = number.reshape(-1, 3)
        yield _rows("vt %.5f %.5f\n", places)
    bark = np.flatnonzero(~mesh.leaf)
    bark = bark[np.argsort(mesh.branch[bark], kind="stable")]
    if len(bark):
        yield "o bark\nusemtl bark\n"
        for part in np.split(bark, np.flatnonzero(np.diff(mesh.branch[bark])) + 1):
            yield f"g branch_{mesh.branch[part[0]]}\n"
            yield _faces(mesh.faces[part], None if place is None else place[part], smooth=smooth)
    if mesh.leaf.any():
        yield "o leaves\ng leaves\nusemtl leaf\n"
        yield _faces(mesh.faces[mesh.leaf], None if place is None else place[mesh.leaf], smooth=smooth)


def _rows(line: str, values: Floats) -> str:
    """Write every row by one pattern, zero without a sign."""
    return line * len(values) % tuple((values + 0.0).ravel().tolist())


def _faces(faces: Ints, place: NDArray[np.intp] | None, *, smooth: bool) -> str:
    """Write triangles, counted from 1; a vertex and its normal have the same number."""
    corner = faces.astype(np.int64) + 1
    if place is not None:
        columns = [corner, place + 1, corner] if smooth else [corner, place + 1]
        one = "/".join(["%d"] * len(columns))
        return f"f {one} {one} {one}\n" * len(corner) % tuple(np.stack(columns, axis=2).ravel().tolist())
    if smooth:
        return "f %d//%d %d//%d %d//%d\n" * len(corner) % tuple(np.repeat(corner.ravel(), 2).tolist())
    return "f %d %d %d\n" * len(corner) % tuple(corner.ravel().tolist())
