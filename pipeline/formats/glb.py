"""Surfaces as GLB, the binary form of glTF 2.0: for browsers, game engines and Blender.

Written by hand, not by a library: the file has one short table and five or six arrays, and the same
tree has to give the same bytes.

References
----------
The Khronos Group (2021). glTF 2.0 Specification, version 2.0.1.
"""

from __future__ import annotations

import json
import os
import struct
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.mesh import Mesh
from pipeline.mesh.look import PLAIN, RGB, Look
from pipeline.model import Floats
from pipeline.output import write_bytes

FLOAT, UNSIGNED_INT = 5126, 5125
VERTICES, FACES = 34962, 34963
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942


def _material(name: str, colour: RGB, rough: float) -> dict[str, Any]:
    """Describe a dull material; glTF counts colours in linear light, not in that of screens."""
    surface: dict[str, Any] = {
        "baseColorFactor": [*(round(channel**2.2, 4) for channel in colour), 1.0],
        "metallicFactor": 0.0,
        "roughnessFactor": rough,
    }
    return {"name": name, "pbrMetallicRoughness": surface, "doubleSided": name == "leaf"}


def _described(name: str, look: Look, arrays: _Arrays, *, painted: bool) -> dict[str, Any]:
    """Describe the material of a part, storing its picture where the part has places for it."""
    bark = name == "bark"
    picture = (look.bark_png if bark else look.leaf_png) if painted else None
    colour = (1.0, 1.0, 1.0) if picture else look.bark if bark else look.leaf
    made = _material("bark" if bark else "leaf", colour, 0.95 if bark else 0.7)
    if picture:
        made["pbrMetallicRoughness"]["baseColorTexture"] = {"index": arrays.add_picture(picture)}
        made |= {} if bark else {"alphaMode": "MASK", "alphaCutoff": 0.5}
    return made


def write(mesh: Mesh, path: str | os.PathLike[str], *, look: Look = PLAIN) -> None:
    """Write a mesh as GLB.

    glTF has metres, y up and 32 bits: x stays, y becomes -z, z becomes y. The coordinates are local; the
    node ``tree`` says in its extras of which `origin` (x, y, z) and `crs`, and that is where a reader with
    64 bits moves it to. Below it stand the nodes ``bark`` and ``leaves``; the vertex attribute ``_BRANCH`` is
    the number of a vertex's branch. Smooth meshes have normals, others are shaded flat.

    Parameters
    ----------
    mesh : Mesh
    path : path-like
    look : Look, optional
        Colours, and pictures where the mesh has uv; these are held in the file.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    mesh = mesh.near()
    parts = [("bark", mesh.only(~mesh.leaf)), ("leaves", mesh.only(mesh.leaf))]
    parts = [(name, part) for name, part in parts if len(part.faces)]
    arrays = _Arrays()
    meshes = [
        {"name": name, "primitives": [_primitive(part, arrays, material)]}
        for material, (name, part) in enumerate(parts)
    ]
    root: dict[str, Any] = {"name": "tree", "extras": {"origin": mesh.origin.tolist(), "units": "m"}}
    if mesh.crs:
        root["extras"]["crs"] = mesh.crs
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "treepipe"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [root, *({"name": one["name"], "mesh": k} for k, one in enumerate(meshes))],
    }
    if meshes:
        root["children"] = list(range(1, len(meshes) + 1))
        painted = mesh.uv is not None
        materials = [_described(name, look, arrays, painted=painted) for name, _ in parts]
        document |= {"meshes": meshes, "materials": materials, **arrays.tables()}
    write_bytes(path, _packed(document, bytes(arrays.content)))


class _Arrays:
    """The binary part of a file, and the tables that say what lies where."""

    def __init__(self) -> None:
        self.content = bytearray()
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self.pictures: list[int] = []

    def add(self, values: NDArray[Any], kind: str, target: int, *, bounds: bool = False) -> int:
        """Append an array of 4-byte numbers and return the number of its accessor."""
        view = {"buffer": 0, "byteOffset": len(self.content), "byteLength": values.nbytes, "target": target}
        component = FLOAT if values.dtype.kind == "f" else UNSIGNED_INT
        accessor = {
            "bufferView": len(self.views),
            "componentType": component,
            "count": len(values),
            "type": kind,
        }
        if bounds:
            accessor |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        self.content += values.tobytes()
        self.views.append(view)
        self.accessors.append(accessor)
        return len(self.accessors) - 1

    def add_picture(self, content: bytes) -> int:
        """Append a PNG file, filled up to a multiple of four bytes, and return the number of its texture."""
        view = {"buffer": 0, "byteOffset": len(self.content), "byteLength": len(content)}
        self.pictures.append(len(self.views))
        self.views.append(view)
        self.content += content + b"\0" * (-len(content) % 4)
        return len(self.pictures) - 1

    def tables(self) -> dict[str, Any]:
        """Return the tables of the document."""
        buffers = [{"byteLength": len(self.content)}]
        tables: dict[str, Any] = {
            "buffers": buffers,
            "bufferViews": self.views,
            "accessors": self.accessors,
        }
        if self.pictures:
            tables["images"] = [{"bufferView": view, "mimeType": "image/png"} for view in self.pictures]
            tables["textures"] = [{"source": k} for k in range(len(self.pictures))]
        return tables


def _primitive(part: Mesh, arrays: _Arrays, material: int) -> dict[str, Any]:
    """Store the arrays of one material's triangles."""
    place = None
    if part.uv is not None:
        part, place = _unseamed(part, part.uv)
    branch = np.zeros(len(part.vertices), dtype="<f4")
    branch[part.faces.ravel()] = np.repeat(part.branch, 3)
    held = {"POSITION": arrays.add(_turned(part.vertices), "VEC3", VERTICES, bounds=True)}
    if part.normals is not None:
        held["NORMAL"] = arrays.add(_turned(part.normals), "VEC3", VERTICES)
    held["_BRANCH"] = arrays.add(branch, "SCALAR", VERTICES)
    if place is not None:
        held["TEXCOORD_0"] = arrays.add(place, "VEC2", VERTICES)
    faces = arrays.add(part.faces.astype("<u4").ravel(), "SCALAR", FACES)
    return {"attributes": held, "indices": faces, "material": material, "mode": 4}


def _unseamed(part: Mesh, uv: Floats) -> tuple[Mesh, NDArray[np.float32]]:
    """Return a mesh whose vertices each have one place in the picture, and the places, counted downwards."""
    rows = np.column_stack([part.faces.ravel(), np.round(uv.reshape(-1, 2), 5)])
    distinct, corner = np.unique(rows, axis=0, return_inverse=True)
    vertex = distinct[:, 0].astype(np.int64)
    split = replace(
        part,
        vertices=part.vertices[vertex],
        faces=corner.reshape(-1, 3).astype(np.int32),
        normals=None if part.normals is None else part.normals[vertex],
    )
    return split, np.column_stack([distinct[:, 1], 1.0 - distinct[:, 2]]).astype("<f4")


def _turned(vectors: Floats) -> NDArray[np.float32]:
    """Return vectors with y up, zero without a sign."""
    x, y, z = vectors.T
    return np.column_stack([x, z, -y]).astype("<f4") + np.float32(0)


def _packed(document: dict[str, Any], content: bytes) -> bytes:
    """Put the header and the chunks together, each filled up to a multiple of four bytes."""
    text = json.dumps(document, separators=(",", ":"), ensure_ascii=True, allow_nan=False).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), JSON_CHUNK) + text
    if content:
        chunks += struct.pack("<II", len(content), BINARY_CHUNK) + content
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
