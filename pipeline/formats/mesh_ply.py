"""Surfaces as PLY: triangles in world coordinates, each with the number of its branch."""

from __future__ import annotations

import os

import numpy as np

from pipeline.formats.ply import header
from pipeline.mesh import Mesh
from pipeline.mesh.look import Look
from pipeline.output import write_bytes


def write(mesh: Mesh, path: str | os.PathLike[str], *, look: Look | None = None) -> None:
    """Write a mesh as binary PLY; where it has leaves, a property `leaf` tells them from bark.

    Parameters
    ----------
    mesh : Mesh
    path : path-like
    look : Look, optional
        Gives every vertex a colour; without it there are none.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    crs = mesh.crs
    named = [f"crs {crs}"] if crs and crs.isascii() and len(crs.split()) == 1 else []
    has_leaves = bool(mesh.leaf.any())
    head = header(
        "binary_little_endian",
        ["units m", *named, "offset " + " ".join(map(repr, mesh.origin.tolist()))],
        {
            "vertex": (len(mesh.vertices), _vertex_columns(look)),
            "face": (
                len(mesh.faces),
                ["list uchar int vertex_indices", "int branch", *["uchar leaf"] * has_leaves],
            ),
        },
    )
    columns = [("size", "u1"), ("corner", "<i4", 3), ("branch", "<i4"), *[("leaf", "u1")] * has_leaves]
    faces = np.empty(len(mesh.faces), dtype=columns)
    faces["size"], faces["corner"], faces["branch"] = 3, mesh.faces, mesh.branch
    if has_leaves:
        faces["leaf"] = mesh.leaf
    write_bytes(path, head + _vertices(mesh, look) + faces.tobytes())


def _vertex_columns(look: Look | None) -> list[str]:
    colours = [f"uchar {channel}" for channel in ("red", "green", "blue")] if look else []
    return [*(f"double {axis}" for axis in "xyz"), *colours]


def _vertices(mesh: Mesh, look: Look | None) -> bytes:
    """Pack positions, and colours where there is a look."""
    if look is None:
        return mesh.world.astype("<f8").tobytes()
    packed = np.empty(len(mesh.vertices), dtype=[("xyz", "<f8", 3), ("rgb", "u1", 3)])
    packed["xyz"] = mesh.world
    packed["rgb"] = np.round(255 * np.array(look.bark))
    packed["rgb"][mesh.faces[mesh.leaf].ravel()] = np.round(255 * np.array(look.leaf))
    return packed.tobytes()
