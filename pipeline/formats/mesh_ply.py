"""Surfaces as PLY: triangles in world coordinates, each with the number of its branch."""

from __future__ import annotations

import os

import numpy as np

from pipeline.formats.ply import header
from pipeline.mesh import Mesh
from pipeline.output import write_bytes


def write(mesh: Mesh, path: str | os.PathLike[str]) -> None:
    """Write a mesh as binary PLY; where it has leaves, a property `leaf` tells them from bark.

    Parameters
    ----------
    mesh : Mesh
    path : path-like

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
            "vertex": (len(mesh.vertices), [f"double {axis}" for axis in "xyz"]),
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
    write_bytes(path, head + mesh.world.astype("<f8").tobytes() + faces.tobytes())
