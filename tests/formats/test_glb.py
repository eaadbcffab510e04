"""Meshes as GLB: by the letter of glTF 2.0, and as other programs read them."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from pipeline.formats import glb
from pipeline.mesh import Mesh, MeshOptions, build, tubes
from pipeline.model import TreeModel

LEAFY = MeshOptions(leaves="quads", smooth=True)
TO_YUP = np.array([[1, 0, 0], [0, 0, 1], [0, -1, 0]])
KINDS = {5126: ("<f4", 4), 5125: ("<u4", 4)}
WIDTHS = {"SCALAR": 1, "VEC3": 3}


def unpacked(path: Path) -> tuple[dict[str, Any], bytes]:
    """Take a file apart by the specification, section 4."""
    data = path.read_bytes()
    magic, version, size = struct.unpack_from("<4sII", data)
    assert (magic, version, size) == (b"glTF", 2, len(data))
    at, chunks = 12, []
    while at < len(data):
        length, kind = struct.unpack_from("<I4s", data, at)
        assert length % 4 == 0
        chunks.append((kind, data[at + 8 : at + 8 + length]))
        at += 8 + length
    assert [kind for kind, _ in chunks] in ([b"JSON"], [b"JSON", b"BIN\0"])
    return json.loads(chunks[0][1]), chunks[1][1] if len(chunks) > 1 else b""


def array(document: dict[str, Any], content: bytes, number: int) -> np.ndarray:
    accessor = document["accessors"][number]
    view = document["bufferViews"][accessor["bufferView"]]
    kind, size = KINDS[accessor["componentType"]]
    width = WIDTHS[accessor["type"]]
    assert view["byteOffset"] % size == 0
    assert view["byteLength"] == accessor["count"] * width * size
    values = np.frombuffer(content, kind, accessor["count"] * width, view["byteOffset"])
    return values.reshape(-1, 3) if width == 3 else values


def test_the_file_keeps_the_letter_of_the_specification(tree: TreeModel, tmp_path: Path) -> None:
    mesh = build(tree, options=LEAFY)
    glb.write(mesh, tmp_path / "t.glb")
    document, content = unpacked(tmp_path / "t.glb")
    assert document["asset"] == {"version": "2.0", "generator": "treepipe"}
    assert document["buffers"] == [{"byteLength": len(content)}]
    assert [node["name"] for node in document["nodes"]] == ["tree", "bark", "leaves"]
    assert document["nodes"][0]["children"] == [1, 2]
    assert [material["name"] for material in document["materials"]] == ["bark", "leaf"]
    assert [material["doubleSided"] for material in document["materials"]] == [False, True]
    seen = 0
    for part in document["meshes"]:
        (primitive,) = part["primitives"]
        held = {name: array(document, content, k) for name, k in primitive["attributes"].items()}
        corners = array(document, content, primitive["indices"])
        accessor = document["accessors"][primitive["attributes"]["POSITION"]]
        assert held["POSITION"].min(axis=0).tolist() == accessor["min"]
        assert held["POSITION"].max(axis=0).tolist() == accessor["max"]
        assert np.linalg.norm(held["NORMAL"], axis=1) == pytest.approx(1, abs=1e-5)
        assert {len(values) for values in held.values()} == {corners.max() + 1}
        seen += len(corners) // 3
    assert seen == len(mesh.faces)
    assert sum(view["byteLength"] for view in document["bufferViews"]) == len(content)


def test_trimesh_reads_the_same_triangles(tree: TreeModel, tmp_path: Path) -> None:
    mesh = build(tree, options=LEAFY)
    glb.write(mesh, tmp_path / "t.glb")
    scene = trimesh.load_scene(tmp_path / "t.glb", process=False)
    bark, leaves = scene.geometry["bark"], scene.geometry["leaves"]
    part = mesh.only(~mesh.leaf)
    assert bark.vertices == pytest.approx(part.vertices @ TO_YUP.T, abs=1e-6)
    assert np.array_equal(bark.faces, part.faces)
    assert bark.is_watertight
    assert bark.volume == pytest.approx(mesh.branch_volume.sum(), rel=1e-5)
    branch = np.asarray(bark.vertex_attributes["_BRANCH"]).ravel()
    assert np.array_equal(branch[part.faces[:, 0]], part.branch)
    assert len(leaves.faces) == mesh.leaf.sum()


def test_vtk_reads_the_same_triangles(tree: TreeModel, tmp_path: Path) -> None:
    mesh = tubes(tree)
    glb.write(mesh, tmp_path / "t.glb")
    reader = vtk.vtkGLTFReader()
    reader.SetFileName(str(tmp_path / "t.glb"))
    reader.Update()
    blocks = reader.GetOutput().NewIterator()
    seen = blocks.GetCurrentDataObject()
    assert vtk_to_numpy(seen.GetPoints().GetData()) == pytest.approx(mesh.vertices @ TO_YUP.T, abs=1e-6)
    assert seen.GetNumberOfCells() == len(mesh.faces)


def test_up_is_y_and_the_origin_is_said(tree: TreeModel, tmp_path: Path) -> None:
    glb.write(tubes(tree), tmp_path / "t.glb")
    document, content = unpacked(tmp_path / "t.glb")
    points = array(document, content, 0)
    assert points[:, 1].max() == pytest.approx(2.0, abs=0.02)
    extras = document["nodes"][0]["extras"]
    assert extras == {"origin": [121913.4, 487434.9, -0.3], "units": "m", "crs": "EPSG:28992"}
    assert "translation" not in document["nodes"][0]


def test_a_far_zero_is_moved_near(tree: TreeModel, tmp_path: Path) -> None:
    mesh = tubes(tree)
    glb.write(Mesh(mesh.world, mesh.faces, mesh.branch, np.zeros(3), mesh.crs), tmp_path / "t.glb")
    document, content = unpacked(tmp_path / "t.glb")
    points = array(document, content, 0).astype(float) @ TO_YUP + document["nodes"][0]["extras"]["origin"]
    assert points == pytest.approx(mesh.world, abs=1e-6)


def test_flat_meshes_have_no_normals_and_one_material(tree: TreeModel, tmp_path: Path) -> None:
    glb.write(tubes(tree), tmp_path / "t.glb")
    document, _ = unpacked(tmp_path / "t.glb")
    assert set(document["meshes"][0]["primitives"][0]["attributes"]) == {"POSITION", "_BRANCH"}
    assert [material["name"] for material in document["materials"]] == ["bark"]


def test_leaves_alone_are_green(tree: TreeModel, tmp_path: Path) -> None:
    mesh = build(tree, options=LEAFY)
    glb.write(mesh.only(mesh.leaf), tmp_path / "t.glb")
    document, _ = unpacked(tmp_path / "t.glb")
    primitive = document["meshes"][0]["primitives"][0]
    assert document["materials"][primitive["material"]]["name"] == "leaf"


def test_the_same_tree_gives_the_same_bytes(tree: TreeModel, tmp_path: Path) -> None:
    glb.write(build(tree, options=LEAFY), tmp_path / "a.glb")
    glb.write(build(tree, options=LEAFY), tmp_path / "b.glb")
    assert (tmp_path / "a.glb").read_bytes() == (tmp_path / "b.glb").read_bytes()


def test_an_empty_mesh_is_a_file(tmp_path: Path) -> None:
    none = np.zeros((0, 3))
    glb.write(Mesh(none, none, none[:, 0]), tmp_path / "t.glb")
    document, content = unpacked(tmp_path / "t.glb")
    assert content == b""
    assert set(document) == {"asset", "scene", "scenes", "nodes"}
